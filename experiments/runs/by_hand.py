"""Runs that a person does in another program: sheets of cases to fill in, and the numbers of filled ones."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from dem_warp import Case
from doe import Factor
from experiments.cases import Store
from experiments.cases.execute import build_cases
from experiments.export import EXPORTERS, ExportedTest, case_terms, export_input, write_export
from experiments.io.errors import InputError
from experiments.io.files import write_text
from experiments.io.rows import Row, read_rows
from experiments.io.texts import is_number, number, safe_cell
from experiments.measurement.photographs import PictureOptions, measure_pictures
from experiments.runs.request import AwaitingRuns
from experiments.studyfile import Study
from experiments.studyfile.campaign import Response
from experiments.studyfile.observables import ANGLE

SHEETS, CASE, PICTURE, FAILED = "by-hand", "case", "picture", "failed"
"""Folder of the sheets; columns of a case's key and of its picture; word for a run that failed."""
PLACES = (CASE, "stage", "test", "run", "repeat", "seed")
KEY = 12
"""Characters of a case's key."""
CODES = ("edem", "rocky")
"""Codes whose names of the values a sheet has."""
DIGITS = "%.10g"
"""Form of a setting."""
LISTED = 6
"""Runs without result that a message lists."""


def typed_cases(study: Study, table: pd.DataFrame, folder: Path, title: str, store: Store) -> pd.DataFrame:
    """Return a table of cases with the results that a person typed in; `run_cases` with a person as solver.

    Raises
    ------
    AwaitingRuns
        A sheet was written, or waits for its results.
    InputError
        A sheet that is filled in part, a setting that was changed, a result that is not a number, or a
        picture without an angle.
    """
    cases, refused = build_cases(study, table)
    keys = [store.key(case)[:KEY] if case else "" for case in cases]
    responses = [_of_scene(study, scene) for scene in table["scene"]]
    filled = {row[CASE]: row for path in _sheets(folder) for row in _rows(path, study)}
    fresh = [place for place, key in enumerate(keys) if key and key not in filled]
    if fresh:
        path = folder / SHEETS / f"{len(_sheets(folder)) + 1:02d}-{re.sub('[^a-z]+', '-', title.lower())}.csv"
        heads = {name: None for place in fresh for name in _heads(responses[place])}
        rows = _blank_rows(study, table.iloc[fresh], [keys[place] for place in fresh])
        _write_sheet(path, study, rows, list(heads))
        _write_protocols(path.parent, study, cases)
        raise AwaitingRuns(_waiting(path, len(fresh)))
    _require_unchanged(study, table, keys, filled)
    _require_filled(keys, filled, responses)
    known = {
        key: _result(filled[key], of, study.measurement.fit)
        for key, of in zip(keys, responses, strict=True)
        if key
    }
    lost = {"status": "refused", ANGLE: math.nan, "angle_se": math.nan}
    results = [
        known[key] if key else lost | {"reason": reason} for key, reason in zip(keys, refused, strict=True)
    ]
    return pd.concat([table, pd.DataFrame(results, index=table.index).assign(case_key=keys)], axis=1)


def _of_scene(study: Study, scene: str) -> list[Response]:
    return [each for each in study.target.responses if each.scene == scene]


def _heads(responses: Sequence[Response]) -> Iterator[str]:
    """Name the columns of results: a response with its unit, and a picture where it can show the response."""
    for response in responses:
        if response.weights or response.part_of:
            problem = "is a profile, which nobody can type in"
            raise InputError(f"response {response.name}", problem, hint="Give it as numbers of the heap.")
        yield f"{response.observable} [{response.unit}]"
        if response.observable == ANGLE:
            yield PICTURE


def _sheets(folder: Path) -> list[Path]:
    return sorted((folder / SHEETS).glob("*.csv"))


def _rows(path: Path, study: Study) -> Iterator[Row]:
    results = [head for response in study.target.responses for head in _heads([response])]
    known = [*PLACES, *(_head(factor) for factor in study.factors), *results]
    return read_rows(path, [CASE], known)


def _head(factor: Factor) -> str:
    return f"{factor.name} [{factor.unit or '1'}]"


def _blank_rows(study: Study, table: pd.DataFrame, keys: Sequence[str]) -> list[dict[str, Any]]:
    """Lay out the settings of each case."""
    rows = []
    for key, row in zip(keys, table.to_dict("records"), strict=True):
        place = (key, row["stage"], row["scene"], row["run"], row["replicate"], row["seed"])
        rows.append(dict(zip(PLACES, place, strict=True)) | {_head(f): row[f.name] for f in study.factors})
    return rows


