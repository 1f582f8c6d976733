"""Gain of outlines of heaps over their angles in what they pin down, on twin data."""
