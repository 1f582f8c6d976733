"""Clumps that stand for a grain's shape."""
