"""Template of a file of measured heaps, with every condition and observable of a study."""

from __future__ import annotations

import csv
import io
import textwrap
from collections.abc import Iterator
from pathlib import Path

from dem_warp import Drum
from experiments.io.files import require_new_file, write_text
from experiments.io.toml_files import leaves
from experiments.measurement.measured_file import COLUMNS
from experiments.measurement.readings import CLOGGED_ROW
from experiments.studyfile import Condition, Study

REPLICATES = 5
"""Heaps of each condition in the template."""

LABORATORY_UNITS = {"m": "mm"}
"""Units in the template that differ from those of the observables."""

_HEAD = """\
Tests measured for the study {study}, one measurement per row. Fill in the measured values, then run
    dem-warp discover {study} {file}
or name this file in the [target] of the study, and calibrate.
A row without a value is not measured. You may remove or add rows, and use other units. An unknown unit, e.g.
inches, is an error. A value that this test cannot give, e.g. in mm instead of cm, is ignored; --dry-run and
the report say so.

condition: a condition of the study.
{conditions}

replicate: a label for each heap. Five or more of each condition show small effects. Do not copy heaps.

observable: the measured quantity, or {clogged} (without a value) where the grains got stuck.
{observables}

profile: instead of a value, a file of profiles, columns replicate, x, z, with one of the same replicate.

calibration: instead of a condition, an error of an instrument that is the same in all conditions, a standard
deviation: "offset" or "scale" for the replicate (scale: a share, e.g. 0.2 %), or "none" without any error.
The default is usual for the instrument: a film of 60 frames a second, a ruler's millimetre, a levelled
camera."""

_PICTURES = """

picture: instead of a value, a photograph of the heap from the side, level with the plate, x of the study to
the right; its path is relative to this file. pixel: size of its pixels at the heap, e.g. 0.08 mm; lengths
need it. A row with a picture and no observable gives all that the picture shows; the mean over several
pictures of one heap counts. fit: part of the flank that a written angle was fitted to; it must be the
study's, which is the default."""

_DRUM = """

picture: instead of a value, a picture of the drum along its axis, the camera level; its path is relative to
this file. A row with a picture and no observable gives all that the picture shows."""


def write_measured_template(study: Study, folder: Path | None = None) -> Path:
    """Write a commented file for the measured heaps of ``NAME.toml``, ``NAME-measured.csv``."""
    path = (folder or Path()) / f"{study.file.stem}-measured.csv"
    require_new_file(path, "a new file")
    head = _HEAD.format(
        study=study.file.name,
        file=path.name,
        clogged=CLOGGED_ROW,
        conditions="\n".join(_described(condition) for condition in study.conditions),
        observables="\n".join(_defined(study)),
    )
    head += _PICTURES if study.scene.leaves_a_heap else _DRUM if issubclass(study.scene.kind, Drum) else ""
    text = io.StringIO()
    text.writelines(f"# {line}".rstrip() + "\n" for line in head.splitlines())
    writer = csv.DictWriter(text, COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(_empty_rows(study))
    write_text(path, text.getvalue())
    return path


def _described(condition: Condition) -> str:
    changes = "; ".join(f"{place} = {value}" for place, value in leaves(condition.changes))
    held_out = " (held out: not fitted, it tests the result)" if condition.held_out else ""
    return f"    {condition.name}: {changes or 'the test as it is'}{held_out}"


def _defined(study: Study) -> Iterator[str]:
    """Describe every observable of a study's test."""
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
