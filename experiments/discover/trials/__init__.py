"""Blind trials of the analysis: data with a hidden effect, by a generator kept apart, analysed and scored."""
