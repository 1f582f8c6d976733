"""Runs that a person does in another program: sheets of cases to fill in, and the numbers of filled ones."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from dem_warp import Case
from doe import Factor
from doe.discrepancy import Point
from experiments.cases import Store
from experiments.cases.execute import build_cases
from experiments.cases.store.outcome_table import Outcome
from experiments.export import EXPORTERS, ExportedTest, case_terms, export_input, write_export
from experiments.io.errors import InputError
from experiments.io.excel_files import ENDING, write_cells
from experiments.io.files import write_text
from experiments.io.rows import Row, read_rows
from experiments.io.texts import is_number, number, safe_cell
from experiments.measurement.heap_files import HeapSettings, is_heap_file, measure_heap_file
from experiments.measurement.photographs import PictureOptions, angle_of, measure_pictures
from experiments.measurement.value_limits import limits_of_test
from experiments.runs.request import AwaitingRuns
from experiments.studyfile import Study
from experiments.studyfile.campaign import TARGET_SCENE, Response
from experiments.studyfile.mechanism_factor import MechanismFactor
from experiments.studyfile.observables import ANGLE, View, observables_of
from imaging import PictureError

SHEETS, CASE, PICTURE, FAILED = "by-hand", "case", "picture", "failed"
"""Folder of the sheets; columns of a case's key and of its picture; word for a run that failed."""
PLACES = ("stage", "test", "run", "repeat", "seed")
KEY = 12
"""Characters of a case's key."""
CODES = ("edem", "rocky")
"""Codes whose names of the values a sheet has."""
DIGITS = "%.10g"
"""Form of a setting."""
LISTED = 6
"""Runs without result that a message lists."""
SAID = "the sheet says that it failed"
"""Reason of a run that failed."""


@dataclass(frozen=True)
class Result:
    """A number that a person types in."""

    observable: str
    unit: str
    pictured: bool
    """A picture or the spheres of the heap can stand in its place."""
    limits: tuple[float, float]
    """Smallest and largest value that is possible in the test."""

    @property
    def head(self) -> str:
        """Its column."""
        return f"{self.observable} [{self.unit}]"


@dataclass(frozen=True)
class AskedRun:
    """A run that a person is asked for."""

    key: str
    places: Mapping[str, Any]
    """Its stage, test and number by column."""
    settings: Mapping[str, float]
    """Values by column, which must stay."""
    results: tuple[Result, ...]


def typed_cases(
    study: Study, table: pd.DataFrame, folder: Path, title: str, store: Store, asked_for: Sequence[Response]
) -> pd.DataFrame:
    """Return a table of cases with the results that a person typed in; `run_cases` with a person as solver.

    The sheets ask for some responses, or for those of the study.

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
    wanted = [(each.scene, _result_of(study, each)) for each in asked_for or study.target.responses]
    rows = zip(keys, table.to_dict("records"), strict=True)
    asked = [_asked(study, key, row, wanted) for key, row in rows if key]
    every = tuple(result for _, result in wanted)
    first = next((case for case in cases if case), None)
    filled = _Sheets(study, folder, title, every).take(asked, first)
    known = {each.key: _result(filled[each.key], each.results, study.measurement.fit) for each in asked}
    lost = {"status": "refused", ANGLE: math.nan, "angle_se": math.nan}
    results = [
        known[key] if key else lost | {"reason": reason} for key, reason in zip(keys, refused, strict=True)
    ]
    return pd.concat([table, pd.DataFrame(results, index=table.index).assign(case_key=keys)], axis=1)


def typed_points(
    study: Study,
    library: Sequence[MechanismFactor],
    observables: Sequence[str],
    folder: Path,
    title: str,
    points: Mapping[str, Point],
) -> dict[str, Outcome]:
    """Return the observables of a search's points, by the keys of their cases, that a person typed in.

    Mechanisms of the library that a point lacks are at their null. Raise as `typed_cases` does.
    """
    size, free = limits_of_test(study), (-math.inf, math.inf)  # a condition may change the lengths
    results = tuple(
        Result(each.name, each.unit, each.by_photograph, free if each.unit == "m" else size.limits(each))
        for each in study.measurable
        if each.name in observables
    )
    heads = {each.name: f"{each.name} [{each.unit}]" for each in library}
    nulls = {heads[each.name]: each.null for each in library}
    asked = []
    for run, (key, point) in enumerate(points.items(), start=1):
        places = dict(zip(PLACES, (title, point.condition, run, 1, point.seed), strict=True))
        settings = dict(zip(map(_head, study.factors), point.theta, strict=True))
        settings |= nulls | {heads[name]: size for name, size in point.sizes}
        asked.append(AskedRun(key[:KEY], places, settings, results))
    words = [f"{each.name}: {each.title}. {each.sentence}" for each in library]
    words += [f"test {each.name}: {json.dumps(each.changes)}" for each in study.conditions if each.changes]
    filled = _Sheets(study, folder, title, results, tuple(words)).take(asked, study.case({}, 0))
    return {key: _outcome(filled[key[:KEY]], results, study) for key in points}


@dataclass(frozen=True)
class _Sheets:
    """Sheets of a run's folder."""

    study: Study
    folder: Path
    title: str
    """Batch that is asked for, which names a new sheet."""
    results: tuple[Result, ...]
    """Results that any of the sheets may have."""
    words: tuple[str, ...] = ()
    """Further comments of a new sheet."""

    def take(self, asked: Sequence[AskedRun], case: Case[Any] | None) -> dict[str, Row]:
        """Return the filled rows of runs by their keys; write a sheet of those that no sheet has, and wait.

        With a new sheet come the values, the spheres and the protocol of a case.
        """
        if not asked:  # the study refused all of them
            return {}
        columns = [CASE, *PLACES, *asked[0].settings, *_heads(self.results)]
        sheets = sorted(p for p in (self.folder / SHEETS).glob("*.*") if p.suffix in (".csv", ENDING))
        filled: dict[str, Row] = {}
        for row in (row for path in sheets for row in read_rows(path, [CASE], columns)):
            if row[CASE] in filled:
                raise row.error(f"must be one row, but is in {filled[row[CASE]].place(CASE)} too", CASE)
            filled[row[CASE]] = row
        fresh = [run for run in asked if run.key not in filled]
        if fresh and case:
            name = re.sub("[^a-z]+", "-", self.title.lower())
            ending = self.study.engine.sheet if self.study.engine else "csv"
            path = self.folder / SHEETS / f"{len(sheets) + 1:02d}-{name}.{ending}"
            codes = (f"{EXPORTERS[code].code}: {line}" for code in CODES for line in _names(self.study, code))
            _write_sheet(path, fresh, [*codes, *self.words])
            _write_protocols(path.parent, self.study, case)
            raise AwaitingRuns(_waiting(path, len(fresh)))
        for run in asked:
            _require_unchanged(run, filled[run.key])
        _require_filled(asked, filled)
        return filled


