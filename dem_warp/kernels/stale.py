"""Values of a world's `stale` flag, which is 0 while its neighbour lists hold."""

import warp as wp

ALL = wp.constant(1)
"""All its lists are made anew."""

SOME = wp.constant(2)
"""On a CPU: the entries of grains that have moved are, and the others stay."""
