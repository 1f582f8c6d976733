"""Entries of the neighbour lists: how many bits name a partner, and so how many partners there may be."""

SPHERE_BITS = 23
"""Bits of a neighbour entry that hold the partner (a sphere or a wall); above is the own sphere's number."""

SPHERE_MASK = (1 << SPHERE_BITS) - 1
MAX_PARTNERS = 1 << SPHERE_BITS
MAX_SPHERES_PER_GRAIN = 1 << (31 - SPHERE_BITS)
