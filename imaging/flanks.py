"""Lines on the flanks of an outline: where a flank begins and ends, which part is fitted, and how well it is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import optimize

from imaging.errors import PictureError
from imaging.geometry import FloatArray
from imaging.silhouette import Outline

MINIMUM_FLANK_COLUMNS = 3
"""A line is not fitted to fewer columns."""


@dataclass(frozen=True)
class FitSettings:
    """Which part of a flank the line is fitted to; angles measured with different settings are not comparable.

    Attributes
    ----------
    name : str
        Name in reports.
    lower, upper : float
        Part of the heap's height that the fit covers, 0 to 1.
    toe_area : float
        Share of the flank's silhouette area that is left out at its outer end before anything is fitted: single
        grains that rolled away lie there. On a straight flank the line is the same with and without it.
    """

    name: str
    lower: float
    upper: float
    toe_area: float = 0.01

    def __post_init__(self) -> None:
        if not 0.0 <= self.lower < self.upper <= 1.0:
            raise PictureError("0 <= lower < upper <= 1", (self.lower, self.upper), f"fit {self.name!r}")
        if not 0.0 <= self.toe_area < 0.2:
            raise PictureError("0 <= toe_area < 0.2", self.toe_area, f"fit {self.name!r}")

    @classmethod
    def of(cls, fit: str | FitSettings) -> FitSettings:
        """Look a named fit up (see `FITS`); settings pass through."""
        if isinstance(fit, FitSettings):
            return fit
        if fit not in FITS:
            raise PictureError(f"the fit is one of {', '.join(FITS)}, or FitSettings", repr(fit), "fit")
        return FITS[fit]


FITS = {
    settings.name: settings
    for settings in (
        FitSettings("flank", 0.0, 1.0),
        FitSettings("middle", 0.2, 0.8),
        FitSettings("lower", 0.0, 0.5),
        FitSettings("upper", 0.5, 1.0),
    )
}
"""Named fits: `flank` is the whole flank from base to apex, `middle` its 20 to 80 % of height."""


@dataclass(frozen=True)
class FlankLine:
    """Line fitted to one flank: height = `intercept` + `slope` * position, in pixels along and over the plate.

    Attributes
    ----------
    angle, se : float
        atan |slope| and its standard error [degrees].
    slope, intercept : float
    start, stop : float
        Positions between which the line was fitted [pixels].
    dof : float
        Independent pieces of outline less the line's two parameters: the outline of grains is correlated over about
        a grain, so this is far less than the number of columns.
    rms : float
        Root mean square of the outline about the line [pixels].
    """

    angle: float
    se: float
    slope: float
    intercept: float
    start: float
    stop: float
    dof: float
    rms: float


def fit_flanks(outline: Outline, settings: FitSettings, place: str) -> tuple[FlankLine, FlankLine]:
    """Fit a line to the left and to the right flank of an outline; `place` names it in errors."""
    left, right = _flanks(outline, settings, place)
    return _fit_flank(left, settings, place, "left"), _fit_flank(right, settings, place, "right")


@dataclass(frozen=True)
class _Flank:
    """Outline of one flank from its base to the apex, in the order of the picture's columns."""

    position: FloatArray
    height: FloatArray
    rising: bool


def _flanks(outline: Outline, settings: FitSettings, place: str) -> tuple[_Flank, _Flank]:
    x, h = outline.position, outline.height
    apex = apex_column(x, h)
    first, last = _base(h[:apex], settings.toe_area), len(x) - _base(h[apex:][::-1], settings.toe_area)
    if apex - first < MINIMUM_FLANK_COLUMNS or last - apex < MINIMUM_FLANK_COLUMNS:
        rule = f"either flank has at least {MINIMUM_FLANK_COLUMNS} columns"
        raise PictureError(rule, f"{apex - first} and {last - apex}", place)
    return _Flank(x[first:apex], h[first:apex], True), _Flank(x[apex:last], h[apex:last], False)


