"""How much more outlines of heaps pin down than their angles, on twin data."""
