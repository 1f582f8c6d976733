"""Mutated files for every reader: none may crash it, hang it, fill the memory or pass for the original."""