def _base(height: FloatArray, toe_area: float) -> int:
    """Columns, from the outside, that hold the share `toe_area` of a flank's area."""
    area = np.cumsum(height)
    return int(np.searchsorted(area, toe_area * area[-1])) if len(area) else 0


def apex_column(x: FloatArray, h: FloatArray) -> int:
    """First column of the right flank: the split into two lines with the least squared error, near the top."""
    high = np.flatnonzero(h >= 0.75 * h.max())
    splits = np.arange(max(high[0], 3), min(high[-1] + 1, len(x) - 3))
    if len(splits) == 0:
        return int(np.argmax(h))
    error = _line_error(x, h)[splits - 1] + _line_error(-x[::-1], h[::-1])[len(x) - splits - 1]
    return int(splits[np.argmin(error)])


def _line_error(x: FloatArray, h: FloatArray) -> FloatArray:
    """Squared error of the line through the first 1, 2, ..., n points."""
    x = x - x.mean()
    count = np.arange(1, len(x) + 1)
    sx, sh, sxx, sxh, shh = (np.cumsum(term) for term in (x, h, x * x, x * h, h * h))
    cross, spread = sxh - sx * sh / count, sxx - sx**2 / count
    explained = np.divide(cross**2, spread, out=np.zeros(len(x)), where=spread > 1e-9)
    return shh - sh**2 / count - explained


def _fit_flank(flank: _Flank, settings: FitSettings, place: str, side: str) -> FlankLine:
    chosen = _fit_region(flank, settings)
    x, h = flank.position[chosen], flank.height[chosen]
    if len(x) < MINIMUM_FLANK_COLUMNS:
        rule = (
            f"the fit {settings.name!r} covers at least {MINIMUM_FLANK_COLUMNS} columns of the {side} flank"
        )
        raise PictureError(rule, len(x), place)
    middle = x.mean()
    spread = float(((x - middle) ** 2).sum())
    slope = float(((x - middle) * h).sum()) / spread
    intercept = float(h.mean()) - slope * float(middle)
    if slope == 0.0 or (slope > 0.0) != flank.rising:
        raise PictureError(f"the {side} flank rises towards the apex", f"slope {slope:.3g}", place)
    residual = h - intercept - slope * x
    step = float(np.median(np.diff(x)))
    pieces = len(x) / _correlation_length(residual)
    dof = max(pieces - 2.0, 1.0)
    variance = float(residual @ residual) / dof / spread
    scale = np.degrees(1.0) / (1.0 + slope**2)
    return FlankLine(
        angle=float(np.degrees(np.arctan(abs(slope)))),
        se=float(np.sqrt(variance) * scale),
        slope=slope,
        intercept=intercept,
        start=float(x[0] - 0.5 * step),
        stop=float(x[-1] + 0.5 * step),
        dof=dof,
        rms=float(np.sqrt(residual @ residual / len(x))),
    )


def _fit_region(flank: _Flank, settings: FitSettings) -> NDArray[np.bool_]:
    """Columns of the flank between the fit's two heights.

    The heights are read from the non-decreasing curve nearest to the outline (isotonic regression): choosing columns
    by the rough outline itself would choose by the error, and flatten the line.
    """
    height = flank.height if flank.rising else flank.height[::-1]
    smooth = optimize.isotonic_regression(height).x
    chosen = (smooth >= settings.lower * smooth[-1]) & (smooth <= settings.upper * smooth[-1])
    return chosen if flank.rising else chosen[::-1]


def _correlation_length(residual: FloatArray) -> float:
    """Columns per independent piece of outline: 1 + 2 * sum of the autocorrelation up to its first zero."""
    count = len(residual)
    power = float(residual @ residual)
    if power <= 1e-18 * count:
        return 1.0
    size = 2 * count
    spectrum = np.abs(np.fft.rfft(residual, size)) ** 2
    correlation = np.fft.irfft(spectrum, size)[:count] / power
    negative = np.flatnonzero(correlation <= 0.0)
    end = negative[0] if len(negative) else count
    return float(1.0 + 2.0 * correlation[1:end].sum())
