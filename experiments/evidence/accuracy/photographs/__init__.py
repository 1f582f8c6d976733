"""Photograph-like pictures with and without heaps, and how well `dem-warp angle` does on them."""
