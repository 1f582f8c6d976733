"""Measured sizes of grains: sieves, image analysers, distributions, and classes of them."""
