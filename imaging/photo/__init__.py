"""Heaps found on photographs."""
