"""DEM-Engine (package ``deme``): its frictional Hertzian model, driven by a Python program."""

from __future__ import annotations

import math

import numpy as np

from experiments.export.code_table import CodeTest, code_exporter
from experiments.export.exporter import Translation
from experiments.export.lift import SIDES, disc
from experiments.export.same_rain import SCRIPT, program_translation, world_of

THICKNESS = 1.1
"""Thickness of the tube's wall, in radii of the largest sphere: triangles are felt from one side, up to a
radius behind them, so that a thinner wall would pull grains through."""


def translate(test: CodeTest) -> Translation:
    """Write the program of a lifted cylinder and what it reads."""
    lift, scene, world = test.lift, test.lift.scene, world_of(test.lift)
    # its contact radius is that of the circle of overlap, sqrt(2) times Hertz's where spheres are equal
    stiffening = math.sqrt(2.0) if lift.case.laws.normal == "hertz" else 1.0
    unused = {"CoR": 0.5, "mu": 0.0, "Crr": 0.0}
    numbers = {
        "materials": [each | {"E": each["E"] / stiffening} | unused for each in test.material_values],
        "contacts": test.contact_values,
        "release": scene.release(float(world.bounding_radii.max())),
        "domain": world.domain,
        "top_speed": scene.top_speed,
        "plate": scene.plate_diameter is not None,
    }
    tube = thick_tube(scene.diameter / 2, scene.height, THICKNESS * lift.largest_radius)
    walls = {"tube.obj": obj_text(tube)}
    if scene.plate_diameter is not None:
        walls["plate.obj"] = obj_text(disc(scene.plate_diameter / 2))
    return program_translation(test, world, "deme", ("python3", SCRIPT), numbers, walls)


def thick_tube(radius: float, height: float, thickness: float, sides: int = SIDES) -> np.ndarray:
    """Return the triangles of a tube with a wall around a cylinder, facing grains [m], (8 sides, 3, 3)."""
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


DEME = code_exporter("deme", translate)
