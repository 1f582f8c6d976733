"""The registry of observables: numbers that a test yields, and how a picture or a simulated state gives them.

One angle is never enough: retuned friction imitates almost anything in it. To add an observable of the lifted
cylinder, add its entry to `OBSERVABLES`; another number that a scene declares needs no entry.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np

from dem_warp import LiftedCylinder
from dem_warp.scenes.drum_surface import STATIONS
from dem_warp.scenes.scene import Observable as Declared

if TYPE_CHECKING:
    from imaging import HeapAngle, HeapShape, ReposeAngle

SURFACE_PROFILE, OUTLINE_PROFILE = "surface", "outline"
"""Observables that are functions: the surface of the bed in a drum, the outline of a heap."""

ANGLE = "angle"
"""Spelling of the repose angle in study files and tables of cases."""

DIMENSIONS = {
    "1": "", "deg": "angle", "m": "length", "s": "time",
    "kg": "mass", "kg/s": "mass flow", "kg/m^3": "density",
}  # fmt: skip
"""Dimension of each unit that an observable may have, as quantities know it."""


class Instrument(StrEnum):
    """Instrument that an observable is measured with."""

    PHOTOGRAPH = "photograph"
    """One picture of the heap from the side, with a scale."""
    BALANCE = "balance"
    """A balance that the tube hangs on, or under a part of the plate."""
    RULER = "ruler"
    """A ruler along the tube."""
    FILM = "film"
    """A film of the lift through a clear tube."""
    SCAN = "scan"
    """The heap's surface from all sides."""


@dataclass(frozen=True)
class View:
    """One picture of a heap, measured."""

    angle: ReposeAngle
    shape: HeapShape

    @classmethod
    def of(cls, angle: ReposeAngle) -> View:
        """Measure the shape of the outline that an angle was fitted on."""
        # a study names observables without a picture at hand
        from imaging import heap_shape

        return cls(angle, heap_shape(angle.outline))

    @cached_property
    def profile(self) -> np.ndarray:
        """Heights of the outline at its places."""
        from imaging import heap_profile

        return heap_profile(self.angle.outline)


@dataclass(frozen=True)
class Observable:
    """One number that a test yields."""

    name: str
    """A column of every table."""
    title: str
    """A few words for it."""
    unit: str
    """A key of `DIMENSIONS`."""
    definition: str
    """Exact rule of the measurement."""
    instrument: Instrument | None = None
    """Instrument that the laboratory needs; None where no file of measured heaps has it."""
    seen: Callable[[View], float] | None = None
    """Gives it from one measured picture; None where no photograph shows it."""
    directed: bool = False
    """Counts along x of the study: several views then show a part of it each."""
    stands_in: str = ""
    """Observable of the scene that replaces it where the scene does not give it."""
    limits: tuple[float, float] | None = None
    """Ends of a ratio, by its definition; those of other units follow from the size of the test."""
    never_above: str = ""
    """Observable of the same heap that is the larger of the two."""
    alias: str = ""
    """Spelling in study files and tables of cases, where it is another."""
    part_of: str = ""
    """Profile that it is a height of; empty where it is a number of its own."""

    @property
    def by_photograph(self) -> bool:
        """True where a photograph of the heap shows it."""
        return self.seen is not None

    @property
    def column(self) -> str:
        """Spelling in study files and tables of cases."""
        return self.alias or self.name

    def in_pictures(self, views: Sequence[View]) -> float:
        """Mean over pictures of one heap."""
        if self.seen is None:
            raise ValueError(f"{self.name} must be an observable that a photograph shows")
        return float(np.mean([self.seen(view) for view in views]))

    def in_heap(self, heap: HeapAngle, views: Sequence[View]) -> float:
        """Value of a simulated heap, from views all around it.

        A heap that leans by A towards a direction leans in a view by A times the cosine of the angle between
        the two; the amplitude along x is fitted to all views by least squares.
        """
        if not self.directed or self.seen is None:
            return self.in_pictures(views)
        parts = np.array([self.seen(view) for view in views])
        terms = np.column_stack([np.cos(heap.azimuths), np.sin(heap.azimuths)])
        return float(np.linalg.lstsq(terms, parts, rcond=None)[0][0])


_photographed = partial(Observable, instrument=Instrument.PHOTOGRAPH)


def _declared(name: str, title: str, instrument: Instrument, rule: str = "", **facts: object) -> Observable:
    """Build an observable that the lifted cylinder declares, with the scene's unit and definition."""
    unit, meaning = LiftedCylinder.observables[name]
    return Observable(name, title, unit, meaning + rule, instrument, **facts)  # type: ignore[arg-type]


_UNTIL_REST = "; until the heap rests, where it stays higher"

