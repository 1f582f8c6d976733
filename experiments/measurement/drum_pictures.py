"""Pictures of rotating drums to the observables of the drum's scene."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from experiments.io.errors import InputError
from experiments.studyfile.observables import SURFACE
from imaging import DrumReading, PictureError, View, read_drum, read_picture

ANGLES = ("dynamic_angle", "upper_angle", "lower_angle", "mass_angle")
"""Slopes that a picture of a drum shows, by the names of the scene's observables."""
PICTURED = (*ANGLES, *SURFACE)
"""Observables of a drum that a picture of it shows."""
ROW_VALUES = (
    "mean", "se", "low", "high", *ANGLES[1:], "filling", "filling_se", *SURFACE, "surface_se", "unit",
    "turns", "circle",
)  # fmt: skip
"""Values of a row of a drum."""
DRUM = "drum"
"""Source of a row of a drum."""


def read_drum_file(path: Path, view: View | None = None) -> DrumReading:
    """Read the drum in a picture file; raise `imaging.PictureError` if it shows none."""
    return read_drum(read_picture(path), view, str(path))


def shows_drum(path: Path) -> bool:
    """Return True if a picture shows a drum without a doubt."""
    try:
        return not read_drum_file(path).doubts
    except PictureError:
        return False


def observed(drum: DrumReading, radius: float) -> dict[str, float]:
    """Return what a picture of a drum of this radius shows, in degrees and the unit of the radius."""
    angles = dict(zip(ANGLES, (drum.dynamic_angle, *drum.halves, drum.mass_angle), strict=True))
    heights = dict(zip(SURFACE, drum.heights, strict=True))
    shown = {name: height * radius for name, height in heights.items() if height is not None}
    return {name: value for name, value in angles.items() if value is not None} | shown


def row_values(drum: DrumReading, diameter: float | None, level: float) -> dict[str, Any]:
    """Return the values of a row: heights in metres where the diameter is known [m], else in radii."""
    radius = 1.0 if diameter is None else diameter / 2
    low, high = drum.interval(level)
    seen = observed(drum, radius)
    mean = seen.pop("dynamic_angle")
    return (
        dict.fromkeys(ROW_VALUES)
        | seen
        | {
            "mean": mean,
            "se": drum.se,
            "low": low,
            "high": high,
            "filling": drum.filling,
            "filling_se": drum.filling_se,
            "surface_se": drum.height_se * radius,
            "unit": "radius" if diameter is None else "m",
            "turns": "anticlockwise" if drum.surface.mirrored else "clockwise",
            "circle": [drum.circle.column, drum.circle.row, drum.circle.radius],
            "doubts": [str(doubt) for doubt in drum.doubts],
        }
    )


def sure_observed(path: Path, radius: float, view: View | None, place: str) -> Mapping[str, float]:
    """Return what a picture shows of a drum of this radius [m]; raise `InputError` where it is doubtful."""
    try:
        drum = read_drum_file(path, view)
    except PictureError as error:
        raise InputError(place, f"has no measurable drum: {error}") from None
    if drum.doubts:
        raise InputError(place, f"is doubtful: {'; '.join(map(str, drum.doubts))}", hint="Crop the picture.")
    return observed(drum, radius)
