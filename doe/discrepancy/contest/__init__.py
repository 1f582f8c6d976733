"""The gap of the base, and the mechanisms that compete to explain it."""
