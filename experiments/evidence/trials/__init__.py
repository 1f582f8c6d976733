"""Blind trials of the analysis: data with a hidden effect, by a generator kept apart, analysed and scored.

The record (`record/README.md`) has the commands. Publish the seals before the heaps are measured.
"""