OBSERVABLES = (
    _photographed(
        "flank_angle",
        "repose angle",
        "deg",
        "mean angle of the lines fitted to both flanks of the outline, as the study's measurement says",
        seen=lambda view: view.angle.mean,
        alias=ANGLE,
    ),
    _photographed(
        "concavity",
        "concavity of the flanks",
        "1",
        "1 - 2 area / (width x height) of the outline: 0 for straight flanks, positive for hollow ones",
        seen=lambda view: view.shape.concavity,
        limits=(-1.0, 1.0),
    ),
    _photographed(
        "height",
        "height of the heap",
        "m",
        "of the outline's highest point",
        seen=lambda view: view.shape.height,
    ),
    _photographed(
        "r50",
        "radius of half the heap",
        "m",
        "radius about the apex that holds 50 % of the volume of the outline turned about it",
        seen=lambda view: view.shape.r50,
        never_above="r90",
    ),
    _photographed(
        "r90",
        "radius of nine tenths of the heap",
        "m",
        "radius about the apex that holds 90 % of the volume of the outline turned about it",
        seen=lambda view: view.shape.r90,
    ),
    _photographed(
        "asymmetry",
        "lean of the heap",
        "1",
        "(area right of the apex - area left of it) / area of the outline, x of the study to the right",
        seen=lambda view: view.shape.asymmetry,
        directed=True,
        limits=(-1.0, 1.0),
    ),
    _declared("rolled_fraction", "grains that rolled off", Instrument.BALANCE, limits=(0.0, 1.0)),
    _declared("fill_height", "height of the filling", Instrument.RULER),
    _declared("wall_drag", "weight on the tube", Instrument.BALANCE, limits=(-1.0, 1.0)),
    _declared(
        "t75",
        "time to three quarters",
        Instrument.FILM,
        _UNTIL_REST,
        stands_in="time_to_rest",
        never_above="t55",
    ),
    _declared("t55", "time to 55 %", Instrument.FILM, _UNTIL_REST, stands_in="time_to_rest"),
    _declared("centre_height", "height of the centre of mass", Instrument.SCAN, never_above="height"),
)
"""Observables of the lifted cylinder that a laboratory can measure, in the order of every table."""

SURFACE = tuple(f"surface_{number + 1}" for number in range(len(STATIONS)))
"""Names of the heights of the bed's surface in a drum, its profile."""

OUTLINE_STATIONS = 8
"""Places of a heap's outline, `imaging.flank.heap_shape.STATIONS`."""


def _height_at(number: int, view: View) -> float:
    return float(view.profile[number])


OUTLINE = tuple(
    _photographed(
        f"outline_{number + 1}",
        f"outline at {0.2 * number:.1f}",
        "m",
        f"height of the outline at {0.2 * number:.1f} roots of its area from its middle, mean of both flanks",
        seen=partial(_height_at, number),
        part_of=OUTLINE_PROFILE,
    )
    for number in range(OUTLINE_STATIONS)
)
"""Heights of a heap's outline, its profile; a study asks for them (``[measurement] outline``)."""

NAMES = tuple(observable.name for observable in OBSERVABLES)
"""Their names."""

PHOTOGRAPHED = tuple(observable.name for observable in OBSERVABLES if observable.by_photograph)
"""Names of those that a photograph shows."""

BY_NAME = {name: each for each in (*OBSERVABLES, *OUTLINE) for name in (each.name, each.column)}
"""The same by name and by alias."""

PROFILES = {SURFACE_PROFILE: SURFACE, OUTLINE_PROFILE: tuple(each.name for each in OUTLINE)}
"""Heights of each profile that responses and files may ask for, by its name."""

SOLID_FRACTION, BULK_DENSITY = "solid_fraction", "bulk_density"
"""Observable of a filling, and the one that follows from it and the density of the grain."""
BULK = Observable(
    BULK_DENSITY,
    "bulk density",
    "kg/m^3",
    "mass of the grains over the volume of the container up to the surface",
    Instrument.BALANCE,
)

OF_THE_RUN = ("grain_count", "simulated_time", "grains_lost", "clogged")
"""Observables about the simulation of a test, which nobody measures."""

_INSTRUMENTS = {
    "deg": Instrument.PHOTOGRAPH,
    "m": Instrument.RULER,
    "s": Instrument.FILM,
    "kg": Instrument.BALANCE,
    "kg/s": Instrument.BALANCE,
    "1": Instrument.BALANCE,
}
"""Instrument of each unit, in a test that leaves no heap."""

VERSION = 2
"""Version of the definitions; values measured by other ones are measured again."""


def observables_of(declared: Mapping[str, Declared], leaves_a_heap: bool) -> dict[str, Observable]:
    """Collect what a scene declares and what pictures of its heap show, by columns in a table of cases."""
    heap = {each.column: each for each in (*OBSERVABLES, *OUTLINE)} if leaves_a_heap else {}
    others = {name: _plain(name, *facts) for name, facts in declared.items() if name not in heap}
    return heap | {each.name: each for each in filling(declared) if each is BULK} | others


def filling(declared: Mapping[str, Declared]) -> tuple[Observable, ...]:
    """Return the observables of a filling: its solid fraction and its bulk density; empty without one."""
    return (_plain(SOLID_FRACTION, *declared[SOLID_FRACTION]), BULK) if SOLID_FRACTION in declared else ()


def _plain(name: str, unit: str, meaning: str) -> Observable:
    return Observable(name, name.replace("_", " "), unit, meaning)


def measurable(
    declared: Mapping[str, Declared], leaves_a_heap: bool, outline: bool = False
) -> tuple[Observable, ...]:
    """List what a laboratory can measure of a test, in the order of every table; outlines where asked for.

    Of a test that leaves no heap it is all that the scene declares, except what is about the simulation, and
    for the error, the spread or a side of another observable, whose name begins with that of the other.
    """
    if leaves_a_heap:
        return (*OBSERVABLES, *(OUTLINE if outline else ()))
    return tuple(
        Observable(
            name,
            name.replace("_", " "),
            unit,
            meaning,
            _INSTRUMENTS[unit],
            part_of=SURFACE_PROFILE if name in SURFACE else "",
        )
        for name, (unit, meaning) in declared.items()
        if name not in OF_THE_RUN and not any(name.startswith(f"{other}_") for other in declared)
    )
