"""Sensitivity of the paper's angles to what the paper does not say."""
