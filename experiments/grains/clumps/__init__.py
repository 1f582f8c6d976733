"""Clumps for the shapes of grains."""
