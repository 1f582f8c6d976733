"""The surface of the bed in a drum: two kinds of pixels in a circle, parted column by column.

The picture is turned about the middle of the drum until the bed is about level, as the scene of the simulator
does; lengths are in radii of the drum, x to the right, z up.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from scipy.ndimage import median_filter
from scipy.optimize import brentq

from imaging.drum.circle import Circle, most_varied, sampled
from imaging.geometry import FloatArray, Layer, Picture
from imaging.photo.background import otsu_threshold, unevenness
from imaging.picture_error import PictureError

RIM, EDGE = 0.97, 0.93
"""Radius within which the bed is looked for, without the rim, its light and its screws; and place beyond
which the surface goes on level to the shell [radii]."""
LARGEST_MIXED = 0.08
"""Part of the pixels on the wrong side of the surface above which it is no bed."""
GRAIN, STROKE, WINDOW = 0.012, 0.05, 0.05
"""Blur that evens out the speckle of grains, width of letters and scratches that are passed over, and reach
about the surface in which its height is refined [radii]."""
LEAST_PARTED = 0.45
"""Least part of the variance between the two kinds of pixels: an even shading has 0.75, noise 0.64."""
TURNS = range(3)
"""Rounds in which the bed is turned level."""


class BedSurface(NamedTuple):
    """Surface of a bed in a drum, high on the left, as if the drum was turned until the bed is level."""

    along: FloatArray
    """Places along the level surface [radii], shape (n,)."""
    height: FloatArray
    """Height there above the axis [radii]; NaN where the picture does not show it, shape (n,)."""
    turn: float
    """Angle by which the bed was turned [rad]."""
    mixed: float
    """Part of the pixels on the wrong side of the surface."""
    mirrored: bool = False
    """True if the bed is high on the right of the picture."""

    @property
    def known(self) -> bool:
        """True if the picture shows all of the surface."""
        return bool(np.isfinite(self.height).all())

    @property
    def free(self) -> np.ndarray:
        """True where the surface is known, and not hidden by the rim, shape (n,)."""
        return np.hypot(self.along, np.nan_to_num(self.height, nan=1.0)) < RIM - 0.01

    @property
    def filling(self) -> float:
        """Part of the drum's section below the surface; NaN where a part of the surface is unknown."""
        step = self.along[1] - self.along[0]
        return float((self.height + np.sqrt(1.0 - self.along**2)).sum() * step / np.pi)

    def points(self) -> FloatArray:
        """Return the points x, z of the surface as the drum stands, high on the left, shape (n, 2)."""
        cosine, sine = np.cos(self.turn), np.sin(self.turn)
        return np.column_stack(
            [self.along * cosine + self.height * sine, self.height * cosine - self.along * sine]
        )


def half_chord(filling: float) -> float:
    """Return half the width of a level bed that fills a part of a drum [radii]."""
    part = min(max(filling, 1e-6), 1.0 - 1e-6)
    return float(
        np.sin(0.5 * brentq(lambda angle: angle - np.sin(angle) - 2.0 * np.pi * part, 0, 2.0 * np.pi))
    )


def find_surface(picture: Picture, circle: Circle, place: str) -> BedSurface:
    """Find the surface of the bed in the circle; raise `PictureError` if there is no bed."""
    rows, columns = np.mgrid[0 : picture.shape[0], 0 : picture.shape[1]]
    x, z = (columns - circle.column) / circle.radius, (circle.row - rows) / circle.radius
    inside = np.hypot(x, z) < RIM
    terms = np.column_stack([np.ones(inside.sum()), x[inside], z[inside]])
    bed = np.zeros(inside.shape, dtype=np.float32)
    bed[inside] = _bedness(picture, circle, inside, terms, place)
    slope = np.linalg.lstsq(terms, bed[inside] > 0.5, rcond=None)[0]
    mirrored = bool(slope[1] > 0.0)
    turn = float(np.arctan2(abs(slope[1]), -slope[2]))
    surface = _levelled(bed, circle, turn, mirrored)
    for _ in TURNS:
        if not surface.known:
            break
        wall = np.sqrt(1.0 - surface.along**2)
        thick = surface.height + wall
        center = float(thick @ surface.along), float((thick * (surface.height - wall) / 2.0).sum())
        turn = surface.turn + float(np.arctan2(-center[0], -center[1]))
        surface = _levelled(bed, circle, turn, mirrored)
    if surface.mixed > LARGEST_MIXED:
        problem = "no drum: no surface parts a bed from what is above it in the circle"
        raise PictureError(place, problem, f"{surface.mixed:.0%} of the pixels on the wrong side")
    return surface


