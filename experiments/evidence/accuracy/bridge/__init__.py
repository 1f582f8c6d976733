"""Bridges to real codes: cards calibrated here, corrected and verified there, as a record."""
