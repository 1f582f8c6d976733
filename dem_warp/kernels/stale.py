"""Values of a world's `stale` flag, which is 0 while its neighbour lists hold; the greatest wins."""

import warp as wp

SOME = wp.constant(1)
"""The entries of grains that have moved are made anew, and the others stay."""

ALL = wp.constant(2)
"""All its lists are made anew."""
