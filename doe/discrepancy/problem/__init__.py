"""Input of an analysis: what may vary, measured replicates, the rules, and whatever answers points."""
