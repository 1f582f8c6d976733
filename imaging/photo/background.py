"""Difference of every pixel from its background, whatever the light and the colours."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from imaging.geometry import FloatArray, Layer, Picture
from imaging.picture_error import PictureError

BLUR = 0.5
"""Standard deviation of the smoothing [pixels], along rows so that it does not lower a flat outline."""
BORDER_SHARE = 0.08
"""Part of the width and height, at the top and the upper sides, where the background fit starts."""
FIT_SAMPLES = 20_000
"""Pixels that the background surface is fitted to."""
FIT_ROUNDS = 4
"""Rounds of the fit of a plane, then of a quadratic; each uses the pixels that the last one explained."""
ROBUST_ROUNDS = 15
"""Rounds of reweighting of the first plane, on the border alone."""
SEPARATION = 5.0
"""Least mean difference of a heap from the background, in multiples of the background's noise."""
LIGHT_RANGE = 2.0
"""Largest factor between the light and its median that is evened out."""
DEEPEST_SHADOW = 0.4
"""Least share of the light in a cast shadow, with more than one lamp."""
LEAST_NOISE = 1.0
"""Noise of an even background [of 255], from rounding and compression."""
UNEVEN = 5.0
"""Noise [of 255] above which a background is too uneven for small differences."""


@dataclass(frozen=True)
class Contrast:
    """Difference of a picture from its background."""

    values: Layer
    """Distance of each pixel's colour from the background's in that light, shape (rows, columns)."""
    thresholds: tuple[float, ...]
    """One or two thresholds clearly above the noise, the most likely one first."""
    noise: float
    """Median distance of the background's own pixels."""
    colors: Layer
    background: Layer
    """Smoothed picture and background surface, shape (rows, columns, channels)."""


def contrast_with_background(
    picture: Picture, place: str, precision: type[np.float32 | np.float64] = np.float64
) -> Contrast:
    """Compare each pixel's colour with the background's.

    The background is a quadratic surface in each colour channel, fitted from the border inwards. So uneven
    light and a coloured cloth do not matter, and a heap may be darker or lighter than the background. The
    first threshold is Otsu's (IEEE Trans. SMC 9, 1979). It may separate a plate of high contrast from the
    heap, so the second one splits what is below the first. The surface has the given precision.
    """
    channels = _channels(picture, place)
    blurred = cv2.GaussianBlur(channels, (0, 0), sigmaX=BLUR, sigmaY=1e-6)
    smooth = np.asarray(blurred, dtype=np.float32).reshape(channels.shape)
    surface, noise = _background(smooth)
    background = _evaluated(surface, smooth.shape, precision)
    difference = smooth - background
    contrast = np.sqrt(inner(difference, difference)) / _light(background)
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
        if noise <= UNEVEN:
            raise PictureError(place, "no heap differs from the background: the picture has no contrast")
        finding = f"too uneven, by {noise:.0f} of 255"
        raise PictureError(place, f"no heap differs from the background, which is {finding}")
    return Contrast(contrast, tuple(thresholds), noise, smooth, background)


def unshaded(colors: Layer, own: Layer, reach: int) -> Layer:
    """Return the difference of colours from a surface's own ones that no shadow on it can make.

    A shadow dims all channels by one factor and shows no grains. So the difference is the distance from the
    line between the surface's colour and black, down to `DEEPEST_SHADOW`, and the unevenness over `reach`
    pixels.
    """
    power = np.maximum(inner(own, own), LEAST_NOISE)
    dimming = np.clip(inner(colors, own) / power, DEEPEST_SHADOW, 1.0)
    away = colors - dimming[:, :, None] * own
    return np.asarray(np.sqrt(inner(away, away) + unevenness(colors, reach) ** 2))


def inner(a: Layer, b: Layer) -> Layer:
    """Return the sum over the channels of the product of two layers of colours, shape (rows, columns)."""
    if a.dtype == b.dtype == np.float32:  # the same bits in a seventh of the time
        return np.asarray(cv2.transform(a * b, np.ones((1, a.shape[2]), np.float32)))
    return np.asarray(np.einsum("ijk,ijk->ij", a, b))


def unevenness(colors: Layer, reach: int) -> Layer:
    """Return the standard deviation of the lightness within `reach` pixels of each pixel."""
    level = sum(np.moveaxis(colors, 2, 0)) / colors.shape[2]  # a tenth of the time of mean(axis=2)
    size = (2 * reach + 1, 2 * reach + 1)
    # Subtract the mean first, so that squares of small differences keep their digits.
    level = level - level.mean()
    mean, square = cv2.blur(level, size), cv2.blur(level * level, size)
    return np.asarray(np.sqrt(np.maximum(square - mean * mean, 0.0)))


def otsu_threshold(values: Layer) -> float:
    """Return the value that splits `values` in two classes with the largest variance between them (Otsu)."""
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
        problem = "must be a (rows, columns) or (rows, columns, 3) array of uint8"
        raise PictureError(place, problem, f"{picture.shape} of {picture.dtype}")
    if min(layered.shape[:2]) < 16:
        raise PictureError(place, "must have at least 16 rows and columns", picture.shape)
    return layered.astype(np.float32)


def _background(channels: Layer) -> tuple[FloatArray, float]:
    """Fit the quadratic surface to the background's pixels; return it with their median distance."""
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
        # A round on the same pixels repeats the last one; in drawn pictures all rounds do.
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
    """Evaluate a quadratic or a plane at every pixel; single precision saves the terms at every pixel."""
    rows, columns = shape[:2]
    if precision is np.float64:
        terms = _surface_terms(np.arange(rows)[:, None], np.arange(columns), (rows, columns))
        return np.asarray((terms.reshape(-1, 6)[:, : len(surface)] @ surface).reshape(shape))
    padded = np.vstack([surface, np.zeros((6 - len(surface), shape[2]))])
    constant, x, y, xx, xy, yy = padded[:, None, None, :]
    across = (2.0 * np.arange(columns) / columns - 1.0)[None, :, None]
    down = (2.0 * np.arange(rows) / rows - 1.0)[:, None, None]
    along = (constant + x * across + xx * across**2).astype(np.float32)
    mixed = (xy * down).astype(np.float32) * across.astype(np.float32)
    return np.asarray(along + mixed + (y * down + yy * down**2).astype(np.float32))


def _light(background: Layer) -> Layer:
    """Brightness of the light over its median: in dim light, heap and background differ less."""
    level = np.linalg.norm(background, axis=2)
    return np.clip(level / max(float(np.median(level)), LEAST_NOISE), 1.0 / LIGHT_RANGE, LIGHT_RANGE)


def _robust_plane(terms: FloatArray, sample: FloatArray) -> FloatArray:
    """Fit a plane by least absolute deviations: a heap at the border hardly changes it."""
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
    """Solve the normal equations, for many pixels and a few well-conditioned terms."""
    return np.asarray(np.linalg.lstsq(terms.T @ terms, terms.T @ sample, rcond=None)[0])


def _surface_terms(row: NDArray[np.intp], column: NDArray[np.intp], shape: tuple[int, int]) -> FloatArray:
    """Columns 1, x, y, x^2, x y, y^2 with x and y from -1 to 1 across the picture."""
    y, x = 2.0 * row / shape[0] - 1.0, 2.0 * column / shape[1] - 1.0
    return np.stack(np.broadcast_arrays(1.0, x, y, x**2, x * y, y**2), axis=-1)
