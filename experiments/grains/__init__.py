"""Grains: sizes, clumps and files of spheres."""
