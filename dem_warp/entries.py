"""Entries of the neighbour lists: 31 bits, the own sphere's number above the partner's number."""

MAX_SPHERES_PER_GRAIN = 256

_MAX_PARTNER_BITS = 27
"""Limit from the memory of a device."""


def partner_bits(sphere_count: int) -> int:
    """Return the bits of an entry for the partner (a sphere, a wall or a triangle).

    The bits above are for the spheres of a grain, at most `sphere_count`.
    """
    own = (sphere_count - 1).bit_length()
    return min(31 - own, _MAX_PARTNER_BITS)


def max_partners(sphere_count: int) -> int:
    """Return the largest number of partners in a world."""
    return 1 << partner_bits(sphere_count)
