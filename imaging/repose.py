"""The repose angle of one picture: atan |slope| of the line fitted to each flank, and its uncertainty."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Protocol

import numpy as np
from scipy import special

from imaging.flank.camera_height import camera_error, level_angle, level_error
from imaging.flank.fit_settings import FitSettings
from imaging.flank.flank_line import FlankLine, fit_flanks
from imaging.flank.outline import Doubt, Outline
from imaging.geometry import Picture
from imaging.photo.doubts import doubts_of
from imaging.photo.outline_finder import find_outline
from imaging.photo.picture_file import focal_length, least_focal_length, read_picture
from imaging.photo.view_settings import View
from imaging.picture_error import PictureError

LEAST_CORRECTION = 0.05
"""Correction for the camera's place [degrees] that is mentioned: a digit of the drawn angles."""


@dataclass(frozen=True)
class ReposeAngle:
    """Repose angle of one picture."""

    left_line: FlankLine
    right_line: FlankLine
    fit: FitSettings
    """Part of the flanks that the lines were fitted to."""
    outline: Outline
    """Outline that the lines were fitted to."""

    def __str__(self) -> str:
        found = f"{self.mean:.2f} +- {self.se:.2f} degrees, left {self.left:.2f}, right {self.right:.2f}"
        return "; ".join((found, *map(str, self.doubts)))

    @property
    def left(self) -> float:
        """Angle of the left flank [degrees], corrected for the camera's place."""
        return self._level(self.left_line.angle)

    @property
    def right(self) -> float:
        """Angle of the right flank [degrees], corrected for the camera's place."""
        return self._level(self.right_line.angle)

    @property
    def mean(self) -> float:
        """Mean of both flanks [degrees]; a tilt of the camera cancels here to first order."""
        return 0.5 * (self.left + self.right)

    @property
    def correction(self) -> str:
        """Correction for the camera's place in words; empty where it is less than 0.05 degrees."""
        seen = self.left_line.angle, self.right_line.angle
        if max(abs(seen[0] - self.left), abs(seen[1] - self.right)) < LEAST_CORRECTION:
            return ""
        lines = f"lines seen at {seen[0]:.1f} and {seen[1]:.1f} degrees"
        return f"{lines}, {self.left:.1f} and {self.right:.1f} corrected for the camera's place"

    @property
    def se(self) -> float:
        """Standard error of the mean [degrees], from both lines and the camera's place."""
        return float(np.hypot(self._lines_se, camera_error(self._seen, self.outline, self._lines_se)))

    @property
    def _seen(self) -> float:
        return 0.5 * (self.left_line.angle + self.right_line.angle)

    @property
    def _lines_se(self) -> float:
        roughness = 0.5 * float(np.hypot(self.left_line.se, self.right_line.se))
        return float(np.hypot(roughness, level_error(self._seen, self.outline)))

    def _level(self, seen: float) -> float:
        return level_angle(seen, self.outline.elevation, self.outline.distance, self.outline.nearest)

    @cached_property
    def doubts(self) -> tuple[Doubt, ...]:
        """Doubts about the angle; empty for a drawn silhouette."""
        if not self.outline.photographed:
            return ()
        lines = self.left_line, self.right_line
        found = doubts_of(*lines, self.mean, self._lines_se, self.outline, whole=self.se)
        known = {doubt.name for doubt in self.outline.doubts}  # a tilt without a plate has a lower limit
        return (*self.outline.doubts, *(doubt for doubt in found if doubt.name not in known))

    @property
    def dof(self) -> float:
        """Degrees of freedom of `se` (Welch and Satterthwaite)."""
        parts = [(line.se**2, line.dof) for line in (self.left_line, self.right_line)]
        total = sum(variance for variance, _ in parts)
        if total == 0.0:
            return sum(dof for _, dof in parts)
        return total**2 / sum(variance**2 / dof for variance, dof in parts)

    def in_part(self, left: int, top: int) -> ReposeAngle:
        """Return the same measurement in a part of the picture that begins at this column and row."""
        outline = self.outline.in_part(left, top)
        start = float(self.outline.position[0] - outline.position[0])
        left_line, right_line = (line.from_position(start) for line in (self.left_line, self.right_line))
        return ReposeAngle(left_line, right_line, self.fit, outline)

    def interval(self, level: float = 0.95) -> tuple[float, float]:
        """Return the confidence interval of the mean [degrees]."""
        return confidence_interval(self.mean, self.se, self.dof, level)


class Angle(Protocol):
    """Common part of all measured angles: mean and standard error [degrees], and the fit."""

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

    Each flank goes from the heap's base (see `FitSettings.toe`) to its apex, where two straight lines that
    meet have the least squared error. The angle is ``atan |k|``, where k is the slope of the least-squares
    line through the part of the flank that `fit` names.

    Parameters
    ----------
    picture : uint8 array or Outline
        Grey or blue-green-red; the plate is found in it, and a tilted camera levelled.
    fit : str or FitSettings
        One of `FITS` by name, or your own.
    place : str
        Names the picture in errors.
    view : View, optional
        Known facts of a photograph (see `find_outline`).

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
    """Measure the repose angle of the heap in a picture file; raise `PictureError` if it shows no heap.

    The camera's distance follows from the focal length in the file. Without one, a whole picture has a likely
    distance, and its standard error holds all distances from that of the widest usual lens on.
    """
    settings = FitSettings.of(fit)
    known, picture = view or View(), read_picture(path)
    if known.focal_length is None:
        least = least_focal_length(picture.shape[:2])
        known = replace(known, focal_length=focal_length(path), least_focal_length=least)
    return measure(picture, settings, place=str(path), view=known)


def compare(a: Angle, b: Angle) -> AngleDifference:
    """Return the difference a - b of two angles; raise `PictureError` if their fits differ.

    The fit alone changes an angle by 3 to 5 degrees, more than most differences of interest.
    """
    if a.fit != b.fit:
        raise PictureError("compare", "both angles must have the same fit", f"{a.fit} and {b.fit}")
    return AngleDifference(a.mean - b.mean, float(np.hypot(a.se, b.se)))


def confidence_interval(mean: float, se: float, dof: float, level: float) -> tuple[float, float]:
    """Return the interval that holds the true mean with probability `level` [degrees], by Student's t."""
    if not 0.0 < level < 1.0:
        raise PictureError("level", "must be between 0 and 1", level)
    reach = float(special.stdtrit(dof, 0.5 + 0.5 * level)) * se
    return mean - reach, mean + reach
