"""How much every pixel differs from the background: evens out light, colour and polarity before the threshold."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from imaging.errors import PictureError
from imaging.geometry import FloatArray

BLUR = 1.0
"""Standard deviation [pixels] of the horizontal smoothing: along a flat outline, so that it does not lower it."""
BORDER_SHARE = 0.08
"""Part of the width and height, at the top and the upper sides, that starts the background fit."""
FIT_SAMPLES = 20_000
"""Pixels that the background surface is fitted to."""
FIT_ROUNDS = 6
"""Rounds of the fit; each takes the pixels that the last one explained within 4 standard deviations."""
SEPARATION = 6.0
"""Foreground and background differ by this many standard deviations of the background, at the least."""


def contrast_with_background(picture: NDArray[np.uint8], place: str) -> tuple[FloatArray, float]:
    """Distance of each pixel's colour from the background's, and the threshold between the two.

    The background is a quadratic surface in each colour channel, fitted from the border inwards to whatever looks
    like it, so that uneven light and a coloured cloth drop out, and a heap may be darker or lighter than what is
    behind it. The threshold is Otsu's (IEEE Trans. SMC 9, 1979), on the distance.

    Parameters
    ----------
    picture : (rows, columns) or (rows, columns, 3) uint8 array
    place : str
        Names the picture in errors.

    Returns
    -------
    contrast : (rows, columns) array
    threshold : float

    Raises
    ------
    PictureError
        When the array is no picture, or when nothing stands out of its background.
    """
    channels = _channels(picture, place)
    smooth = cv2.GaussianBlur(channels, (0, 0), sigmaX=BLUR, sigmaY=1e-6).reshape(channels.shape)
    difference = smooth - _background(smooth)
    contrast = np.sqrt(np.einsum("ijk,ijk->ij", difference, difference))
    threshold = otsu_threshold(contrast)
    back, front = contrast[contrast <= threshold], contrast[contrast > threshold]
    if front.size == 0 or front.mean() - back.mean() < max(SEPARATION * float(back.std()), 4.0):
        raise PictureError("a heap stands out of the background", "a picture without contrast", place)
    return contrast, threshold


def otsu_threshold(values: FloatArray) -> float:
    """Value that best splits `values` in two classes: the largest variance between the classes (Otsu 1979)."""
    low, high = float(values.min()), float(values.max())
    counts, edges = np.histogram(values, bins=512, range=(low, max(high, low + 1e-9)))
    weight = np.cumsum(counts) / counts.sum()
    moment = np.cumsum(counts * 0.5 * (edges[1:] + edges[:-1])) / counts.sum()
    spread = weight * (1.0 - weight)
    between = np.divide(
        (moment[-1] * weight - moment) ** 2, spread, out=np.zeros_like(spread), where=spread > 1e-12
    )
    best = np.flatnonzero(between >= between.max() * (1.0 - 1e-9))
    return float(0.5 * (edges[best[0] + 1] + edges[best[-1] + 1]))


def _channels(picture: NDArray[np.uint8], place: str) -> NDArray[np.float32]:
    layered = picture[:, :, None] if picture.ndim == 2 else picture
    if layered.ndim != 3 or layered.shape[2] not in (1, 3) or picture.dtype != np.uint8:
        rule = "a picture is a (rows, columns) or (rows, columns, 3) array of uint8"
        raise PictureError(rule, f"{picture.shape} of {picture.dtype}", place)
    if min(layered.shape[:2]) < 16:
        raise PictureError("a picture has at least 16 rows and columns", picture.shape, place)
    return layered.astype(np.float32)


def _background(channels: NDArray[np.float32]) -> NDArray[np.float32]:
    """Quadratic surface (rows, columns, channels) through the pixels that belong to the background."""
    rows, columns, _ = channels.shape
    stride = max(1, int(np.sqrt(rows * columns / FIT_SAMPLES)))
    row, column = (axis.ravel() for axis in np.mgrid[0:rows:stride, 0:columns:stride])
    sample = channels[row, column].astype(np.float64)
    terms = _surface_terms(row, column, (rows, columns))
    upper = row < 0.5 * rows
    side = (column < BORDER_SHARE * columns) | (column >= (1.0 - BORDER_SHARE) * columns)
    chosen = (row < BORDER_SHARE * rows) | (upper & side)
    size = 3
    for _ in range(FIT_ROUNDS):
        surface = np.linalg.lstsq(terms[chosen, :size], sample[chosen], rcond=None)[0]
        residual = np.linalg.norm(sample - terms[:, :size] @ surface, axis=1)
        chosen = residual <= max(4.0 * float(np.median(residual[chosen])), 1.0)
        size = terms.shape[1]
    grid = np.mgrid[0:rows, 0:columns]
    fitted = _surface_terms(grid[0].ravel(), grid[1].ravel(), (rows, columns)) @ surface
    return fitted.reshape(channels.shape).astype(np.float32)


def _surface_terms(row: NDArray[np.intp], column: NDArray[np.intp], shape: tuple[int, int]) -> FloatArray:
    """Columns 1, x, y, x^2, x y, y^2 with x and y from -1 to 1 across the picture."""
    y, x = 2.0 * row / shape[0] - 1.0, 2.0 * column / shape[1] - 1.0
    return np.column_stack([np.ones(len(x)), x, y, x**2, x * y, y**2])
