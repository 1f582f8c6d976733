"""Measured heaps: files, pictures and profiles to values. Invalid input raises `InputError`."""
