"""Readings of contact parameters on the bench: an incline, a rebound, ...; formulas and standard errors.

Lengths count by their ratios alone, so those without a unit must all be in the same one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dem_warp.scenes.bench_formulas import rebound, rolling_run
from doe import Sample, StatedValue
from experiments.grains.sizes.size_tables import UnitHeader
from experiments.io.errors import InputError
from experiments.io.rows import read_rows
from experiments.io.units import Quantity

PLAIN = {"angle": "deg", "length": "mm", "time": "s"}
"""Unit of a number without one."""

STEP = 1e-4
"""Step of a quantity in its standard deviations at which the formula's slope is taken."""

MOST = 1e15
"""Largest parameter in SI: a larger one is a slip."""

Columns = Mapping[str, Sequence[Quantity]]
"""Quantities by name, one or as many as there are readings; alone by the name ``""``."""


@dataclass(frozen=True)
class Formula:
    """One way from what is read on the bench to a parameter."""

    parameter: str
    """Last key of the parameters that it gives; empty: any."""
    quantities: Mapping[str, str]
    """Dimension of each quantity that is read."""
    calculate: Callable[..., float]
    """Calculates the parameter from the quantities by name: SI, angles in degrees."""
    words: str
    """The quantities and the formula."""

    def of_readings(self, columns: Columns, dimension: str = "") -> Sample:
        """Calculate the parameter of each reading, and take their mean and scatter.

        ``dimension`` is the parameter's own, which a bare value needs. Raise ValueError when there are fewer
        than two readings, they do not scatter, or one is impossible.
        """
        names = self._named(columns)
        count = max(len(column) for column in names.values())
        for name, column in names.items():
            if len(column) not in (1, count):
                raise ValueError(f"needs as many of {name} as of the others, or one: {count}")
        rows = [{k: c[i if len(c) > 1 else 0] for k, c in names.items()} for i in range(count)]
        values = [self._value(self._numbers(row, dimension)) for row in rows]
        if count < 2:
            raise ValueError("needs two readings or more; for one, give mean, sd and n = 1")
        if not np.ptp(values) > 0.0:
            raise ValueError("shows no scatter; give mean, sd (of the instrument) and n = 1")
        return Sample.of(values)

    def of_means(self, mean: Columns, sd: Columns, n: int, dimension: str = "") -> Sample:
        """Calculate the parameter of mean quantities; the standard deviation by the delta method.

        A quantity without an sd is exact. With n = 1 the sd counts as known. Raise ValueError when a
        quantity is missing or impossible, or none has an sd.
        """
        means, spreads = self._named(mean), self._named(sd, needs_all=False)
        if any(len(column) != 1 for column in (*means.values(), *spreads.values())):
            raise ValueError("mean and sd must have one value of each quantity")
        numbers = self._numbers({name: column[0] for name, column in means.items()}, dimension)
        errors = self._numbers({name: column[0] for name, column in spreads.items()}, dimension)
        if not errors or min(errors.values()) < 0.0 or not max(errors.values()) > 0.0:
            raise ValueError("sd must be positive")
        value = self._value(numbers)
        spread = math.hypot(*(self._slope(numbers, name, error) for name, error in errors.items()))
        if not math.isfinite(spread):
            raise ValueError("is at the edge of what the formula can have: give single readings")
        return Sample(value, spread, n) if n > 1 else StatedValue(value, spread)

    def _named(self, columns: Columns, needs_all: bool = True) -> Columns:
        """Name what was given without a name, and check the names."""
        if set(columns) == {""} and len(self.quantities) == 1:
            return dict(zip(self.quantities, columns.values(), strict=True))
        missing = [name for name in self.quantities if name not in columns]
        if set(columns) - set(self.quantities) or (missing and needs_all):
            raise ValueError(f"needs {' and '.join(self.quantities)}")
        return columns

    def _numbers(self, row: Mapping[str, Quantity], dimension: str) -> dict[str, float]:
        numbers = {}
        for name, quantity in row.items():
            kind = self.quantities[name] or dimension
            try:
                numbers[name] = Quantity(quantity.number, quantity.unit or PLAIN.get(kind, "")).to_base(kind)
            except ValueError as error:
                raise ValueError(f"{name} {error}") from None
        return numbers

    def _value(self, numbers: Mapping[str, float]) -> float:
        """Calculate the parameter; ValueError where the quantities or the parameter are impossible."""
        shown = ", ".join(f"{name} {value:.4g}" for name, value in numbers.items())
        for name, value in numbers.items():
            high = 90.0 if self.quantities[name] == "angle" and name not in SWINGS else math.inf
            if not 0.0 < value < high:
                rule = "positive" if math.isinf(high) else "between 0 and 90 deg"
                raise ValueError(f"{name} must be {rule}, got {value:.4g}")
        found = self._calculated(numbers)
        high = 1.0 if self.parameter == "restitution" else MOST
        if not 0.0 < found <= high:
            what = "a restitution above 0 and at most 1" if high == 1.0 else "a positive value"
            raise ValueError(f"must give {what}, got {found:.4g} from {shown}")
        return found

    def _calculated(self, numbers: Mapping[str, float]) -> float:
        try:
            return self.calculate(**numbers)
        except (ValueError, ZeroDivisionError):
            return math.nan

    def _slope(self, numbers: Mapping[str, float], name: str, error: float) -> float:
        """Return the change of the parameter with one standard deviation of a quantity."""
        step = STEP * error
        high, low = (self._calculated({**numbers, name: numbers[name] + side * step}) for side in (1, -1))
        return (high - low) / (2.0 * STEP)


