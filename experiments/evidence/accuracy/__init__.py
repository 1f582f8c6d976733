"""Accuracy of photographs, outlines, statistics and cards on other codes."""
