"""Screening designs' analysis and the path of steepest ascent."""