def _rebound_45(fall: float, height_1: float, distance_1: float, height_2: float, distance_2: float) -> float:
    # speeds over the root of the acceleration of gravity, which cancels: away from the plate, and downwards
    bent = height_1 * distance_2 - height_2 * distance_1
    away = math.sqrt(distance_1 * distance_2 * (distance_1 - distance_2) / (2.0 * bent))
    down = height_1 * away / distance_1 - distance_1 / (2.0 * away)
    return (away - down) / math.sqrt(2.0 * fall)


def _pendulum(release: float, striker: float, struck: float) -> float:
    start, own, other = (math.sqrt(1.0 - math.cos(math.radians(each))) for each in (release, striker, struck))
    return (other - own) / start


SWINGS = ("release", "striker", "struck")
"""Angles of a pendulum, which may be above 90 degrees."""


def _tilt(parameter: str, event: str) -> Formula:
    words = f"angle of the plate at which {event}; tan(angle)"
    return Formula(parameter, {"angle": "angle"}, lambda angle: math.tan(math.radians(angle)), words)


METHODS: Mapping[str, tuple[Formula, ...]] = {
    "incline": (_tilt("static_friction", "the grain slides"),),
    "sledge": (_tilt("static_friction", "three or four grains, glued to a sledge, slide"),),
    "rolling-start": (_tilt("rolling_friction", "the grain rolls"),),
    "rolling-run": (
        Formula(
            "rolling_friction",
            {"slope": "angle", "distance": "length", "run": "length"},
            lambda slope, distance, run: rolling_run(math.radians(slope), distance, run),
            "angle of a slope, distance rolled down it, run on the flat behind it; "
            "distance sin(slope) / (distance cos(slope) + run)",
        ),
    ),
    "rebound": (
        Formula(
            "restitution",
            {"fall": "length", "height": "length"},
            rebound,
            "heights of fall and rebound; sqrt(height / fall)",
        ),
        Formula(
            "restitution",
            {"first": "time", "second": "time"},
            lambda first, second: second / first,
            "times between successive bounces; second / first",
        ),
    ),
    "rebound-45": (
        Formula(
            "restitution",
            dict.fromkeys(("fall", "height_1", "distance_1", "height_2", "distance_2"), "length"),
            _rebound_45,
            "height of fall onto a plate at 45 degrees; then two heights below the hit and the horizontal "
            "distances at which the grain passes them; normal speed after over before",
        ),
    ),
    "pendulum": (
        Formula(
            "restitution",
            dict.fromkeys(SWINGS, "angle"),
            _pendulum,
            "angle from which a grain is released, to which it swings on, to which the struck one swings; "
            "(sqrt(1 - cos(struck)) - sqrt(1 - cos(striker))) / sqrt(1 - cos(release))",
        ),
    ),
    "value": (Formula("", {"value": ""}, lambda value: value, "the parameter itself"),),
}
"""Formulas of each method; where it has several, the quantities that were read choose."""


def formula_of(method: str, given: Collection[str]) -> Formula:
    """Return the formula of a method for quantities by name; ValueError where they are not those of one."""
    formulas = METHODS[method]
    sole = set(given) == {""}
    for formula in formulas:
        if set(given) == set(formula.quantities) or (sole and len(formula.quantities) == 1):
            return formula
    needs = ", or ".join(" and ".join(formula.quantities) for formula in formulas)
    got = "no names" if sole else ", ".join(given) or "nothing"
    raise ValueError(f"{method} needs {needs}, got {got}")


def read_columns(path: Path, method: str) -> dict[str, list[Quantity]]:
    """Read readings, one a row, from a CSV file with a column for each quantity of a method.

    A cell may have its unit, or the column's name in brackets, e.g. ``height [mm]``. Raise InputError when
    the file cannot be read, lacks a column, or has a cell that is no quantity.
    """
    known = [name for formula in METHODS[method] for name in formula.quantities]
    header = UnitHeader(lambda name, unit: name.lower() if name.lower() in known else "")
    rows = list(read_rows(path, (), known, header))
    needed = next((f.quantities for f in METHODS[method] if set(f.quantities) <= set(rows[0].cells)), None)
    if needed is None:
        ways = ", or ".join(" and ".join(formula.quantities) for formula in METHODS[method])
        raise InputError(str(path), f"needs rows below the columns {ways}")
    found: dict[str, list[Quantity]] = {name: [] for name in needed}
    for row in rows:
        for name, column in found.items():
            try:
                quantity = Quantity.parse(row[name])
            except ValueError as error:
                raise row.error(str(error), name) from None
            column.append(Quantity(quantity.number, quantity.unit or header.units.get(name, "")))
    return found
