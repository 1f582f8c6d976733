"""Drawn pictures of rotating drums whose surface is a known line or curve."""

from functools import cache

import cv2
import numpy as np

from imaging.geometry import Picture

FINE = 3
"""Shapes are drawn this many times finer than the picture, then averaged."""


@cache
def draw_drum(
    angle: float = 32.0,
    level: float = -0.15,
    curve: float = 0.0,
    radius: float = 150.0,
    bed: tuple[int, int, int] = (60, 70, 80),
    free: tuple[int, int, int] = (225, 220, 215),
    around: tuple[int, int, int] = (120, 60, 40),
    rim: tuple[int, int, int] | None = (30, 160, 60),
    soft: float = 0.0,
    speckle: float = 0.0,
    mirrored: bool = False,
) -> Picture:
    """Draw a drum whose surface, turned level, is at `level + curve * (x**3 - x)` radii; high on the left."""
    size = round(2.6 * radius)
    rows, columns = (np.mgrid[0 : FINE * size, 0 : FINE * size] + 0.5) / FINE - 0.5
    x, z = (columns - 1.3 * radius) / radius, (1.25 * radius - rows) / radius
    x = -x if mirrored else x
    turn = np.radians(angle)
    along, up = x * np.cos(turn) - z * np.sin(turn), x * np.sin(turn) + z * np.cos(turn)
    below = level + curve * (along**3 - along) - up
    share = np.clip(0.5 + below / max(soft, 1e-6), 0.0, 1.0)[..., None]
    noise = np.random.default_rng(0).normal(1.0, speckle, (size, size, 1))
    image = free + share * (np.array(bed) * np.kron(noise, np.ones((FINE, FINE, 1))) - free)
    ring = np.array(around if rim is None else rim)
    away = np.hypot(x, z)[..., None]
    image = np.where(away < 1.0, image, np.where(away < 1.05, ring, np.array(around)))
    small = cv2.resize(image, (size, size), interpolation=cv2.INTER_AREA)
    return np.rint(np.clip(small, 0.0, 255.0)).astype(np.uint8)


def segment(level: float) -> float:
    """Part of a circle below a line at a height over the radius from its middle."""
    return float((np.arccos(-level) + level * np.sqrt(1.0 - level**2)) / np.pi)
