"""Candidates for the study's base: law, clump and plate together, and how the heaps are read."""
