"""Designs of experiments: factors, terms, labels, and the families of designs."""
