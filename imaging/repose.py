"""Outlines to repose angles: a straight line fitted to each flank, theta = atan |slope|, with its standard error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import optimize, stats

from imaging import render
from imaging.errors import PictureError
from imaging.geometry import FloatArray, Frame, Picture, Spheres
from imaging.pictures import read_picture
from imaging.silhouette import Outline, find_outline

MINIMUM_FLANK_COLUMNS = 5
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


@dataclass(frozen=True)
class ReposeAngle:
    """Repose angle of one picture.

    Attributes
    ----------
    left_line, right_line : FlankLine
    fit : FitSettings
        What the lines were fitted to.
    outline : Outline
        What they were fitted on.
    """

    left_line: FlankLine
    right_line: FlankLine
    fit: FitSettings
    outline: Outline

    @property
    def left(self) -> float:
        """Angle of the left flank [degrees]."""
        return self.left_line.angle

    @property
    def right(self) -> float:
        """Angle of the right flank [degrees]."""
        return self.right_line.angle

    @property
    def mean(self) -> float:
        """Mean of both flanks [degrees]; a tilt of the camera that was not seen cancels here to first order."""
        return 0.5 * (self.left + self.right)

    @property
    def se(self) -> float:
        """Standard error of the mean [degrees]: how well two straight lines are known from this one outline."""
        return 0.5 * float(np.hypot(self.left_line.se, self.right_line.se))

    @property
    def dof(self) -> float:
        """Degrees of freedom of `se` (Welch and Satterthwaite)."""
        parts = [(line.se**2, line.dof) for line in (self.left_line, self.right_line)]
        total = sum(variance for variance, _ in parts)
        if total == 0.0:
            return sum(dof for _, dof in parts)
        return total**2 / sum(variance**2 / dof for variance, dof in parts)

    def interval(self, level: float = 0.95) -> tuple[float, float]:
        """Confidence interval of the mean [degrees]."""
        return _interval(self.mean, self.se, self.dof, level)


@dataclass(frozen=True)
class HeapAngle:
    """Repose angle of one simulated heap, from several azimuths.

    Attributes
    ----------
    mean, se : float
        Mean over the views and its standard error [degrees]: how well these views give the mean over all azimuths
        of this heap. Neighbouring views share grains, so their correlation round the heap, where positive, widens
        it. What another heap of the same grains would give only replicates tell.
    views : tuple of ReposeAngle
        One a measured azimuth.
    azimuths : tuple of float
        Their directions [rad].
    rejections : tuple of str
        Why other azimuths could not be measured; empty as a rule.
    fit : FitSettings
    """

    mean: float
    se: float
    views: tuple[ReposeAngle, ...]
    azimuths: tuple[float, ...]
    rejections: tuple[str, ...]
    fit: FitSettings

    @property
    def dof(self) -> float:
        """Degrees of freedom of `se`."""
        return len(self.views) - 1.0

    def interval(self, level: float = 0.95) -> tuple[float, float]:
        """Confidence interval of the mean [degrees]."""
        return _interval(self.mean, self.se, self.dof, level)


@dataclass(frozen=True)
class AngleDifference:
    """Difference of two repose angles and its standard error [degrees]."""

    value: float
    se: float


def measure(
    picture: Picture | Outline, fit: str | FitSettings = "flank", place: str = "picture"
) -> ReposeAngle:
    """Measure the repose angle of a picture, or of an outline found before.

    Each flank runs from the heap's base (see `FitSettings.toe_area`) to its apex: the column that splits the outline
    into the two straight lines of least squared error. theta = atan |k|, k the slope of the line fitted to the part
    of the flank that `fit` names (Liu et al.'s formula 1).

    Parameters
    ----------
    picture : uint8 array, `Snapshot` image or Outline
    fit : str or FitSettings
        One of `FITS` by name, or your own.
    place : str
        Names the picture in errors.

    Raises
    ------
    PictureError
        When there is no measurable heap.
    """
    settings = FitSettings.of(fit)
    outline = picture if isinstance(picture, Outline) else find_outline(picture, place=place)
    left, right = _flanks(outline, settings, place)
    return ReposeAngle(
        left_line=_fit_flank(left, settings, place, "left"),
        right_line=_fit_flank(right, settings, place, "right"),
        fit=settings,
        outline=outline,
    )


def measure_photograph(path: str | Path, fit: str | FitSettings = "flank") -> ReposeAngle:
    """Measure the repose angle of the heap in a picture file; raise `PictureError` when it shows none."""
    return measure(read_picture(path), fit, place=str(path))


def heap_angle(
    centers: ArrayLike,
    radii: ArrayLike,
    azimuths: int | Sequence[float] = 8,
    fit: str | FitSettings = "flank",
    pixels: int = 800,
    backend: str = "raster",
) -> HeapAngle:
    """Measure the repose angle of a heap of spheres on the plate z = 0.

    Parameters
    ----------
    centers : (n, 3) array
        Centres of the spheres [m], z up.
    radii : (n,) array
        Their radii [m].
    azimuths : int or sequence of float
        How many directions, spread evenly over half a turn (the other half are mirror images), or the directions [rad].
    fit : str or FitSettings
        One of `FITS` by name, or your own.
    pixels : int
        Width of the heap in the pictures.
    backend : {"raster", "pyvista", "auto"}
        What draws the silhouettes.

    Raises
    ------
    PictureError
        When the arguments are wrong, or when fewer than two azimuths show a measurable heap.
    """
    settings = FitSettings.of(fit)
    spheres = Spheres.of(centers, radii)
    frame = Frame.around(spheres, pixels)
    views, seen, rejections = [], [], []
    for azimuth in _directions(azimuths):
        snapshot = render.silhouette(spheres.centers, spheres.radii, azimuth, backend=backend, frame=frame)
        place = f"view at {np.degrees(azimuth):.1f} degrees"
        try:
            outline = find_outline(snapshot.image, snapshot.ground_row, snapshot.meters_per_pixel, place)
            views.append(measure(outline, settings, place))
            seen.append(azimuth)
        except PictureError as error:
            rejections.append(str(error))
    if len(views) < 2:
        raise PictureError("at least two views show a measurable heap", "; ".join(rejections), "heap")
    values = np.array([view.mean for view in views])
    return HeapAngle(
        float(values.mean()), _circular_se(values), tuple(views), tuple(seen), tuple(rejections), settings
    )


def compare(a: ReposeAngle | HeapAngle, b: ReposeAngle | HeapAngle) -> AngleDifference:
    """Difference a - b of two angles; refused where they were measured with different fits (3 to 5 degrees apart)."""
    if a.fit != b.fit:
        raise PictureError(
            "angles that are compared were measured with the same fit", f"{a.fit} and {b.fit}", "compare"
        )
    return AngleDifference(a.mean - b.mean, float(np.hypot(a.se, b.se)))


def _directions(azimuths: int | Sequence[float]) -> FloatArray:
    if isinstance(azimuths, int):
        if azimuths < 2:
            raise PictureError("there are at least two azimuths", azimuths, "azimuths")
        return np.arange(azimuths) * np.pi / azimuths
    directions = np.asarray(azimuths, dtype=np.float64)
    if directions.ndim != 1 or len(directions) < 2 or not np.isfinite(directions).all():
        raise PictureError("azimuths are at least two finite directions", azimuths, "azimuths")
    return directions


def _circular_se(values: FloatArray) -> float:
    """Standard error of the mean of views round a heap, widened by the correlation of neighbours.

    The estimated correlation of neighbours is 1/n too low on average, since the mean was taken from the same views.
    """
    count = len(values)
    deviation = values - values.mean()
    variance = float(deviation @ deviation) / (count - 1)
    if count < 4 or variance == 0.0:
        return float(np.sqrt(variance / count))
    neighbours = float(deviation @ np.roll(deviation, 1)) / float(deviation @ deviation) + 1.0 / count
    return float(np.sqrt(variance / count * (1.0 + 2.0 * max(neighbours, 0.0))))


def _interval(mean: float, se: float, dof: float, level: float) -> tuple[float, float]:
    if not 0.0 < level < 1.0:
        raise PictureError("0 < level < 1", level, "level")
    reach = float(stats.t.ppf(0.5 + 0.5 * level, dof)) * se
    return mean - reach, mean + reach


@dataclass(frozen=True)
class _Flank:
    """Outline of one flank from its base to the apex, in the order of the picture's columns."""

    position: FloatArray
    height: FloatArray
    rising: bool


def _flanks(outline: Outline, settings: FitSettings, place: str) -> tuple[_Flank, _Flank]:
    x, h = outline.position, outline.height
    apex = _apex(x, h)
    first, last = _base(h[:apex], settings.toe_area), len(x) - _base(h[apex:][::-1], settings.toe_area)
    if apex - first < MINIMUM_FLANK_COLUMNS or last - apex < MINIMUM_FLANK_COLUMNS:
        rule = f"either flank has at least {MINIMUM_FLANK_COLUMNS} columns"
        raise PictureError(rule, f"{apex - first} and {last - apex}", place)
    return _Flank(x[first:apex], h[first:apex], True), _Flank(x[apex:last], h[apex:last], False)


def _base(height: FloatArray, toe_area: float) -> int:
    """Columns, from the outside, that hold the share `toe_area` of a flank's area."""
    area = np.cumsum(height)
    return int(np.searchsorted(area, toe_area * area[-1])) if len(area) else 0


def _apex(x: FloatArray, h: FloatArray) -> int:
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
