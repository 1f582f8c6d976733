"""Most neighbours of a world's grains: room that no packing of them should pass."""

from itertools import product

import numpy as np

from dem_warp.model import WorldSetup
from dem_warp.triangles import meshes_of, most_within


def neighbour_room(world: WorldSetup) -> tuple[int, int]:
    """Partners of a sphere and entries of a grain that no packing of the world's grains should pass.

    Raises
    ------
    ValueError
        If there are more than the lists of a world can have.
    """
    found, listed = 16, 32
    for shape, others in product(world.shapes, repeat=2):
        reach = shape.radii.mean() + others.radii.mean() + world.skin + world.reach
        per_volume = 0.7 * others.sphere_count / others.volume
        around = per_volume * (4 / 3 * np.pi * reach**3)
        found = max(found, int(1.5 * around) + 16)
        listed = max(listed, int(shape.sphere_count * around * 0.7) + 32)
    triangles = _triangles_near(world)
    listed += triangles * max(shape.sphere_count for shape in world.shapes)
    # two lists, whose places are counted in 32 bits
    if 2 * world.grains.count * (listed + 8) >= 2**31:
        raise ValueError(
            f"WorldSetup.skin: lists of {listed:,} neighbours for each of {world.grains.count:,} grains are "
            f"too long, got a skin of {world.skin:g} [m]: lower it"
        )
    return found + triangles, -(-listed // 8) * 8


def _triangles_near(world: WorldSetup) -> int:
    """Triangles that a sphere lists at the most, and some more."""
    reach = world.largest_sphere + world.skin + world.reach
    return sum(int(1.5 * most_within(mesh, reach)) + 8 for mesh in meshes_of([world]))
