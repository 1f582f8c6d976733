"""Lines fitted to the flanks of an outline, with their ends and errors."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import optimize

from imaging.flank.fit_settings import FitSettings
from imaging.flank.outline import Outline
from imaging.flank.roughness import slope_error
from imaging.geometry import FloatArray
from imaging.picture_error import PictureError

MINIMUM_FLANK_COLUMNS = 3
"""Fewest columns that a line is fitted to."""
APEX_ZONE = 0.6
"""The apex is where the outline has at least this share of its greatest height."""
TOE_ROUNDS = 10
"""Largest number of iterations of the line, its roughness and the flank's base."""


@dataclass(frozen=True)
class FlankLine:
    """Line fitted to one flank: height = `intercept` + `slope` * position, in pixels of the outline."""

    angle: float
    se: float
    """Angle atan |slope| and its standard error [degrees]."""
    slope: float
    intercept: float
    start: float
    stop: float
    """Positions between which the line was fitted [pixels]."""
    dof: float
    """Degrees of freedom of `se` (see `slope_error`), far fewer than columns: the outline is correlated over
    about a grain."""
    rms: float
    """Root mean square of the outline about the line [pixels]."""

    def covered(self, outline: Outline) -> tuple[FloatArray, FloatArray]:
        """Return the positions and heights that the line was fitted to."""
        inside = (outline.position >= self.start) & (outline.position <= self.stop)
        return outline.position[inside], outline.height[inside]

    def from_position(self, start: float) -> FlankLine:
        """Return the same line with positions relative to `start`."""
        return replace(
            self,
            intercept=self.intercept + self.slope * start,
            start=self.start - start,
            stop=self.stop - start,
        )


def fit_flanks(outline: Outline, settings: FitSettings, place: str) -> tuple[FlankLine, FlankLine]:
    """Fit a line to the left and to the right flank of an outline; `place` names it in errors."""
    x, h = outline.position, outline.height
    if len(x) < 2 * MINIMUM_FLANK_COLUMNS:
        raise PictureError(place, f"needs at least {2 * MINIMUM_FLANK_COLUMNS} columns", len(x))
    apex = apex_column(x, h)
    left = _fit_flank(x[:apex], h[:apex], settings, f"{place}, left flank")
    right = _fit_flank(-x[apex:][::-1], h[apex:][::-1], settings, f"{place}, right flank")
    return left, replace(right, slope=-right.slope, start=-right.stop, stop=-right.start)


def apex_column(x: FloatArray, h: FloatArray) -> int:
    """Return the first column of the right flank: where two lines that meet have the least squared error.

    The lines must meet: a split that suits each flank alone would follow the roughness and flatten both. The
    fits for all columns near the top are computed at once, from running sums.
    """
    high = np.flatnonzero(h >= APEX_ZONE * h.max())
    first = max(int(high[0]), MINIMUM_FLANK_COLUMNS)
    last = min(int(high[-1]), len(x) - MINIMUM_FLANK_COLUMNS)
    splits = np.arange(first, max(last, first) + 1)
    x = x - x.mean()
    corner = x[splits]
    count, sx, sxx, sh, sxh = (np.cumsum(term) for term in (np.ones_like(x), x, x * x, h, x * h))
    left = [total[splits] for total in (count, sx, sxx, sh, sxh)]
    right = [total[-1] - part for total, part in zip((count, sx, sxx, sh, sxh), left, strict=True)]
    sums = [
        (s - corner * n, ss - 2.0 * corner * s + corner**2 * n, p - corner * q)
        for n, s, ss, q, p in (left, right)
    ]
    (left_1, left_2, left_h), (right_1, right_2, right_h) = sums
    nothing = np.zeros_like(corner)
    gram = np.array(
        [
            [np.full_like(corner, len(x)), left_1, right_1],
            [left_1, left_2, nothing],
            [right_1, nothing, right_2],
        ]
    ).transpose(2, 0, 1)
    moments = np.stack([np.full_like(corner, h.sum()), left_h, right_h], axis=-1)
    roof = np.linalg.solve(gram, moments[:, :, None])[:, :, 0]
    explained = np.einsum("ij,ij->i", roof, moments)
    return int(splits[np.argmax(explained)])


def _fit_flank(x: FloatArray, h: FloatArray, settings: FitSettings, place: str) -> FlankLine:
    """Fit the line of a flank that rises to the right."""
    base = _base_column(x, h, settings.toe)
    chosen = _fit_region(h[base:], settings)
    x, h = x[base:][chosen], h[base:][chosen]
    if len(x) < MINIMUM_FLANK_COLUMNS:
        problem = f"the fit {settings.name!r} needs at least {MINIMUM_FLANK_COLUMNS} columns"
        raise PictureError(place, problem, len(x))
    slope, intercept, residual = _line(x, h)
    if slope <= 0.0:
        raise PictureError(place, "the flank must rise towards the apex", f"slope {slope:.3g}")
    step = float(np.median(np.diff(x)))
    error = slope_error(x, residual)
    return FlankLine(
        angle=float(np.degrees(np.arctan(slope))),
        se=float(np.degrees(np.sqrt(error.variance)) / (1.0 + slope**2)),
        slope=slope,
        intercept=intercept,
        start=float(x[0] - 0.5 * step),
        stop=float(x[-1] + 0.5 * step),
        dof=error.dof,
        rms=float(np.sqrt(residual @ residual / len(x))),
    )


def _line(x: FloatArray, h: FloatArray) -> tuple[float, float, FloatArray]:
    """Slope, intercept and residuals of the least-squares line."""
    away = x - x.mean()
    slope = float(away @ h) / float(away @ away)
    intercept = float(h.mean()) - slope * float(x.mean())
    return slope, intercept, h - intercept - slope * x


def _base_column(x: FloatArray, h: FloatArray, toe: float) -> int:
    """First column of a rising flank: where its line is `toe` times as high as the outline is rough."""
    base = 0
    for _ in range(TOE_ROUNDS):
        slope, intercept, residual = _line(x[base:], h[base:])
        low = intercept + slope * x < toe * float(np.sqrt(residual @ residual / len(residual)))
        before, base = (
            base,
            min(int(np.count_nonzero(low)) if slope > 0.0 else base, len(x) - MINIMUM_FLANK_COLUMNS),
        )
        if base == before:
            break
    return base


def _fit_region(h: FloatArray, settings: FitSettings) -> NDArray[np.bool_]:
    """Select the columns of a rising flank between the fit's two heights.

    The heights are those of the nearest non-decreasing curve (isotonic regression): a choice by the rough
    outline itself would be a choice by its error, and flatten the line.
    """
    smooth = optimize.isotonic_regression(h).x
    return (smooth >= settings.lower * smooth[-1]) & (smooth <= settings.upper * smooth[-1])
