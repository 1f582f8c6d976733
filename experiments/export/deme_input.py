"""The lifted cylinder as a Python program of DEM-Engine."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from experiments.export.exporter import Translated, Translation
from experiments.export.lift import SIDES, Lift, disc
from experiments.export.same_rain import HEAP, SCRIPT, program, program_files, same_rain_rows, world_of

THICKNESS = 1.1
"""Thickness of the tube's wall, in radii of the largest sphere: triangles are felt from one side, up to a
radius behind them, so that a thinner wall would pull grains through."""

_ROWS = (
    Translated(
        "clumps", "rigid, mass properties of the union of the spheres", "the same, one template a grain"
    ),
    Translated(
        "tube's wall",
        "of no thickness",
        f"{THICKNESS:g} radii of the largest sphere thick, outside the tube: triangles have one side",
    ),
    Translated(
        "integration", "velocities, then places", "the same: `centered_difference`; velocities in float32"
    ),
    Translated(
        "start",
        "",
        "compiles for a minute or more; a file named by `DEME_PERSISTENT_JITIFY_CACHE` shortens later starts",
    ),
)


def translate_lift(
    lift: Lift,
    materials: Sequence[dict[str, float]],
    contacts: Sequence[dict[str, float]],
    warnings: tuple[str, ...],
    laws: Sequence[Translated],
) -> Translation:
    """Write the program and what it reads.

    Parameters
    ----------
    lift
        The test.
    materials, contacts
        Terms of the grains, the tube and the plate, and of their contacts with grains.
    warnings, laws
        What DEM-Engine lacks of the test, and the rows of the README on its contact laws.
    """
    scene, world = lift.scene, world_of(lift)
    numbers = {
        "materials": list(materials),
        "contacts": list(contacts),
        "release": scene.release(float(world.bounding_radii.max())),
        "domain": world.domain,
        "top_speed": scene.top_speed,
        "plate": scene.plate_diameter is not None,
    }
    walls = {
        "tube.obj": obj_text(thick_tube(scene.diameter / 2, scene.height, THICKNESS * lift.largest_radius))
    }
    if scene.plate_diameter is not None:
        walls["plate.obj"] = obj_text(disc(scene.plate_diameter / 2))
    return Translation(
        files=program_files(lift, world, program("DEM-Engine", "deme"), numbers) | walls,
        main=SCRIPT,
        command=("python3", SCRIPT),
        heap=HEAP,
        translated=(*same_rain_rows(lift), *laws, *_ROWS),
        warnings=warnings,
    )


def thick_tube(radius: float, height: float, thickness: float, sides: int = SIDES) -> np.ndarray:
    """Triangles of a tube with a wall, its inner sides touching a cylinder from outside [m].

    Returns
    -------
    numpy.ndarray
        Corners, (8 sides, 3, 3), counter-clockwise as seen from where grains are.
    """
    turns = np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False)
    corner = radius / np.cos(np.pi / sides)
    ring = np.column_stack([np.cos(turns), np.sin(turns), np.zeros(sides)])
    up = np.array([0.0, 0.0, height])
    inner, outer = ring * corner, ring * (corner + thickness)
    # a quadrangle between two rings, seen from its front, runs first along the one, then back along the other
    pairs = ((inner + up, inner), (outer, outer + up), (inner, outer), (outer + up, inner + up))
    return np.concatenate([_between(first, second) for first, second in pairs])


def _between(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    after, next_second = np.roll(first, -1, axis=0), np.roll(second, -1, axis=0)
    halves = [(first, after, next_second), (first, next_second, second)]
    return np.concatenate([np.stack(corners, axis=1) for corners in halves])


def obj_text(triangles: np.ndarray) -> str:
    """Write triangles as a Wavefront file, each corner once [m]."""
    corners, numbers = np.unique(triangles.reshape(-1, 3).round(12), axis=0, return_inverse=True)
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in corners]
    lines += [f"f {a} {b} {c}" for a, b, c in (numbers.reshape(-1, 3) + 1).tolist()]
    return "\n".join([*lines, ""])
