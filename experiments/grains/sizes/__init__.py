"""Sizes of grains as they are measured: sieves, image analysers, distributions; and classes of them."""
