"""Levels and coverage of `doe` by simulation: every figure that it states against how often it holds."""
