"""Grains: sizes, clumps and files of spheres. Invalid input raises `InputError`."""
