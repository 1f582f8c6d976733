"""The file of measured heaps: a tidy CSV, a row a measurement.

Columns, in any order: ``condition`` (of the study), ``replicate`` (a label; one heap), ``observable``,
``value``, ``unit`` (left out: the observable's own), ``picture`` (a photograph, relative to the file),
``profile`` (a file of profiles, `experiments.measurement.profile_files`, with one of the same replicate),
``pixel`` (the size of one of its pixels at the heap, as ``0.1 mm``) and ``fit`` (part of the flank that an
angle was fitted to, where it is written). A row with a picture and no value is
measured on the picture; without an observable, all that the picture shows. Several pictures of one heap are
views of it: their mean counts. The observable ``clogged`` says that the tube held its grains, so that there
is no heap. A row without value and picture says that nothing was measured. Rows of the condition
``calibration`` state what instruments may be off by (`calibration`).

A value that the test cannot give, in mm for cm most often, is set aside and noted. What cannot be read is an
error, whatever the other rows are: a unit that is unknown or of another kind, too, and a picture or a profile
of another replicate.
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
from experiments.measurement.calibration import CALIBRATION, stated_calibration
from experiments.measurement.copies import Repeats
from experiments.measurement.notes import data_notes
from experiments.measurement.plausible import SizeOfTest, inversions, size_of_test
from experiments.measurement.readings import CLOGGED, CLOGGED_ROW, Outlines, Reading, readings_of
from experiments.studyfile import Condition, Study
from experiments.studyfile.observables import Observable
from imaging import PictureError

COLUMNS = ("condition", "replicate", "observable", "value", "unit", "picture", "pixel", "fit", "profile")
"""Columns of the file."""
NEEDED = COLUMNS[:3]
"""Those that it must have."""


def read_measured(path: Path, study: Study) -> Measured:
    """Read heaps measured under the conditions of a study, as its measurement says; columns: see above.

    Raises
    ------
    InputError
        When the file cannot be read or breaks a rule: every rule, the values received, and their rows. When
        no value is left.
    """
    sizes = {condition.name: size_of_test(study.under(condition.name)) for condition in study.conditions}
    observables = study.measurable
    found = _Found({name: each for each in observables for name in (each.name, each.column)})
    stated = []
    for row in read_rows(path, NEEDED, COLUMNS):
        if row["condition"] == CALIBRATION and CALIBRATION not in sizes:
            stated.append(row)
        else:
            found.add(row, sizes, study.measurement.fit)
    found.require_sound()
    notes = [*found.notes, *_set_aside(found.doubts)]
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
    """Contents of a file: heaps by condition and replicate, and what is wrong, each with its row."""

    known: Mapping[str, Observable]
    """Observables of the test, by name and by alias."""
    heaps: dict[tuple[str, str], list[Reading]] = field(default_factory=dict)
    doubts: list[tuple[int, Problem]] = field(default_factory=list)
    """Values that the test cannot give, which are set aside."""
    problems: list[tuple[int, Problem]] = field(default_factory=list)
    """Rows that cannot be read."""
    notes: list[str] = field(default_factory=list)
    empty: int = 0
    outlines: Outlines = field(default_factory=Outlines)
    repeats: dict[str, Repeats] = field(default_factory=dict)
    """Pictures and profiles of each condition."""

    def add(self, row: Row, sizes: Mapping[str, SizeOfTest], fit: str) -> None:
        """Read a row."""
        try:
            heap = self.heaps.setdefault(_heap_of(row, sizes), [])
            readings = list(readings_of(row, sizes[row["condition"]], fit, self.known, self.outlines))
            self._require_own(row, readings)
        except InputError as error:
            self.problems += [(row.line, problem) for problem in error.problems]
        except PictureError as error:
            self.notes.append(f"row {row.line}: the picture shows nothing to measure: {error}")
        else:
            heap += [reading for reading in readings if not reading.doubt]
            self.doubts += [(row.line, reading.doubt) for reading in readings if reading.doubt]
            self.empty += not readings

    def _require_own(self, row: Row, readings: Sequence[Reading]) -> None:
        """Refuse a picture or a profile of another replicate of the condition."""
        repeats = self.repeats.setdefault(row["condition"], Repeats())
        if row["profile"]:
            profile = tuple((reading.observable, reading.value) for reading in readings)
            repeats.add(profile, row["replicate"], row["profile"], row.place("profile"))
        elif readings and (picture := readings[0].picture):
            repeats.add_file(row.file.parent / picture, row["replicate"], picture, row.place("picture"))

    def require_sound(self) -> None:
        """Raise an error with all that is wrong if a row cannot be read, or all values are set aside."""
        if self.problems or (self.doubts and not any(self.heaps.values())):
            wrong = sorted([*self.problems, *self.doubts], key=itemgetter(0))
            raise InputError.of(_told_once(wrong))


def _told_once(wrong: Sequence[tuple[int, Problem]]) -> Iterator[Problem]:
    """Tell one problem for all rows whose cell of one column breaks the same rule."""
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
        yield Problem(f"{first.place}, {_rows([line for line, _ in rows])}", first.problem, shown)


def _heap_of(row: Row, conditions: Collection[str]) -> tuple[str, str]:
    """Condition and replicate of a row."""
    if row["condition"] not in conditions:
        rule = f"must be a condition of the study, {nearest_name(row['condition'], list(conditions))}"
        raise row.error(rule, "condition")
    if not row["replicate"]:
        raise row.error("needs a label, one for each heap of a condition", "replicate")
    return row["condition"], row["replicate"]


def _set_aside(doubts: Sequence[tuple[int, Problem]]) -> Iterator[str]:
    """Say which rows were set aside: a note for all that break the same rule."""
    for rule in dict.fromkeys(doubt.problem for _, doubt in doubts):
        alike = [(line, doubt.value) for line, doubt in doubts if doubt.problem == rule]
        received = alike[0][1] if len(alike) == 1 else f"{alike[0][1]}, ..."
        yield f"{_rows([line for line, _ in alike])}: {rule}, got {received}; set aside"


def _rows(lines: Sequence[int]) -> str:
    """Rows by their lines; of many the first few."""
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
    """Set heaps side by side."""
    settled = {key: _settle(key, readings, notes) for key, readings in heaps.items()}
    found = {name for heap in settled.values() if heap for name in heap}
    if not found:
        raise InputError(str(path), "needs at least one measured value", "none")
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
    """Values of one heap by observable; None where there is no heap. What was not clear is noted."""
    heap = f"{key[0]}, replicate {key[1]}"
    if any(reading.observable == CLOGGED_ROW for reading in readings):
        if any(reading.observable != CLOGGED_ROW for reading in readings):
            notes.append(f"{heap}: clogged, and measured too; the values were set aside")
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
                notes.append(f"{heap}: rows {lines} say the same of {name}; it counts once")
        else:
            notes.append(f"{heap}: rows {lines} contradict each other on {name}; it was set aside")
    _drop_inversions(heap, values, notes)
    return values


def _drop_inversions(heap: str, values: dict[str, float], notes: list[str]) -> None:
    """Set aside observables of one heap that cannot be true together."""
    for small, large in list(inversions(values)):
        first, second = values.pop(small), values.pop(large)
        notes.append(
            f"{heap}: {small} is never above {large} of the same heap ({first:.6g} > {second:.6g}): are the "
            "units right? Both were set aside"
        )


def _pictures(folder: Path, heaps: Mapping[tuple[str, str], list[Reading]]) -> dict[str, tuple[Path, ...]]:
    """Pictures of each condition, each once."""
    found: dict[str, list[Path]] = {}
    for (condition, _), readings in heaps.items():
        named = [folder / reading.row["picture"] for reading in readings if reading.row["picture"]]
        if named:
            found.setdefault(condition, []).extend(named)
    return {condition: tuple(dict.fromkeys(paths)) for condition, paths in found.items()}
