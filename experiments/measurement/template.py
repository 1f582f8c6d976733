"""A file of measured heaps to start from: every condition of a study and every observable, still empty."""

from __future__ import annotations

import csv
import io
import textwrap
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from experiments.io.files import require_new_file, write_text
from experiments.measurement.measured_file import COLUMNS
from experiments.measurement.readings import CLOGGED_ROW
from experiments.studyfile import Condition, Study

REPLICATES = 5
"""Heaps of each condition that the file has room for."""

LABORATORY_UNITS = {"m": "mm"}
"""Units that the file is filled in with, where they are not those of the observables."""

_HEAD = """\
Tests measured for the study {study}: a row a measurement. Fill in what was measured, then
    dem-warp discover {study} {file}
or name it in the study, as the file of its [target], and calibrate.
A row without a value is not measured; whole rows may be left out or added, with other units too. A unit that
is unknown or of another kind, as inches, is refused. A value that this test cannot give, in mm for cm most
often, is set aside; --dry-run and the report say so.

condition: how the test was done, a condition of the study.
{conditions}

replicate: one heap, a label. Five or more of each condition show small effects; a copy of a heap shows none.

observable: what was measured, or {clogged} (without a value) where the grains got stuck: no result.
{observables}

profile: instead of a value, a file of profiles, columns replicate, x, z, with one of the same replicate.

calibration: in the place of a condition, what an instrument may be off by in all conditions alike, a standard
deviation: "offset" or "scale" for the replicate (scale: a share, as 0.2 %), or "none" where nothing is off.
What is not stated is as usual for the instrument: a film of 60 frames a second, a ruler's millimetre, a
levelled camera."""

_PICTURES = """

picture: instead of a value, a photograph of the heap from the side, level with the plate, x of the study to
the right; its file relative to this one. pixel: the size of one of its pixels at the heap, as 0.08 mm;
lengths need it. A row with a picture and no observable gives all that the picture shows; several pictures of
one heap count with their mean. fit: part of the flank that a written angle was fitted to, which must be the
study's; left out, it is taken to be that."""


def write_measured_template(study: Study, folder: Path | None = None) -> Path:
    """Write a commented file for the measured heaps of a study, ``NAME-measured.csv`` for ``NAME.toml``.

    Raises
    ------
    InputError
        When the file exists.
    """
    path = (folder or Path()) / f"{study.file.stem}-measured.csv"
    require_new_file(path, "a new file")
    head = _HEAD.format(
        study=study.file.name,
        file=path.name,
        clogged=CLOGGED_ROW,
        conditions="\n".join(_described(condition) for condition in study.conditions),
        observables="\n".join(_defined(study)),
    )
    head += _PICTURES if study.scene.leaves_a_heap else ""
    text = io.StringIO()
    text.writelines(f"# {line}".rstrip() + "\n" for line in head.splitlines())
    writer = csv.DictWriter(text, COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(_empty_rows(study))
    write_text(path, text.getvalue())
    return path


def _described(condition: Condition) -> str:
    """One condition, and what it changes."""
    changes = "; ".join(f"{place} = {value}" for place, value in _flat(condition.changes))
    held_out = " (held out: it only judges)" if condition.held_out else ""
    return f"    {condition.name}: {changes or 'the test as it is'}{held_out}"


def _flat(table: Mapping[str, Any], place: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in table.items():
        name = f"{place}.{key}".removeprefix(".")
        if isinstance(value, Mapping):
            yield from _flat(value, name)
        else:
            yield name, value


def _defined(study: Study) -> Iterator[str]:
    """Every observable of a study's test, with its unit, its instrument and its definition."""
    for observable in study.measurable:
        unit = LABORATORY_UNITS.get(observable.unit, observable.unit)
        text = f"{observable.name} [{unit}], {observable.instrument}: {observable.definition}"
        yield textwrap.fill(text, 108, initial_indent=4 * " ", subsequent_indent=8 * " ")


def _empty_rows(study: Study) -> Iterator[dict[str, object]]:
    for condition in study.conditions:
        for replicate in range(1, REPLICATES + 1):
            for observable in study.measurable:
                yield {
                    "condition": condition.name,
                    "replicate": replicate,
                    "observable": observable.name,
                    "unit": LABORATORY_UNITS.get(observable.unit, observable.unit),
                }