def _write_sheet(path: Path, study: Study, rows: Sequence[Mapping[str, Any]], results: list[str]) -> None:
    """Write a sheet: comments with other codes' names of the values, then a row for each run."""
    frame = pd.DataFrame(rows).assign(**dict.fromkeys(results, "")).map(safe_cell)
    words = [f"Fill in the last columns; write {FAILED} for a run that failed. Change nothing else."]
    words += [f"{EXPORTERS[code].code}: {line}" for code in CODES for line in _names(study, code)]
    comments = "".join(f"# {word.replace(',', ';')}\n" for word in words)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, comments + frame.to_csv(index=False, float_format=DIGITS, lineterminator="\n"))


def _names(study: Study, code: str) -> Iterator[str]:
    """Name the values that a factor changes in a code, e.g. ``F = coefficient of static friction``."""
    for factor in study.factors:
        low, high = (case_terms(code, study.case({factor.name: end}, 0)) for end in (factor.low, factor.high))
        changed = [a for a, b in zip(low, high, strict=True) if a[1].value != b[1].value]
        terms = [f"{term.name} of {subject} [{term.unit}]" for subject, term in changed]
        if terms:
            yield f"{factor.name} = {' and '.join(terms)}"


def _write_protocols(folder: Path, study: Study, cases: Sequence[Case[Any] | None]) -> None:
    """Write values, spheres and protocol of the first case for codes with dialogs, where they can have it."""
    case = next(case for case in cases if case)
    for code in CODES:
        try:
            test = ExportedTest(study.name, case, study.file.name)
            write_export(test, code, export_input(test, code, approximate=True), folder / code)
        except InputError:
            continue  # a test that is no lifted tube: the study describes it


def _waiting(path: Path, count: int) -> str:
    return f"Simulate the {count} runs of {path}, fill in its last columns, and resume."


def _require_unchanged(
    study: Study, table: pd.DataFrame, keys: Sequence[str], filled: Mapping[str, Row]
) -> None:
    """Refuse a setting that is not the one that was asked for."""
    for key, asked in zip(keys, table.to_dict("records"), strict=True):
        for factor in study.factors if key else ():
            head, wanted = _head(factor), float(asked[factor.name])
            text = filled[key][head]
            if not is_number(text) or not math.isclose(number(text), wanted, rel_tol=1e-6, abs_tol=1e-12):
                raise filled[key].error(f"must stay as the campaign wrote it, {wanted!r}", head)


def _require_filled(
    keys: Sequence[str], filled: Mapping[str, Row], responses: Sequence[Sequence[Response]]
) -> None:
    """Refuse a sheet of which some runs have no result; one without any result waits."""
    pairs = [(filled[key], of) for key, of in zip(keys, responses, strict=True) if key]
    empty = [row for row, of in pairs if not _is_filled(row, of)]
    if not empty:
        return
    path = empty[0].file
    if len(empty) == sum(row.file == path for row, _ in pairs):
        raise AwaitingRuns(_waiting(path, len(empty)))
    lines = ", ".join(f"{row['run']} repeat {row['repeat']} (line {row.line})" for row in empty[:LISTED])
    more = f" and {len(empty) - LISTED} more" if len(empty) > LISTED else ""
    raise InputError(str(path), f"has no result yet for run {lines}{more}")


def _is_filled(row: Row, responses: Sequence[Response]) -> bool:
    cells = [row[head] for head in _heads(responses)]
    shown = bool(row[PICTURE])
    needed = [r for r in responses if not (shown and r.observable == ANGLE)]
    return FAILED in cells or all(row[next(_heads([each]))] for each in needed)


def _result(row: Row, responses: Sequence[Response], fit: str) -> dict[str, Any]:
    """Read the results of a run."""
    result: dict[str, Any] = {"status": "finished", "reason": "", ANGLE: math.nan, "angle_se": math.nan}
    if FAILED in [row[head] for head in _heads(responses)]:
        return result | {"status": "failed", "reason": "the sheet says that it failed"}
    for response in responses:
        head = next(_heads([response]))
        if response.observable == ANGLE and not row[head]:
            result |= _pictured(row, fit)
            continue
        if not is_number(row[head]):
            raise row.error("must be a number", head)
        result[response.observable] = number(row[head])
    return result


def _pictured(row: Row, fit: str) -> dict[str, Any]:
    """Measure the picture, or the file of spheres, that a row names, by the study's fit."""
    [measured] = measure_pictures([row.file.parent / row[PICTURE]], PictureOptions(fit))
    if measured["mean"] is None:
        raise row.error(f"shows no angle: {measured['reason']}", PICTURE)
    return {ANGLE: measured["mean"], "angle_se": measured["se"]}
