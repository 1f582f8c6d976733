"""Walls of a case as triangles, for programs that read meshes."""

from __future__ import annotations

import numpy as np

from dem_warp.walls import Mesh, Plane, Wall

SEGMENTS = 180
"""Sides of a round wall; they are at most 0.02 % of the radius inside the circle."""


def triangles_of(wall: Wall, half_width: float) -> np.ndarray:
    """Return the triangles of a wall [m], (n, 3, 3); an endless plane is a square of this half width [m]."""
    if isinstance(wall, Mesh):
        return wall.vertices[wall.faces]
    origin, axis = np.array(wall.point), np.array(wall.axis)
    x, y = _across(axis)
    if isinstance(wall, Plane):
        signs = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
        corners = origin + half_width * (signs[:, :1] * x + signs[:, 1:] * y)
        return corners[[[0, 1, 2], [0, 2, 3]]]
    turns = np.linspace(0.0, 2.0 * np.pi, SEGMENTS, endpoint=False)[:, None]
    circle = np.cos(turns) * x + np.sin(turns) * y
    low, high = origin + wall.radius * circle, origin + wall.length * axis + wall.upper_radius * circle
    after_low, after_high = np.roll(low, -1, axis=0), np.roll(high, -1, axis=0)
    halves = [(low, after_low, high)] * (wall.radius > 0.0)
    halves += [(after_low, after_high, high)] * (wall.upper_radius > 0.0)
    return np.concatenate([np.stack(corners, axis=1) for corners in halves])


def _across(axis: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return two unit vectors, perpendicular to an axis and to each other."""
    helper = np.eye(3)[np.argmin(np.abs(axis))]
    x = np.cross(helper, axis)
    x /= np.linalg.norm(x)
    return x, np.cross(axis, x)
