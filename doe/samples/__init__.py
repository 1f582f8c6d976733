"""Comparison of samples: noise floor, means, agreement."""
