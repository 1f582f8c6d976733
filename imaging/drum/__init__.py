"""Rotating drums in pictures: the circle of the drum, and the surface of the bed in it."""
