"""Pictures of a world cut by the plane y = 0: what lies behind it, and the lines that walls leave in it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from dem_warp.walls import Mesh, Plane, Wall
from imaging.drawing.raster import shaded
from imaging.geometry import Frame, Picture, Spheres

DARK, LIGHT = np.array([(48.0, 84.0, 132.0), (150.0, 200.0, 230.0)])
"""Colours of grains, blue-green-red: of every other layer, or of the slowest and of the fastest."""
LAYERS = 4
WALL_COLOR, WALL_PIXELS, SUBPIXEL_BITS = (70, 62, 56), 3, 4
PIXELS = 440
"""Width of a picture."""
CIRCLE_POINTS = 181
FAR = 10.0
"""Half the length that an infinite plane is drawn with [m]."""


@dataclass(frozen=True)
class View:
    """Part of the world in a picture: to either side of the z axis, and from a height to another [m]."""

    half_width: float
    bottom: float
    top: float

    @property
    def frame(self) -> Frame:
        """Of the picture, counted from its bottom."""
        scale = 2.0 * self.half_width / PIXELS
        return Frame((0.0, 0.0), self.half_width, self.top - self.bottom, 0.0, scale)


def layers(heights: np.ndarray, floor: float, brim: float) -> np.ndarray:
    """Colours of grains by their heights in a bed, (n, 3)."""
    layer = np.floor(LAYERS * (heights - floor) / (brim - floor))
    return np.where((layer % 2 == 0)[:, None], DARK, LIGHT)


def speeds(velocities: np.ndarray) -> np.ndarray:
    """Colours of grains by their speed, (n, 3)."""
    speed = np.linalg.norm(velocities, axis=1)
    part = np.clip(speed / np.quantile(speed, 0.95), 0.0, 1.0)[:, None]
    return DARK + part * (LIGHT - DARK)


def draw_cut(
    centers: np.ndarray, radii: np.ndarray, colors: np.ndarray, lines: Sequence[np.ndarray], view: View
) -> Picture:
    """Draw spheres [m] in their blue-green-red, and in front of them lines, x and z of walls [m], (k, 2)."""
    frame, foot = view.frame, np.array([0.0, 0.0, view.bottom])
    shown, kept = frame.select(Spheres.of(centers - foot, radii))
    layer = shaded(shown, colors[kept], frame, 0.0)
    opacity = layer[:, :, 3:] / 255.0
    picture = np.rint(opacity * layer[:, :, :3] + (1.0 - opacity) * 255.0).astype(np.uint8)
    for line in lines:
        across = 0.5 * frame.shape[1] + line[:, 0] / frame.meters_per_pixel
        down = frame.ground_rows - (line[:, 1] - view.bottom) / frame.meters_per_pixel
        points = np.rint(np.column_stack([across, down]) * 2**SUBPIXEL_BITS).astype(np.int32)
        cv2.polylines(picture, [points], False, WALL_COLOR, WALL_PIXELS, cv2.LINE_AA, SUBPIXEL_BITS)
    return picture


def wall_section(wall: Wall, moved: np.ndarray) -> list[np.ndarray]:
    """Lines, (k, 2) arrays of x and z [m], in which a wall meets the plane y = 0.

    The wall is a level plane, a mesh, or one about an axis along y or z, and has `moved` [m] since described.
    """
    x, _, z = np.array(wall.point) + moved
    if isinstance(wall, Plane):
        return [np.array([[-FAR, z], [FAR, z]])]
    if isinstance(wall, Mesh):
        return _cut_triangles(wall.vertices[wall.faces] + moved)
    if abs(wall.axis[1]) > abs(wall.axis[2]):
        turn = np.linspace(0.0, 2.0 * math.pi, CIRCLE_POINTS)
        around = np.column_stack([np.cos(turn), np.sin(turn)])
        return [np.array([x, z]) + wall.radius * around] if wall.length else []
    ends = np.array([[wall.radius, z], [wall.upper_radius, z + wall.length]])
    return [ends * np.array([side, 1.0]) + np.array([x, 0.0]) for side in (-1.0, 1.0)]


def _cut_triangles(triangles: np.ndarray) -> list[np.ndarray]:
    """Lines in which triangles, (m, 3, 3), pass through y = 0."""
    lines = []
    for corners in triangles:
        crossings = [
            (a + (b - a) * a[1] / (a[1] - b[1]))[[0, 2]]
            for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)
            if a[1] * b[1] < 0.0
        ]
        if len(crossings) == 2:
            lines.append(np.array(crossings))
    return lines
