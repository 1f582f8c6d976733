"""Input of an analysis: ranges, measured replicates, rules, and the simulator."""
