"""What an analysis is given: what may vary, measured replicates, rules, and whatever answers points."""