def _asked(study: Study, key: str, row: Mapping[str, Any], wanted: Sequence[tuple[str, Result]]) -> AskedRun:
    """Ask for a case of a campaign, or of a bridge: the results of its test."""
    scene = row.get("scene", TARGET_SCENE)
    places = (row["stage"], scene, row["run"], row.get("replicate", 1), row["seed"])
    settings = {_head(factor): float(row[factor.name]) for factor in study.factors}
    results = tuple(result for place, result in wanted if place == scene)
    return AskedRun(key, dict(zip(PLACES, places, strict=True)), settings, results)


def _result_of(study: Study, response: Response) -> Result:
    if response.weights or response.part_of:
        problem = "is a profile, which nobody can type in"
        raise InputError(f"response {response.name}", problem, hint="Give it as numbers of the heap.")
    name, scene = response.observable, study.scenes[response.scene]
    limits = limits_of_test(study, response.scene)
    known = observables_of(scene.observables, scene.leaves_a_heap)[name]
    return Result(name, response.unit, name == ANGLE, limits.limits(known))


def _heads(results: Sequence[Result]) -> Iterator[str]:
    """Name the columns of results, and one of pictures where they can show a result."""
    yield from (result.head for result in results)
    if any(result.pictured for result in results):
        yield PICTURE


def _head(factor: Factor) -> str:
    return f"{factor.name} [{factor.unit or '1'}]"


def _write_sheet(path: Path, runs: Sequence[AskedRun], words: Sequence[str]) -> None:
    """Write a sheet: comments, then a row for each run."""
    rows = [
        {CASE: run.key, **run.places, **run.settings, **dict.fromkeys(_heads(run.results), "")}
        for run in runs
    ]
    first = f"Fill in the last columns; write {FAILED} for a run that failed. Change nothing else."
    comments = [f"# {word.replace(',', ';')}" for word in (first, *words)]
    path.parent.mkdir(parents=True, exist_ok=True)
    frame = pd.DataFrame(rows).map(safe_cell)
    if path.suffix == ENDING:
        write_cells(path, comments, [list(frame), *frame.to_numpy().tolist()])
        return
    table = frame.to_csv(index=False, float_format=DIGITS, lineterminator="\n")
    write_text(path, "\n".join([*comments, table]))


def _names(study: Study, code: str) -> Iterator[str]:
    """Name the values that a factor changes in a code, e.g. ``F = coefficient of static friction``."""
    for factor in study.factors:
        low, high = (case_terms(code, study.case({factor.name: end}, 0)) for end in (factor.low, factor.high))
        changed = [a for a, b in zip(low, high, strict=True) if a[1].value != b[1].value]
        terms = [f"{term.name} of {subject} [{term.unit}]" for subject, term in changed]
        if terms:
            yield f"{factor.name} = {' and '.join(terms)}"


