"""Designs of experiments: factors, points, terms, and the families of designs."""
