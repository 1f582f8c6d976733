"""Outlines of heaps, and lines on their flanks."""
