"""Capacities of the neighbour lists, from the densest packing of a world's grains."""

from itertools import product

import numpy as np

from dem_warp.model import WorldSetup
from dem_warp.triangles import meshes_of, most_within


def neighbour_room(world: WorldSetup) -> tuple[int, int]:
    """Return the largest expected numbers of partners of a sphere and of entries of a grain."""
    found, listed = 16, 32
    for shape, others in product(world.shapes, repeat=2):
        reach = shape.radii.mean() + others.radii.mean() + world.skin + world.reach
        per_volume = 0.7 * others.sphere_count / others.volume
        around = per_volume * (4 / 3 * np.pi * reach**3)
        found = max(found, int(1.5 * around) + 16)
        listed = max(listed, int(shape.sphere_count * around * 0.7) + 32)
    triangles = _triangles_near(world)
    listed += triangles * max(shape.sphere_count for shape in world.shapes)
    # indices of the two lists have 32 bits
    if 2 * world.grains.count * (listed + 8) >= 2**31:
        raise ValueError(
            f"WorldSetup.skin: must be smaller for {world.grains.count:,} grains, got {world.skin:g} [m]: "
            f"{listed:,} neighbours per grain are too many"
        )
    return found + triangles, -(-listed // 8) * 8


def _triangles_near(world: WorldSetup) -> int:
    """Return the largest expected number of triangles in the list of a sphere."""
    reach = world.largest_sphere + world.skin + world.reach
    return sum(int(1.5 * most_within(mesh, reach)) + 8 for mesh in meshes_of([world]))
