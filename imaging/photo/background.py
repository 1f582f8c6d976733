"""Difference of every pixel from its background: evens out light, colour and polarity."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from imaging.errors import PictureError
from imaging.geometry import FloatArray, Layer, Picture

BLUR = 0.5
"""Standard deviation [pixels] of the smoothing, horizontal so that it does not lower a flat outline."""
BORDER_SHARE = 0.08
"""Part of the width and height, at the top and the upper sides, that starts the background fit."""
FIT_SAMPLES = 20_000
"""Pixels that the background surface is fitted to."""
FIT_ROUNDS = 4
"""Rounds of the fit, of a plane and then of the quadratic; each takes the pixels that the last explained."""
ROBUST_ROUNDS = 15
"""Rounds of reweighting of the first plane, on the border alone."""
SEPARATION = 5.0
"""A heap differs from the background by this many times the background's noise, on average, at the least."""
LIGHT_RANGE = 2.0
"""Light that is brighter or dimmer than its median by more than this factor is not evened out further."""
DEEPEST_SHADOW = 0.4
"""Share of the light that a cast shadow keeps at the least: light comes from more than one lamp."""
LEAST_NOISE = 1.0
"""Noise [of 255] below which a background counts as even: that of rounding and compression."""
UNEVEN = 5.0
"""Noise [of 255] from which on a heap must differ from its background by more than two greys do."""


@dataclass(frozen=True)
class Contrast:
    """Difference of a picture from its background."""

    values: Layer
    """Distance of each pixel's colour from the background's, in the light there, shape (rows,
    columns)."""
    thresholds: tuple[float, ...]
    """Thresholds, most likely first: one or two; what is above each differs clearly from the
    noise."""
    noise: float
    """Median distance of the background's own pixels."""
    colors: Layer
    background: Layer
    """The smoothed picture and the background's surface, shape (rows, columns, channels)."""


def contrast_with_background(
    picture: Picture, place: str, precision: type[np.float32 | np.float64] = np.float64
) -> Contrast:
    """Compare each pixel's colour with the background's.

    The background is a quadratic surface in each colour channel, fitted from the border inwards to whatever
    looks like it, so that uneven light and a coloured cloth drop out, and a heap may be darker or lighter
    than what is behind it. The first threshold is Otsu's (IEEE Trans. SMC 9, 1979); where a plate stands
    out far more than the heap it may cut between those two, so the second splits what is below the first
    once more.

    Parameters
    ----------
    picture : (rows, columns) or (rows, columns, 3) uint8 array
    place : str
        Names the picture in errors.
    precision : type
        Of the background's surface.

    Raises
    ------
    PictureError
        When the array is no picture, or when nothing stands out of its background.
    """
    channels = _channels(picture, place)
    blurred = cv2.GaussianBlur(channels, (0, 0), sigmaX=BLUR, sigmaY=1e-6)
    smooth = np.asarray(blurred, dtype=np.float32).reshape(channels.shape)
    surface, noise = _background(smooth)
    background = _evaluated(surface, smooth.shape, precision)
    difference = smooth - background
    contrast = np.sqrt(np.einsum("ijk,ijk->ij", difference, difference)) / _light(background)
    thresholds = []
    values = contrast.ravel()
    for _ in range(2):
        threshold = otsu_threshold(values)
        front = values[values > threshold]
        if front.size == 0 or front.mean() < SEPARATION * max(noise, LEAST_NOISE):
            break
        thresholds.append(threshold)
        values = values[values <= threshold]
    if not thresholds:
        raise PictureError(place, "expected a heap stands out of the background", _why_none(noise))
    return Contrast(contrast, tuple(thresholds), noise, smooth, background)


def _why_none(noise: float) -> str:
    """Reason why nothing stands out: all is alike, or too uneven for anything to differ from it."""
    if noise <= UNEVEN:
        return "a picture without contrast"
    return f"a background too uneven, by {noise:.0f} of 255, for a heap to differ from it"


def unshaded(colors: Layer, own: Layer, reach: int) -> Layer:
    """Difference of colours from a surface's own ones that a shadow on it does not make.

    A shadow dims all channels alike and leaves no grains: what counts is the colour beside the line from the
    surface's own to black, down to `DEEPEST_SHADOW`, and the lightness's unevenness over `reach` pixels.
    """
    power = np.maximum(np.einsum("ijk,ijk->ij", own, own), LEAST_NOISE)
    dimming = np.clip(np.einsum("ijk,ijk->ij", colors, own) / power, DEEPEST_SHADOW, 1.0)
    beside = colors - dimming[:, :, None] * own
    return np.asarray(np.sqrt(np.einsum("ijk,ijk->ij", beside, beside) + unevenness(colors, reach) ** 2))


def unevenness(colors: Layer, reach: int) -> Layer:
    """Standard deviation of the lightness within `reach` pixels of each."""
    level = colors.mean(axis=2)
    size = (2 * reach + 1, 2 * reach + 1)
    # Of the difference from the mean of all: squares of small numbers keep their digits.
    level = level - level.mean()
    mean, square = cv2.blur(level, size), cv2.blur(level * level, size)
    return np.asarray(np.sqrt(np.maximum(square - mean * mean, 0.0)))


