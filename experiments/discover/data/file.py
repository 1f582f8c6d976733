"""The file of measured heaps: a tidy CSV, a row a measurement.

Columns, in any order: ``condition`` (of the study), ``replicate`` (a label; one heap), ``observable``,
``value``, ``unit`` (left out: the observable's own), ``picture`` (a photograph, relative to the file) and
``pixel`` (the size of one of its pixels at the heap, as ``0.1 mm``). A row with a picture and no value is
measured on the picture; without an observable, all that the picture shows. Several pictures of one heap are
views of it: their mean counts. The observable ``clogged`` says that the tube held its grains, so that there
is no heap. A row without value and picture says that nothing was measured.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from experiments.discover.data.notes import data_notes
from experiments.discover.data.plausible import inversions, size_of_test
from experiments.discover.data.readings import CLOGGED_ROW, Reading, readings_of
from experiments.discover.data.table import Row, read_rows
from experiments.discover.measured import CLOGGED, Measured
from experiments.discover.observables import NAMES
from experiments.errors import InputError, Problem
from experiments.study import Study
from experiments.study.conditions import Condition
from experiments.study.schema import nearest_name
from imaging import PictureError

COLUMNS = ("condition", "replicate", "observable", "value", "unit", "picture", "pixel")
"""Columns of the file."""
NEEDED = COLUMNS[:3]
"""Those that it must have."""


def read_measured(path: Path, study: Study) -> Measured:
    """Read measured heaps.

    Parameters
    ----------
    path
        The file; its columns stand at the head of this module.
    study
        Whose conditions were tested, and whose measurement angles of pictures are read with.

    Raises
    ------
    InputError
        When the file cannot be read or breaks a rule: every rule, the values received, and their rows. When
        the study's test leaves no heap.
    """
    sizes = {condition.name: size_of_test(study.under(condition.name)) for condition in study.conditions}
    heaps: dict[tuple[str, str], list[Reading]] = {}
    problems: list[Problem] = []
    notes: list[str] = []
    empty = 0
    for row in read_rows(path, NEEDED, COLUMNS):
        try:
            heap = heaps.setdefault(_heap_of(row, sizes), [])
            found = list(readings_of(row, sizes[row["condition"]], study.measurement.fit))
        except InputError as error:
            problems += error.problems
        except PictureError as error:
            notes.append(f"row {row.line}: the picture shows nothing to measure: {error}")
        else:
            heap += found
            empty += not found
    problems += [problem for heap in heaps.values() for problem in _wrong_way_round(heap)]
    if problems:
        first, *more = problems
        raise InputError(first.rule, first.value, first.place, tuple(more))
    notes += [f"{empty} rows are empty: not measured"] if empty else []
    return _gather(path, {key: heap for key, heap in heaps.items() if heap}, study.conditions, notes)


def _heap_of(row: Row, conditions: Collection[str]) -> tuple[str, str]:
    """Condition and replicate of a row."""
    if row["condition"] not in conditions:
        rule = f"must be a condition of the study, {nearest_name(row['condition'], list(conditions))}"
        raise row.error(rule, "condition")
    if not row["replicate"]:
        raise row.error("needs a label, one for each heap of a condition", "replicate")
    return row["condition"], row["replicate"]


def _wrong_way_round(heap: list[Reading]) -> Iterator[Problem]:
    """Problems of a heap whose observables cannot be true together."""
    values = {reading.observable: reading for reading in heap}
    for small, large in inversions({name: reading.value for name, reading in values.items()}):
        row = values[small].row
        rule = f"{small} is never above {large} of the same heap: are the units right?"
        yield Problem(
            rule, f"{values[small].value:.6g} > {values[large].value:.6g}", f"{row.file}:{row.line}: value"
        )


def _gather(
    path: Path,
    heaps: Mapping[tuple[str, str], list[Reading]],
    conditions: Sequence[Condition],
    notes: list[str],
) -> Measured:
    """Set heaps side by side."""
    settled = {key: _settle(key, readings, notes) for key, readings in heaps.items()}
    found = {name for heap in settled.values() if heap for name in heap}
    if not found:
        raise InputError("needs at least one measured value", "none", str(path))
    observables = tuple(name for name in NAMES if name in found)
    groups = {
        condition.name: [heap for (name, _), heap in settled.items() if name == condition.name]
        for condition in conditions
    }
    groups = {name: group for name, group in groups.items() if group}
    measured = Measured(
        tuple(groups),
        observables,
        {
            name: np.array([[(heap or {}).get(column, np.nan) for column in observables] for heap in group])
            for name, group in groups.items()
        },
        {name: tuple(CLOGGED if heap is None else "" for heap in group) for name, group in groups.items()},
        _pictures(path.parent, heaps),
    )
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
    return values


def _pictures(folder: Path, heaps: Mapping[tuple[str, str], list[Reading]]) -> dict[str, tuple[Path, ...]]:
    """Pictures of each condition, each once."""
    found: dict[str, dict[Path, None]] = {}
    for (condition, _), readings in heaps.items():
        for reading in readings:
            if reading.row["picture"]:
                found.setdefault(condition, {})[folder / reading.row["picture"]] = None
    return {condition: tuple(paths) for condition, paths in found.items()}