def _bedness(picture: Picture, circle: Circle, inside: np.ndarray, terms: FloatArray, place: str) -> Layer:
    """Return how much each pixel inside belongs to the bed, 0 to 1: by colour, or by its grains' unevenness.

    The bed is the kind of pixels whose middle is the lower one. Each kind has its own light, a plane in
    `terms` (n, 3): 1, x, z.
    """
    blur = max(GRAIN * circle.radius, 0.6)
    colors = picture.astype(np.float32)
    grainy = np.log1p(unevenness(colors, max(round(2.0 * blur), 2)))
    smooth, even = (cv2.GaussianBlur(layer, (0, 0), blur)[inside] for layer in (colors, grainy))
    layers = [most_varied(smooth), even]
    parted = [_parted(layer) for layer in layers]
    chosen = int(parted[1] > parted[0] + 0.1)
    if parted[chosen] < LEAST_PARTED:
        raise PictureError(place, "no drum: nothing in the circle differs from the rest", f"{parted[0]:.2f}")
    layer = layers[chosen]
    high = layer > otsu_threshold(layer)
    low, top = (terms[part, 2].mean() for part in (~high, high))
    bed = high if top < low else ~high
    levels = [float(np.median(layer[part])) for part in (~bed, bed)]
    share = (layer - levels[0]) / (levels[1] - levels[0])
    cores = (share < 0.25, share > 0.75)
    free, full = (terms @ np.linalg.lstsq(terms[core], share[core], rcond=None)[0] for core in cores)
    return np.asarray(np.clip((share - free) / np.maximum(full - free, 0.5), 0.0, 1.0))


def _parted(values: Layer) -> float:
    """Return the part of the variance that is between the two classes of Otsu."""
    high = values > otsu_threshold(values)
    share = float(high.mean())
    if not 0.0 < share < 1.0:
        return 0.0
    gap = float(values[high].mean() - values[~high].mean())
    return share * (1.0 - share) * gap**2 / max(float(values.var()), 1e-12)


def _levelled(bed: Layer, circle: Circle, turn: float, mirrored: bool) -> BedSurface:
    """Part the bed, turned level, from what is above it in each column."""
    count = max(int(circle.radius), 40)
    grid = (np.arange(2 * count) - count + 0.5) / count
    along, up = np.meshgrid(grid, grid)
    x, z = along * np.cos(turn) + up * np.sin(turn), up * np.cos(turn) - along * np.sin(turn)
    across = circle.column + (-x if mirrored else x) * circle.radius
    share = sampled(bed, across, circle.row - z * circle.radius)
    inside = np.hypot(along, up) < RIM
    seen = inside & np.isfinite(share)
    votes = np.where(seen, np.nan_to_num(share) - 0.5, np.where(inside, 0.0, -0.5 * np.sign(up)))
    summed = np.vstack([np.zeros(2 * count), np.cumsum(votes, axis=0)])
    # where rows are not shown, all of them are as good: the highest one is next to what is shown
    last = 2 * count - summed[::-1].argmax(axis=0)
    last = median_filter(last, size=2 * max(round(0.5 * STROKE * count), 1) + 1, mode="nearest")
    reach = max(round(WINDOW * count), 2)
    at = np.clip(last + np.arange(-reach, reach)[:, None], 0, 2 * count - 1)
    # the rows within reach of the coarse edge make it finer than a row
    height = (last - reach + (np.take_along_axis(votes, at, axis=0) + 0.5).sum(axis=0) - count) / count
    shown = np.asarray(np.take_along_axis(seen | ~inside, at[[0, -1]], axis=0).all(axis=0))
    edge = np.clip(np.arange(2 * count), *np.flatnonzero(np.abs(grid) < EDGE)[[0, -1]])
    height, shell = height[edge], np.sqrt(1.0 - grid**2)
    height = np.where(
        np.abs(height) < np.sqrt(np.maximum(RIM**2 - grid**2, 0.0)), height, height.clip(-shell, shell)
    )
    height = np.where(np.hypot(grid, height) < RIM, height, np.copysign(shell, height))
    wrong = float(((share > 0.5) != (up < height))[seen].mean())
    return BedSurface(grid, np.where(shown[edge], height, np.nan).astype(np.float64), turn, wrong, mirrored)
