"""The repose angle of one picture: atan |slope| of the line fitted to each flank, and its uncertainty."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Protocol

import numpy as np
from scipy import special

from imaging.errors import PictureError
from imaging.fits import FitSettings
from imaging.flanks import FlankLine, fit_flanks
from imaging.geometry import Picture
from imaging.outline import Outline
from imaging.photo.doubts import doubts_of
from imaging.photo.finding import find_outline
from imaging.photo.view import View, level_angle, level_error
from imaging.pictures import focal_length, read_picture
from imaging.reasons import Doubt


@dataclass(frozen=True)
class ReposeAngle:
    """Repose angle of one picture."""

    left_line: FlankLine
    right_line: FlankLine
    fit: FitSettings
    """Outline that the lines were fitted to."""
    outline: Outline
    """Setting that they were fitted with."""

    @property
    def left(self) -> float:
        """Angle of the left flank [degrees], the camera's height taken out."""
        return self._level(self.left_line.angle)

    @property
    def right(self) -> float:
        """Angle of the right flank [degrees], the camera's height taken out."""
        return self._level(self.right_line.angle)

    @property
    def mean(self) -> float:
        """Mean of both flanks [degrees]; a tilt of the camera cancels here to first order."""
        return 0.5 * (self.left + self.right)

    @property
    def se(self) -> float:
        """Standard error of the mean [degrees]: of both lines on this outline, and of the camera's height."""
        roughness = 0.5 * float(np.hypot(self.left_line.se, self.right_line.se))
        outline = self.outline
        seen = 0.5 * (self.left_line.angle + self.right_line.angle)
        return float(
            np.hypot(roughness, level_error(seen, outline.elevation, outline.elevation_se, outline.distance))
        )

    def _level(self, seen: float) -> float:
        return level_angle(seen, self.outline.elevation, self.outline.distance)

    @cached_property
    def doubts(self) -> tuple[Doubt, ...]:
        """Doubts about the angle; none about that of a drawn silhouette."""
        if not self.outline.photographed:
            return ()
        judged = doubts_of(self.left_line, self.right_line, self.mean, self.se, self.outline)
        told = {doubt.name for doubt in self.outline.doubts}  # a tilt that no plate shows has the lower limit
        return (*self.outline.doubts, *(doubt for doubt in judged if doubt.name not in told))

    @property
    def dof(self) -> float:
        """Degrees of freedom of `se` (Welch and Satterthwaite)."""
        parts = [(line.se**2, line.dof) for line in (self.left_line, self.right_line)]
        total = sum(variance for variance, _ in parts)
        if total == 0.0:
            return sum(dof for _, dof in parts)
        return total**2 / sum(variance**2 / dof for variance, dof in parts)

    def in_part(self, left: int, top: int) -> ReposeAngle:
        """The same measurement in a part of the picture that begins at this column and row."""
        outline = self.outline.in_part(left, top)
        start = float(self.outline.position[0] - outline.position[0])
        left_line, right_line = (line.from_position(start) for line in (self.left_line, self.right_line))
        return ReposeAngle(left_line, right_line, self.fit, outline)

    def interval(self, level: float = 0.95) -> tuple[float, float]:
        """Confidence interval of the mean [degrees]."""
        return confidence_interval(self, level)


class Angle(Protocol):
    """Part that all measured angles share: mean and standard error [degrees], and how it was measured."""

    @property
    def mean(self) -> float: ...
    @property
    def se(self) -> float: ...
    @property
    def dof(self) -> float: ...
    @property
    def fit(self) -> FitSettings: ...


@dataclass(frozen=True)
class AngleDifference:
    """Difference of two repose angles and its standard error [degrees]."""

    value: float
    se: float


def measure(
    picture: Picture | Outline,
    fit: str | FitSettings = "flank",
    place: str = "picture",
    view: View | None = None,
) -> ReposeAngle:
    """Measure the repose angle of a picture, or of an outline found before.

    Each flank runs from the heap's base (see `FitSettings.toe`) to its apex, the column that splits the
    outline into a roof of two straight lines with the least squared error. theta = ``atan |k|``, where k is
    the slope of the least-squares line through the part of the flank that `fit` names.

    Parameters
    ----------
    picture : uint8 array or Outline
        Grey or blue-green-red; the plate is found in it, and a tilted camera levelled.
    fit : str or FitSettings
        One of `FITS` by name, or your own.
    place : str
        Names the picture in errors.
    view : View, optional
        What is known of a photograph beforehand (see `find_outline`).

    Raises
    ------
    PictureError
        When there is no measurable heap, or no such fit.
    """
    settings = FitSettings.of(fit)
    outline = picture if isinstance(picture, Outline) else find_outline(picture, place=place, view=view)
    left, right = fit_flanks(outline, settings, place)
    return ReposeAngle(left, right, settings, outline)


def measure_photograph(
    path: str | Path, fit: str | FitSettings = "flank", view: View | None = None
) -> ReposeAngle:
    """Measure the repose angle of the heap in a picture file; raise `PictureError` when it shows none.

    How near the camera was is taken from the focal length that it wrote into the file, if it did.
    """
    settings = FitSettings.of(fit)
    known = view or View()
    if known.focal_length is None:
        known = replace(known, focal_length=focal_length(path))
    return measure(read_picture(path), settings, place=str(path), view=known)


def compare(a: Angle, b: Angle) -> AngleDifference:
    """Difference a - b of two angles, refused unless both were measured with the same fit.

    The fit alone moves an angle by 3 to 5 degrees, more than most things that one would compare.
    """
    if a.fit != b.fit:
        raise PictureError(
            "compare", "expected compared angles were measured with the same fit", f"{a.fit} and {b.fit}"
        )
    return AngleDifference(a.mean - b.mean, float(np.hypot(a.se, b.se)))


def confidence_interval(angle: Angle, level: float) -> tuple[float, float]:
    """Interval that holds the true mean with probability `level` [degrees], from Student's t."""
    if not 0.0 < level < 1.0:
        raise PictureError("level", "expected 0 < level < 1", level)
    reach = float(special.stdtrit(angle.dof, 0.5 + 0.5 * level)) * angle.se
    return angle.mean - reach, angle.mean + reach
