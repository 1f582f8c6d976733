"""What is measured of a lifted-cylinder test: twelve numbers, six of which a photograph shows.

One angle is never enough: retuned friction imitates almost anything in it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from dem_warp import CaseResult
from experiments.studyfile.study import MeasurementSection
from imaging import HeapAngle, PictureError, ReposeAngle, heap_angle, heap_shape


class Instrument(StrEnum):
    """What an observable is measured with."""

    PHOTOGRAPH = "photograph"
    """One picture of the heap from the side, with a scale."""
    BALANCE = "balance"
    """A balance that the tube hangs on, or under what lies on a part of the plate."""
    RULER = "ruler"
    """A ruler along the tube."""
    FILM = "film"
    """A film of the lift through a clear tube."""
    SCAN = "scan"
    """The heap's surface from all sides."""


@dataclass(frozen=True)
class Observable:
    """One number that a test yields.

    Attributes
    ----------
    name : str
        A column of every table.
    title : str
        What it is, in a few words.
    unit : str
        ``deg``, ``m``, ``s`` or ``1``.
    definition : str
        How exactly it is measured.
    instrument : Instrument
        What it takes to measure it in the laboratory.
    """

    name: str
    title: str
    unit: str
    definition: str
    instrument: Instrument

    @property
    def by_photograph(self) -> bool:
        """Whether a photograph of the heap shows it."""
        return self.instrument is Instrument.PHOTOGRAPH


OBSERVABLES = (
    Observable(
        "flank_angle",
        "repose angle",
        "deg",
        "mean angle of the lines fitted to both flanks of the outline, as the study's measurement says",
        Instrument.PHOTOGRAPH,
    ),
    Observable(
        "concavity",
        "concavity of the flanks",
        "1",
        "1 - 2 area / (width x height) of the outline: 0 for straight flanks, positive for hollow ones",
        Instrument.PHOTOGRAPH,
    ),
    Observable("height", "height of the heap", "m", "of the outline's highest point", Instrument.PHOTOGRAPH),
    Observable(
        "r50",
        "radius of half the heap",
        "m",
        "radius about the apex that holds 50 % of the volume of the outline turned about it",
        Instrument.PHOTOGRAPH,
    ),
    Observable(
        "r90",
        "radius of nine tenths of the heap",
        "m",
        "radius about the apex that holds 90 % of the volume of the outline turned about it",
        Instrument.PHOTOGRAPH,
    ),
    Observable(
        "asymmetry",
        "lean of the heap",
        "1",
        "(area right of the apex - area left of it) / area of the outline, x of the study to the right",
        Instrument.PHOTOGRAPH,
    ),
    Observable(
        "rolled_fraction",
        "grains that rolled off",
        "1",
        "part of the grains' mass that lies farther than two tube radii from the tube's axis",
        Instrument.BALANCE,
    ),
    Observable(
        "fill_height",
        "height of the filling",
        "m",
        "mean height of the grains' surface in the tube above the plate, before the lift",
        Instrument.RULER,
    ),
    Observable(
        "wall_drag",
        "weight on the tube",
        "1",
        "part of the grains' weight that hangs on the tube while it is drawn, the mean until t75",
        Instrument.BALANCE,
    ),
    Observable(
        "t75",
        "time to three quarters",
        "s",
        "from the start of the lift until the surface of the grains within the tube's cross-section has come "
        "to 75 % of the filling's height; until the heap rests, where it stays higher",
        Instrument.FILM,
    ),
    Observable(
        "t55",
        "time to 55 %",
        "s",
        "from the start of the lift until the surface of the grains within the tube's cross-section has come "
        "to 55 % of the filling's height; until the heap rests, where it stays higher",
        Instrument.FILM,
    ),
    Observable(
        "centre_height",
        "height of the centre of mass",
        "m",
        "height of the heap's centre of mass above the plate",
        Instrument.SCAN,
    ),
)
"""Every observable, in the order of the columns of every table."""

NAMES = tuple(observable.name for observable in OBSERVABLES)
"""Names of the observables."""

PHOTOGRAPHED = tuple(observable.name for observable in OBSERVABLES if observable.by_photograph)
"""Names of those that a photograph shows."""

FALLS = ("t75", "t55")
"""Those that a surface which stays high does not have: the time until the heap rests stands for them."""

VERSION = 2
"""Of the definitions; values measured by other ones are measured again."""


def measure(settings: MeasurementSection, result: CaseResult) -> tuple[np.ndarray, str]:
    """Measure a case.

    Parameters
    ----------
    settings
        How pictures are taken and read.
    result
        How the case ended.

    Returns
    -------
    values : (observables,) array
        Of `OBSERVABLES`, in their units; NaN, all of them, for a case that has none.
    reason : str
        Why a case has none: it failed, or its heap cannot be measured; else empty.
    """
    if result.status != "finished":
        return _nothing(), result.reason
    try:
        angle = heap_angle(
            result.sphere_centers,
            result.sphere_radii,
            azimuths=settings.azimuths,
            fit=settings.fit,
            pixels=settings.pixels,
        )
    except PictureError as error:
        return _nothing(), f"no heap: {error}"
    values = photographed(angle.views) | {"asymmetry": _lean(angle)}
    seen = dict.fromkeys(FALLS, result.observables["time_to_rest"]) | result.observables
    values |= {name: seen[name] for name in NAMES if name not in PHOTOGRAPHED}
    return np.array([values[name] for name in NAMES]), ""


def photographed(views: Sequence[ReposeAngle]) -> dict[str, float]:
    """Observables that pictures of one heap show, the mean of its views each; lengths want a known scale."""
    shapes = [heap_shape(view.outline) for view in views]
    columns = {"flank_angle": [view.mean for view in views]}
    for name in PHOTOGRAPHED[1:]:
        columns[name] = [getattr(shape, name) for shape in shapes]
    return {name: float(np.mean(column)) for name, column in columns.items()}


def _lean(angle: HeapAngle) -> float:
    """Lean towards +x as the views show it, each the more the nearer it looks along y.

    A heap that leans by A towards a direction leans in a view by A times the cosine of the angle between the
    two; the amplitude along x is fitted to all views by least squares.
    """
    leans = np.array([heap_shape(view.outline).asymmetry for view in angle.views])
    terms = np.column_stack([np.cos(angle.azimuths), np.sin(angle.azimuths)])
    return float(np.linalg.lstsq(terms, leans, rcond=None)[0][0])


def _nothing() -> np.ndarray:
    return np.full(len(OBSERVABLES), np.nan)
