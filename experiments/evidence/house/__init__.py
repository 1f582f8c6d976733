"""The size and the order of this repository."""