def _write_protocols(folder: Path, study: Study, case: Case[Any]) -> None:
    """Write values, spheres and protocol of a case for codes with dialogs, where they can have it."""
    for code in CODES:
        try:
            test = ExportedTest(study.name, case, study.file.name)
            write_export(test, code, export_input(test, code, approximate=True), folder / code)
        except InputError:
            continue  # a test that is no lifted tube: the study describes it


def _waiting(path: Path, count: int) -> str:
    return f"Simulate the {count} runs of {path}, fill in its last columns, and resume."


def _require_unchanged(run: AskedRun, row: Row) -> None:
    """Refuse a setting that is not the one that was asked for."""
    for head, wanted in run.settings.items():
        text = row[head]
        if not is_number(text) or not math.isclose(number(text), wanted, rel_tol=1e-6, abs_tol=1e-12):
            raise row.error(f"must stay as the campaign wrote it, {DIGITS % wanted}", head)


def _require_filled(asked: Sequence[AskedRun], filled: Mapping[str, Row]) -> None:
    """Refuse a sheet of which some runs have no result; one without any result waits."""
    lacking = {run.key: heads for run in asked if (heads := _lacking(filled[run.key], run.results))}
    if not lacking:
        return
    empty = [filled[key] for key in lacking]
    path = empty[0].file
    here = [run for run in asked if filled[run.key].file == path]
    if not any(filled[run.key][head] for run in here for head in _heads(run.results)):
        raise AwaitingRuns(_waiting(path, len(empty)))
    lines = ", ".join(
        f"{row['stage']} run {row['run']} repeat {row['repeat']} (line {row.line})" for row in empty[:LISTED]
    )
    more = f" and {len(empty) - LISTED} more" if len(empty) > LISTED else ""
    columns = ", ".join(dict.fromkeys(head for heads in lacking.values() for head in heads))
    raise InputError(str(path), f"has no {columns} yet for {lines}{more}")


def _failed(row: Row, results: Sequence[Result]) -> bool:
    return FAILED in [row[head].lower() for head in _heads(results)]


def _lacking(row: Row, results: Sequence[Result]) -> list[str]:
    """Name the columns of a run that lack a result; a picture stands for what it can show."""
    if _failed(row, results):
        return []
    return [each.head for each in results if not (row[each.head] or (row[PICTURE] and each.pictured))]


def _value(row: Row, result: Result) -> float:
    text, (low, high) = row[result.head], result.limits
    if not is_number(text) or not math.isfinite(number(text)):
        raise row.error("must be a number", result.head)
    if not low <= number(text) <= high:
        raise row.error(f"must be between {low:.3g} and {high:.3g} in this test", result.head)
    return number(text)


def _result(row: Row, results: Sequence[Result], fit: str) -> dict[str, Any]:
    """Read the results of a campaign's run."""
    result: dict[str, Any] = {"status": "finished", "reason": "", ANGLE: math.nan, "angle_se": math.nan}
    if _failed(row, results):
        return result | {"status": "failed", "reason": SAID}
    for each in results:
        if each.pictured and not row[each.head]:
            result |= _pictured(row, fit)
        else:
            result[each.observable] = _value(row, each)
    return result


def _outcome(row: Row, results: Sequence[Result], study: Study) -> Outcome:
    """Read the observables of a search's run; what is not typed in is measured on its picture."""
    if _failed(row, results):
        return np.full(len(results), math.nan), SAID
    shown = _shown(row, study) if row[PICTURE] else {}
    typed = {
        each.observable: _value(row, each)
        for each in results
        if row[each.head] or each.observable not in shown
    }
    return np.array([(shown | typed)[each.observable] for each in results]), ""


def _pictured(row: Row, fit: str) -> dict[str, Any]:
    """Measure the picture, or the file of spheres, that a row names, by the study's fit."""
    [measured] = measure_pictures([row.file.parent / row[PICTURE]], PictureOptions(fit))
    if measured["mean"] is None:
        raise row.error(f"shows no angle: {measured['reason']}", PICTURE)
    return {ANGLE: measured["mean"], "angle_se": measured["se"]}


def _shown(row: Row, study: Study) -> dict[str, float]:
    """Measure what a row's spheres show of the heap, or its picture, which shows no lengths."""
    path, fit = row.file.parent / row[PICTURE], study.measurement.fit
    shown = [each for each in study.measurable if each.by_photograph]
    try:
        if is_heap_file(path):
            heap = measure_heap_file(path, fit, HeapSettings()).angle
            views = [View.of(view) for view in heap.views]
            return {each.name: each.in_heap(heap, views) for each in shown}
        views = [View.of(angle_of(path, PictureOptions(fit)))]
    except PictureError as error:
        raise row.error(f"shows no angle: {error}", PICTURE) from None
    return {each.name: each.in_pictures(views) for each in shown if each.unit != "m"}
