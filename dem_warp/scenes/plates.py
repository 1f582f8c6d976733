"""Plates that heaps are on: endless or round, smooth or of glued grains, with or without a lip."""

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np

from dem_warp.walls import Cylinder, Disc, Mesh, Plane, Wall

UP = (0.0, 0.0, 1.0)

Plate = Literal["smooth", "grains"]
"""Kinds of plates."""


def check_glued(kind: str, plate: Plate, parts: Sequence[str]) -> None:
    """Raise ValueError for parts with their own material that have a plate of glued grains."""
    if "plate" in parts and plate == "grains":
        rule = "must be smooth if the plate has its own material"
        raise ValueError(f"{kind}.plate: {rule}, got {plate!r}")


def check_lip(kind: str, lip: float, most: float, plate: float | None, least: float) -> None:
    """Raise ValueError for a lip [m] without a round plate wider than `least`, or not below `most`."""
    if lip == 0.0:
        return
    if not lip < most:
        raise ValueError(f"{kind}.lip: must be below {most!r} [m], got {lip!r}")
    if plate is None or not plate > least:
        rule = f"needs a plate_diameter above {least!r} [m]"
        raise ValueError(f"{kind}.lip: {rule}, got {plate!r}")


def plate(diameter: float | None, height: float) -> Plane | Disc:
    """Return a plate at a height; without a diameter it is endless [m]."""
    if diameter is None:
        return Plane()
    return Disc((0.0, 0.0, height), UP, diameter / 2)


def rim(diameter: float | None, lip: float) -> tuple[Wall, ...]:
    """Return the lip of a plate, up to z = 0; empty without one [m]."""
    if diameter is None or lip == 0.0:
        return ()
    return (Cylinder((0.0, 0.0, -lip), diameter / 2, lip),)


def glued(diameter: float, top: float, size: float) -> Mesh:
    """Return a round layer of bumps whose tips are at a height, as of glued balls of a radius `size` [m].

    Each bump is a hexagonal pyramid inside the half ball, as high as its base is wide from the middle to a
    side; together they leave no gap.
    """
    count = math.ceil(diameter / 2 / size) + 1
    i, j = np.mgrid[-count : count + 1, -count : count + 1].reshape(2, -1)
    tips = size * np.column_stack([2.0 * i + j, math.sqrt(3.0) * j])
    tips = tips[np.hypot(*tips.T) <= diameter / 2]
    turns = np.radians(30.0 + 60.0 * np.arange(6))
    corners = tips[:, None] + 2.0 / math.sqrt(3.0) * size * np.column_stack([np.cos(turns), np.sin(turns)])
    middle = np.repeat(tips[:, None], 6, axis=1)
    flat = np.stack([middle, corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2)
    height = np.tile([top, top - size, top - size], 6 * len(tips))
    # neighbours share their corners to the digit
    vertices, faces = np.unique(np.round(np.column_stack([flat, height]), 9), axis=0, return_inverse=True)
    return Mesh(vertices, faces.reshape(-1, 3))
