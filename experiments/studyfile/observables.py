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
from dem_warp.scenes.penetration import PARTS, PENETRATION_OBSERVABLES
from dem_warp.scenes.press_curve import LOADED, UNLOADED
from dem_warp.scenes.scene import Observable as Declared
from dem_warp.scenes.shear_points import LOADS, SHEAR_OBSERVABLES

if TYPE_CHECKING:
    from imaging import HeapAngle, HeapReadings, HeapShape, ReposeAngle

SURFACE_PROFILE, OUTLINE_PROFILE, CURVE_PROFILE = "surface", "outline", "stress_strain"
"""Observables that are functions: a drum's surface, a heap's outline, strains of grains under a piston."""

SHEAR_PROFILE, FORCE_PROFILE = "shear_points", "force_depth"
"""Further ones: shear stresses against normal stresses, forces on a tool against its depth."""

ANGLE = "angle"
"""Spelling of the repose angle in study files and tables of cases."""

DIMENSIONS = {
    "1": "", "deg": "angle", "m": "length", "s": "time",
    "kg": "mass", "kg/s": "mass flow", "kg/m^3": "density", "Pa": "pressure",
    "N": "force", "J": "energy",
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
    PRESS = "press"
    """A press with a load cell and a gauge of the piston's way."""
    SHEAR_TESTER = "shear-tester"
    """A Jenike, ring or rotational shear tester, or a shear box."""
    PENETROMETER = "penetrometer"
    """A tool with a load cell, for tip and shaft, and a gauge of its depth."""


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

    @cached_property
    def readings(self) -> HeapReadings:
        """Angle of the outline in every usual reading."""
        from imaging import heap_readings

        return heap_readings(self.angle.outline)


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


def _reading(name: str, view: View) -> float:
    return float(getattr(view.readings, name))


READINGS = tuple(
    _photographed(name, title, "deg", rule, seen=partial(_reading, name))
    for name, title, rule in (
        ("line_angle", "angle of the whole flanks", "mean angle of lines through both whole flanks"),
        ("middle_angle", "angle of the middle", "the same through 20 to 80 % of the height"),
        ("height_angle", "angle from toe to apex", "atan of the outline's height over half its width"),
        (
            "centre_angle",
            "angle by the centre of mass",
            "angle of a cone of the outline's width whose centre of mass, at a quarter of its height, is as "
            "high as that of the outline turned about the apex",
        ),
        (
            "volume_angle",
            "angle by the volume",
            "angle of a cone of the outline's width with the volume of the outline turned about the apex",
        ),
    )
)
"""Other readings of a heap's angle, from the same picture: a response may name each of them."""

NAMES = tuple(observable.name for observable in OBSERVABLES)
"""Their names."""

PHOTOGRAPHED = tuple(observable.name for observable in OBSERVABLES if observable.by_photograph)
"""Names of those that a photograph shows."""

BY_NAME = {name: each for each in (*OBSERVABLES, *READINGS, *OUTLINE) for name in (each.name, each.column)}
"""The same by name and by alias."""

PROFILES = {
    SURFACE_PROFILE: SURFACE,
    OUTLINE_PROFILE: tuple(each.name for each in OUTLINE),
    CURVE_PROFILE: tuple(f"strain_{number + 1}" for number in range(len(LOADED + UNLOADED))),
    SHEAR_PROFILE: tuple(f"shear_stress_{number + 1}" for number in range(len(LOADS) + 1)),
    FORCE_PROFILE: tuple(f"force_{number + 1}" for number in range(PARTS)),
}
"""Heights of each profile, strains, stresses or forces, that responses and files may ask for, by its name."""

_PART_OF = {name: profile for profile, names in PROFILES.items() for name in names}

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
    "Pa": Instrument.PRESS,
    "1": Instrument.BALANCE,
}
"""Instrument of each unit, in a test that leaves no heap."""

PRESSED = ("pressed_density", "rebound", "base_share", "strain")
"""Beginnings of the names of further observables of a press."""
_FILMED = ("rebound_height", "rebound_restitution", "tangential_ratio", "speed_ratio")
"""Observables of a test that leaves no heap that a film shows, whatever their unit."""


def instrument_of(observable: Observable) -> Instrument:
    """Return the instrument of an observable; where it names none, that of its unit."""
    return observable.instrument or _instrument(observable.name, observable.unit)


def _instrument(name: str, unit: str) -> Instrument:
    if name in _FILMED:
        return Instrument.FILM
    if name == "run_friction":
        return Instrument.RULER
    if name in SHEAR_OBSERVABLES:
        return Instrument.SHEAR_TESTER
    if name in PENETRATION_OBSERVABLES:
        return Instrument.PENETROMETER
    if name.startswith(PRESSED):
        return Instrument.PRESS
    return _INSTRUMENTS.get(unit, Instrument.BALANCE)


VERSION = 2
"""Version of the definitions; values measured by other ones are measured again."""


def observables_of(declared: Mapping[str, Declared], leaves_a_heap: bool) -> dict[str, Observable]:
    """Collect what a scene declares and what pictures of its heap show, by columns in a table of cases."""
    pictured = (*OBSERVABLES, *READINGS, *OUTLINE)
    heap = {each.column: each for each in pictured} if leaves_a_heap else {}
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
        lacking = LiftedCylinder.observables.keys() - declared.keys()
        given = tuple(each for each in OBSERVABLES if each.name not in lacking)
        return (*given, *(OUTLINE if outline else ()))
    return tuple(
        Observable(
            name,
            name.replace("_", " "),
            unit,
            meaning,
            _instrument(name, unit),
            part_of=_PART_OF.get(name, ""),
        )
        for name, (unit, meaning) in declared.items()
        if name not in OF_THE_RUN and not any(name.startswith(f"{other}_") for other in declared)
    )
