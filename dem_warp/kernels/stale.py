"""Values of a world's `stale` flag, which is 0 while its neighbour lists are valid."""

import warp as wp

SOME = wp.constant(1)
"""Only the entries of moved grains are rebuilt."""

ALL = wp.constant(2)
"""All lists are rebuilt."""
