"""Verification of the simulator: closed forms, published tests, an energy account; run, not imported."""