def otsu_threshold(values: Layer) -> float:
    """Value that splits `values` in two classes with the largest variance between them (Otsu 1979)."""
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


def _channels(picture: Picture, place: str) -> Layer:
    layered = picture[:, :, None] if picture.ndim == 2 else picture
    if layered.ndim != 3 or layered.shape[2] not in (1, 3) or picture.dtype != np.uint8:
        rule = "expected a picture is a (rows, columns) or (rows, columns, 3) array of uint8"
        raise PictureError(place, rule, f"{picture.shape} of {picture.dtype}")
    if min(layered.shape[:2]) < 16:
        raise PictureError(place, "expected a picture has at least 16 rows and columns", picture.shape)
    return layered.astype(np.float32)


def _background(channels: Layer) -> tuple[FloatArray, float]:
    """Coefficients of the quadratic surface through the background's pixels, and their median distance."""
    rows, columns, _ = channels.shape
    stride = max(1, int(np.sqrt(rows * columns / FIT_SAMPLES)))
    row, column = (axis.ravel() for axis in np.mgrid[0:rows:stride, 0:columns:stride])
    sample = channels[row, column].astype(np.float64)
    terms = _surface_terms(row, column, (rows, columns))
    side = (column < BORDER_SHARE * columns) | (column >= (1.0 - BORDER_SHARE) * columns)
    border = (row < BORDER_SHARE * rows) | ((row < 0.5 * rows) & side)
    surface = _robust_plane(terms[border, :3], sample[border])
    residual = np.linalg.norm(sample - terms[:, :3] @ surface, axis=1)
    noise = float(np.median(residual[border]))
    before: tuple[int, bytes] | None = None
    for size in (*[3] * FIT_ROUNDS, *[6] * FIT_ROUNDS):
        chosen = residual <= max(4.0 * noise, 2.0 * LEAST_NOISE)
        # A round on the pixels of the last one repeats it; behind a drawn heap all rounds but the first do.
        if (now := (size, chosen.tobytes())) == before:
            continue
        before = now
        surface = _least_squares(terms[chosen, :size], sample[chosen])
        residual = np.linalg.norm(sample - terms[:, :size] @ surface, axis=1)
        noise = float(np.median(residual[chosen]))
    return surface, noise


def _evaluated(
    surface: FloatArray, shape: tuple[int, ...], precision: type[np.float32 | np.float64]
) -> Layer:
    """A quadratic or a plane at every pixel; in single precision without its terms at every pixel."""
    rows, columns = shape[:2]
    if precision is np.float64:
        row, column = (axis.ravel() for axis in np.mgrid[0:rows, 0:columns])
        terms = _surface_terms(row, column, (rows, columns))[:, : len(surface)]
        return np.asarray((terms @ surface).reshape(shape))
    padded = np.vstack([surface, np.zeros((6 - len(surface), shape[2]))])
    constant, x, y, xx, xy, yy = padded[:, None, None, :]
    across = (2.0 * np.arange(columns) / columns - 1.0)[None, :, None]
    down = (2.0 * np.arange(rows) / rows - 1.0)[:, None, None]
    along = (constant + x * across + xx * across**2).astype(np.float32)
    mixed = (xy * down).astype(np.float32) * across.astype(np.float32)
    return np.asarray(along + mixed + (y * down + yy * down**2).astype(np.float32))


def _light(background: Layer) -> Layer:
    """Brightness of the light relative to its median: where it is dim, heap and background differ less."""
    level = np.linalg.norm(background, axis=2)
    return np.clip(level / max(float(np.median(level)), LEAST_NOISE), 1.0 / LIGHT_RANGE, LIGHT_RANGE)


def _robust_plane(terms: FloatArray, sample: FloatArray) -> FloatArray:
    """Plane with the least sum of distances, by reweighting: a heap at the border hardly moves it."""
    weight = np.ones(len(sample))
    for _ in range(ROBUST_ROUNDS):
        root = np.sqrt(weight)[:, None]
        plane = _least_squares(root * terms, root * sample)
        before = weight
        weight = 1.0 / np.maximum(np.linalg.norm(sample - terms @ plane, axis=1), LEAST_NOISE)
        if np.array_equal(weight, before):
            break
    return np.asarray(plane)


def _least_squares(terms: FloatArray, sample: FloatArray) -> FloatArray:
    """Fit by the normal equations, for many pixels and few terms from -1 to 1, far from dependent."""
    return np.asarray(np.linalg.lstsq(terms.T @ terms, terms.T @ sample, rcond=None)[0])


def _surface_terms(row: NDArray[np.intp], column: NDArray[np.intp], shape: tuple[int, int]) -> FloatArray:
    """Columns 1, x, y, x^2, x y, y^2 with x and y from -1 to 1 across the picture."""
    y, x = 2.0 * row / shape[0] - 1.0, 2.0 * column / shape[1] - 1.0
    return np.column_stack([np.ones(len(x)), x, y, x**2, x * y, y**2])
