"""Drawn pictures of rotating drums, and how well `dem-warp angle --drum` does on them."""
