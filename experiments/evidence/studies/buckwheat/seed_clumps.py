"""Other clumps for the same measured grain: what the paper's own nine spheres may have looked like.

    python -m experiments.evidence.studies.buckwheat.seed_clumps

writes them into the folder ``clumps`` beside this file.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh

from dem_warp import ClumpShape
from dem_warp.clump_fitting import fit_clump

FOLDER = Path(__file__).with_name("clumps")

HEIGHT, EDGE = 5.90e-3, 3.93e-3
"""Measured mean height and base edge of a grain [m]."""

CORNER_RADIUS = EDGE / math.sqrt(3.0)
"""From the axis to a corner of the base [m]; a flat face is half as far."""


@dataclass(frozen=True)
class Recipe:
    """Recipe of a clump: a solid, filled with spheres, which are scaled into the measured size."""

    spheres: int
    face: float
    """From the axis to the middle of a base edge, over that of a flat face: below 1 the edges are keels."""
    protrusion: float = 0.3e-3
    """Largest distance that a sphere may pass the solid's surface by [m]."""

    def solid(self) -> trimesh.Trimesh:
        """Return A pyramid of the measured size whose three faces are bent inward or outward [m]."""
        turns = np.arange(6) * math.pi / 3.0
        radii = np.where(np.arange(6) % 2, 0.5 * self.face * CORNER_RADIUS, CORNER_RADIUS)
        ring = np.column_stack([radii * np.cos(turns), radii * np.sin(turns), np.zeros(6)])
        vertices = np.vstack([ring, [[0.0, 0.0, 0.0], [0.0, 0.0, HEIGHT]]])
        sides = [[i, (i + 1) % 6, 7] for i in range(6)]
        base = [[(i + 1) % 6, i, 6] for i in range(6)]
        return trimesh.Trimesh(vertices, sides + base)

    def clump(self) -> ClumpShape:
        """Fill the solid, and scale the spheres until they reach the measured height or the base edge."""
        shape = fit_clump(self.solid(), self.spheres, self.protrusion).shape
        *across, height = sorted(extents(shape))
        scale = min(HEIGHT / height, EDGE / max(across))
        return ClumpShape.from_spheres(shape.centers * scale, shape.radii * scale)


def extents(shape: ClumpShape) -> list[float]:
    """Size of a clump along each of its principal axes [m]."""
    radii = shape.radii[:, None]
    return list((shape.centers + radii).max(axis=0) - (shape.centers - radii).min(axis=0))


CLUMPS = {
    "flat-9": Recipe(9, face=1.0),
    "keeled-9": Recipe(9, face=0.6),
    "swelling-9": Recipe(9, face=1.15),
    "bulging-9": Recipe(9, face=1.35),
    "flat-5": Recipe(5, face=1.0),
    "flat-15": Recipe(15, face=1.0),
    "flat-30": Recipe(30, face=1.0),
}
"""Clumps by the name of their file: four of nine spheres, and three of other counts in the flat solid."""


def main() -> None:
    """Write every clump's file."""
    FOLDER.mkdir(exist_ok=True)
    for name, recipe in CLUMPS.items():
        recipe.clump().write(FOLDER / f"{name}.txt")


if __name__ == "__main__":
    main()
