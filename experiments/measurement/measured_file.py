"""The file of measured heaps: a tidy CSV with one measurement per row.

Columns, in any order: ``condition`` (of the study), ``replicate`` (a label for each heap), ``observable``,
``value``, ``unit`` (default: the observable's own), ``picture`` (a photograph, relative to the file),
``profile`` (a file of profiles, `experiments.measurement.profile_files`, with one of the same replicate),
``pixel`` (size of the picture's pixels at the heap, e.g. ``0.1 mm``) and ``fit`` (part of the flank that a
written angle was fitted to). The value of a row with a picture is measured on it; without an observable, all
that the picture shows. The mean over several pictures of one heap counts. The observable ``clogged`` means
that the grains stayed in the tube, so there is no heap. A row without value and picture was not measured.
Rows with the condition ``calibration`` state errors of instruments (`instrument_error`).

A value that the test cannot give, e.g. in mm instead of cm, is ignored with a note. An unreadable cell, an
unknown unit, and a picture or profile of another replicate are errors.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from operator import itemgetter
from pathlib import Path

import numpy as np

from doe.discrepancy import Measured
from experiments.io.errors import InputError, Problem
from experiments.io.rows import Row, read_rows
from experiments.io.texts import nearest_name
from experiments.measurement.data_notes import data_notes
from experiments.measurement.duplicates import Duplicates
from experiments.measurement.instrument_error import CALIBRATION, stated_calibration
from experiments.measurement.readings import CLOGGED, CLOGGED_ROW, Outlines, Reading, readings_of
from experiments.measurement.value_limits import ValueLimits, inversions, limits_of_test
from experiments.studyfile import Condition, Study
from experiments.studyfile.observables import BULK, BULK_DENSITY, SOLID_FRACTION, Observable, filling
from imaging import PictureError

COLUMNS = ("condition", "replicate", "observable", "value", "unit", "picture", "pixel", "fit", "profile")
"""Columns of the file."""
NEEDED = COLUMNS[:3]
"""Columns that the file must have."""


def read_measured(path: Path, study: Study, filled: bool = False) -> Measured:
    """Read heaps measured under the conditions of a study, with its measurement settings.

    With ``filled`` the observables of the filling are read too, for a target. Without, a bulk density is the
    solid fraction that it gives with the density of the grain, where that is an observable.
    """
    sizes = {condition.name: limits_of_test(study.under(condition.name)) for condition in study.conditions}
    observables = study.measurable
    if filled:
        observables = tuple(
            {each.name: each for each in (*observables, *filling(study.scene.observables))}.values()
        )
    found = _Found({name: each for each in observables for name in (each.name, each.column)}, filled)
    if not filled and SOLID_FRACTION in found.known:
        found.known[BULK_DENSITY] = BULK
    stated = []
    for row in read_rows(path, NEEDED, COLUMNS):
        if row["condition"] == CALIBRATION and CALIBRATION not in sizes:
            stated.append(row)
        else:
            found.add(row, sizes, study.measurement.fit)
    found.require_sound()
    notes = [*found.notes, *_ignored(found.doubts)]
    notes += [f"{found.empty} rows are empty: not measured"] if found.empty else []
    heaps = {key: heap for key, heap in found.heaps.items() if heap}
    measured = _gather(path, heaps, study.conditions, [each.name for each in observables], notes)
    calibration = stated_calibration(stated, found.known, measured.observables)
    views = {condition.name: condition.camera for condition in study.conditions if condition.camera}
    units = {found.known[name].unit for name in measured.observables} - {"1"}
    kinds = [tuple(n for n in measured.observables if found.known[n].unit == unit) for unit in sorted(units)]
    return replace(measured, calibration=calibration, views=views, kinds=tuple(kinds))


@dataclass
class _Found:
    """Contents of a file: heaps by condition and replicate, and problems with their rows."""

    known: dict[str, Observable]
    """Observables of the test, by name and by alias."""
    filled: bool = False
    """A bulk density remains one."""
    heaps: dict[tuple[str, str], list[Reading]] = field(default_factory=dict)
    doubts: list[tuple[int, Problem]] = field(default_factory=list)
    """Values that the test cannot give, which are ignored."""
    problems: list[tuple[int, Problem]] = field(default_factory=list)
    """Rows that cannot be read."""
    notes: list[str] = field(default_factory=list)
    empty: int = 0
    outlines: Outlines = field(default_factory=Outlines)
    given: dict[str, Duplicates] = field(default_factory=dict)
    """Pictures and profiles of each condition."""

    def add(self, row: Row, sizes: Mapping[str, ValueLimits], fit: str) -> None:
        """Read a row."""
        try:
            heap = self.heaps.setdefault(_heap_of(row, sizes), [])
            readings = list(readings_of(row, sizes[row["condition"]], fit, self.known, self.outlines))
            self._require_own(row, readings)
            if not self.filled:
                readings = [_as_solid_fraction(reading, sizes[row["condition"]]) for reading in readings]
        except InputError as error:
            self.problems += [(row.line, problem) for problem in error.problems]
        except PictureError as error:
            self.notes.append(f"row {row.line}: the picture cannot be measured: {error}")
        else:
            heap += [reading for reading in readings if not reading.doubt]
            self.doubts += [(row.line, reading.doubt) for reading in readings if reading.doubt]
            self.empty += not readings

    def _require_own(self, row: Row, readings: Sequence[Reading]) -> None:
        """Refuse a picture or a profile of another replicate of the condition."""
        given = self.given.setdefault(row["condition"], Duplicates())
        if row["profile"]:
            profile = tuple((reading.observable, reading.value) for reading in readings)
            given.add(profile, row["replicate"], row["profile"], row.place("profile"))
        elif readings and (picture := readings[0].picture):
            given.add_file(row.file.parent / picture, row["replicate"], picture, row.place("picture"))

    def require_sound(self) -> None:
        """Raise an error with all problems if a row cannot be read, or all values are ignored."""
        if self.problems or (self.doubts and not any(self.heaps.values())):
            wrong = sorted([*self.problems, *self.doubts], key=itemgetter(0))
            raise InputError.of(_grouped(wrong))


def _as_solid_fraction(reading: Reading, size: ValueLimits) -> Reading:
    """Turn a bulk density into the part of the volume that grains fill."""
    if reading.observable != BULK_DENSITY:
        return reading
    return replace(reading, observable=SOLID_FRACTION, value=reading.value / size.density)


def _grouped(wrong: Sequence[tuple[int, Problem]]) -> Iterator[Problem]:
    """Yield one problem for all rows with the same problem in one column."""
    alike: dict[tuple[str, str], list[tuple[int, Problem]]] = {}
    for line, problem in wrong:
        column = problem.place.rpartition(": ")[2]
        alike.setdefault((problem.problem, column), []).append((line, problem))
    for rows in alike.values():
        first = rows[0][1]
        if len(rows) == 1:
            yield first
            continue
        values = list(dict.fromkeys(problem.value for _, problem in rows))
        shown = ", ".join(values[:3]) + (", ..." if len(values) > 3 else "")
        yield Problem(f"{first.place}, {_rows([line for line, _ in rows])}", first.problem, shown, first.hint)


def _heap_of(row: Row, conditions: Collection[str]) -> tuple[str, str]:
    if row["condition"] not in conditions:
        rule = f"must be a condition of the study, {nearest_name(row['condition'], list(conditions))}"
        raise row.error(rule, "condition")
    if not row["replicate"]:
        raise row.error("needs a label, one for each heap of a condition", "replicate")
    return row["condition"], row["replicate"]


def _ignored(doubts: Sequence[tuple[int, Problem]]) -> Iterator[str]:
    """Yield a note for all ignored rows with the same problem."""
    for problem in dict.fromkeys(doubt.problem for _, doubt in doubts):
        alike = [(line, doubt) for line, doubt in doubts if doubt.problem == problem]
        first = alike[0][1]
        got = first.value if len(alike) == 1 else f"{first.value}, ..."
        yield f"{_rows([line for line, _ in alike])}: {problem}, got {got}; ignored. {first.hint}"


def _rows(lines: Sequence[int]) -> str:
    """Name rows by their lines, at most three of them."""
    shown = ", ".join(str(line) for line in lines[:3])
    if len(lines) > 3:
        return f"rows {shown} and {len(lines) - 3} more"
    return f"row {shown}" if len(lines) == 1 else f"rows {shown}"


def _gather(
    path: Path,
    heaps: Mapping[tuple[str, str], list[Reading]],
    conditions: Sequence[Condition],
    names: Sequence[str],
    notes: list[str],
) -> Measured:
    """Build the table of heaps."""
    settled = {key: _settle(key, readings, notes) for key, readings in heaps.items()}
    found = {name for heap in settled.values() if heap for name in heap}
    if not found:
        raise InputError(str(path), "has no measured value")
    observables = tuple(name for name in names if name in found)
    values, reasons = {}, {}
    for condition in conditions:
        if group := [heap for (name, _), heap in settled.items() if name == condition.name]:
            rows = [[(heap or {}).get(column, np.nan) for column in observables] for heap in group]
            values[condition.name] = np.array(rows)
            reasons[condition.name] = tuple(CLOGGED if heap is None else "" for heap in group)
    measured = Measured(tuple(values), observables, values, reasons, _pictures(path.parent, heaps))
    held_out = {condition.name: condition.held_out for condition in conditions}
    return replace(measured, notes=(*notes, *data_notes(measured, held_out)))


def _settle(key: tuple[str, str], readings: list[Reading], notes: list[str]) -> dict[str, float] | None:
    """Return the values of one heap by observable, or None without a heap; add notes on contradictions."""
    heap = f"{key[0]}, replicate {key[1]}"
    if any(reading.observable == CLOGGED_ROW for reading in readings):
        if any(reading.observable != CLOGGED_ROW for reading in readings):
            notes.append(f"{heap}: clogged, but with values, which are ignored")
        return None
    values: dict[str, float] = {}
    for name in dict.fromkeys(reading.observable for reading in readings):
        of_one = [reading for reading in readings if reading.observable == name]
        read = {reading.value for reading in of_one}
        lines = " and ".join(str(reading.row.line) for reading in of_one)
        pictures = {reading.picture for reading in of_one if reading.picture}
        if len(pictures) == len(of_one):
            values[name] = float(np.mean([reading.value for reading in of_one]))
        elif len(read) == 1:
            values[name] = read.pop()
            if len(of_one) > 1:
                notes.append(f"{heap}: rows {lines} have the same {name}; it counts once")
        else:
            notes.append(f"{heap}: rows {lines} have different values of {name}, which are ignored")
    _drop_inversions(heap, values, notes)
    return values


def _drop_inversions(heap: str, values: dict[str, float], notes: list[str]) -> None:
    """Ignore observables of one heap that contradict each other."""
    for small, large in list(inversions(values)):
        first, second = values.pop(small), values.pop(large)
        notes.append(
            f"{heap}: {small} cannot be above {large} of the same heap ({first:.6g} > {second:.6g}); both "
            "are ignored. Check the units."
        )


def _pictures(folder: Path, heaps: Mapping[tuple[str, str], list[Reading]]) -> dict[str, tuple[Path, ...]]:
    found: dict[str, list[Path]] = {}
    for (condition, _), readings in heaps.items():
        named = [folder / reading.row["picture"] for reading in readings if reading.row["picture"]]
        if named:
            found.setdefault(condition, []).extend(named)
    return {condition: tuple(dict.fromkeys(paths)) for condition, paths in found.items()}
