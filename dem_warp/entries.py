"""Entries of the neighbour lists: 31 bits, the own sphere's number above the partner's."""

MAX_SPHERES_PER_GRAIN = 256

_MAX_PARTNER_BITS = 24
"""Lists of more partners would need more memory than one device has."""


def partner_bits(sphere_count: int) -> int:
    """Bits of an entry that hold the partner (a sphere, a wall or a triangle).

    Parameters
    ----------
    sphere_count
        Spheres of the grain that has most of them; their numbers take the bits above.
    """
    own = (sphere_count - 1).bit_length()
    return min(31 - own, _MAX_PARTNER_BITS)


def max_partners(sphere_count: int) -> int:
    """Partners that the entries of a world can tell apart."""
    return 1 << partner_bits(sphere_count)
