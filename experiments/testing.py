"""Conformance tests for engines and exporters of a package's own, to run in its tests.

Each check takes the engine or the exporter and an example, and raises an AssertionError that says what is
wrong::

    @pytest.mark.parametrize("check", ENGINE_CHECKS)
    def test_my_engine(check):
        check(my_engine, my_case)
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from dem_warp import PRESETS, Case, CaseResult
from dem_warp.laws.micro_slip import MicroSlip
from experiments.export import ExportedTest, Exporter, Translation, contacts_of

Engine = Callable[..., list[CaseResult]]

STATUSES = ("finished", "failed", "diverged", "overflow", "no-answer")
"""Endings of a case."""

POSES = ("positions", "orientations", "sizes", "shapes", "clumps")
"""Arrays of a result."""


def require(condition: object, problem: str) -> None:
    """Raise an AssertionError with the problem where the condition does not hold."""
    if not condition:
        raise AssertionError(problem)


class _StopError(Exception):
    """The caller of an engine stops it."""


def _seeded(case: Case[Any]) -> list[Case[Any]]:
    return [replace(case, seed=seed) for seed in (1, 2, 3)]


def _require_same(one: CaseResult, other: CaseResult, what: str) -> None:
    require(one.status == other.status, f"{what}: the status differs")
    for name in POSES:
        same = np.array_equal(getattr(one, name), getattr(other, name))
        require(same, f"{what}: {name} differ")
    require(one.observables == other.observables, f"{what}: the observables differ")


def engine_answers_each_case_in_order(engine: Engine, case: Case[Any]) -> None:
    """Check that every result comes once, in the order of the cases, whatever else is simulated with it."""
    cases = _seeded(case)
    handed: dict[int, CaseResult] = {}
    results = engine(cases, on_result=lambda index, result: handed.setdefault(index, result))
    require(len(results) == len(cases), f"{len(cases)} cases gave {len(results)} results")
    require(sorted(handed) == [0, 1, 2], f"on_result got the indices {sorted(handed)}, not 0, 1 and 2")
    for index, result in enumerate(results):
        _require_same(handed[index], result, f"case {index}, as handed to on_result")
        [alone] = engine(cases[index : index + 1])
        _require_same(alone, result, f"case {index}, alone and with others")


def engine_gives_whole_results(engine: Engine, case: Case[Any]) -> None:
    """Check the status, the reason, the poses and the observables of a result."""
    [result] = engine([case])
    require(result.status in STATUSES, f"the status {result.status!r} must be one of {', '.join(STATUSES)}")
    finished = result.status == "finished"
    require(
        finished == (not result.reason),
        "a case must have a reason where it has not finished, and only there",
    )
    count = len(result.positions)
    shapes = {"positions": (count, 3), "orientations": (count, 4), "sizes": (count,), "shapes": (count,)}
    for name, shape in shapes.items():
        found = getattr(result, name)
        require(found.shape == shape, f"{name} must have the shape {shape}, got {found.shape}")
        require(np.isfinite(found).all(), f"{name} must be finite")
    known = getattr(engine, "observables", result.observables)
    for name, value in result.observables.items():
        require(math.isfinite(value), f"the observable {name} must be finite: leave it out instead")
        require(name in known or not known, f"the observable {name} must be one that the engine names")


def engine_resumes(engine: Engine, case: Case[Any]) -> None:
    """Check that a run that is stopped after its first result gives the same when it is begun again."""
    cases = _seeded(case)
    whole = engine(cases)

    def stop(index: int, result: CaseResult) -> None:
        raise _StopError

    with TemporaryDirectory() as folder:
        checkpoint = Path(folder) / "unfinished"
        try:
            engine(cases, on_result=stop, checkpoint=checkpoint)
        except _StopError:
            pass
        else:
            raise AssertionError("an error of on_result must end the run")
        for index, result in enumerate(engine(cases, checkpoint=checkpoint)):
            _require_same(whole[index], result, f"case {index}, resumed")


def engine_has_an_identity(engine: Engine, case: Case[Any]) -> None:
    """Check that the identity, by which results are stored, is data for JSON and stays the same."""
    identity = getattr(engine, "identity", {})
    text = json.dumps(identity, sort_keys=True)
    require(
        text == json.dumps(getattr(engine, "identity", {}), sort_keys=True), "the identity must not change"
    )


def engine_keeps_failures_apart(engine: Engine, case: Case[Any], failing: Case[Any]) -> None:
    """Check that a case that cannot be simulated is refused or has a reason, and changes no other case."""
    check = getattr(engine, "check", None)
    if check is not None:
        try:
            check(failing)
        except ValueError:
            return
    failed, other = engine([failing, case])
    require(failed.status in STATUSES[1:], f"a failure must have a status of its own, got {failed.status!r}")
    require(failed.reason, "a failure must have a reason")
    [alone] = engine([case])
    _require_same(alone, other, "a case with one that failed")


ENGINE_CHECKS: Sequence[Callable[[Engine, Case[Any]], None]] = (
    engine_answers_each_case_in_order,
    engine_gives_whole_results,
    engine_resumes,
    engine_has_an_identity,
)
"""Checks of an engine with a case that it can simulate; for one that it cannot there is
`engine_keeps_failures_apart`."""


def exporter_explains_its_terms(exporter: Exporter, test: ExportedTest) -> None:
    """Check that every term has a name of its own, a value, a unit, a formula and a source."""
    case = test.case
    mass = case.grain_material.density * case.grains.mean(lambda shape: shape.volume)
    radius = float(max(shape.radii.max() for shape in case.grains.mixture.shapes))
    for contact in contacts_of(case, radius, mass):
        terms = (*exporter.material_terms(contact.first), *exporter.contact_terms(contact))
        names = [term.name for term in terms]
        require(terms, "there must be a term")
        require(len(set(names)) == len(names), f"the names of terms must differ, got {', '.join(names)}")
        for term in terms:
            require(math.isfinite(term.value), f"{term.name}: must be finite, got {term.value}")
            complete = term.name and term.unit and term.formula and term.source
            require(complete, f"{term.name}: must have a name, a unit, a formula and a source")


def _translated(exporter: Exporter, test: ExportedTest) -> Translation | None:
    return None if exporter.translate is None else exporter.translate(test)


def exporter_explains_its_input(exporter: Exporter, test: ExportedTest) -> None:
    """Check that an input has files, a row for each part that was translated, and is always the same."""
    found = _translated(exporter, test)
    if found is None:
        return
    require(all(found.files.values()), "every file must have a text")
    require(found.translated, "the translation must say what became of each part of the test")
    for row in found.translated:
        complete = row.subject and (row.here or row.there)
        require(complete, f"{row.subject}: a row must have a subject, and its form here or there")
    require(_translated(exporter, test) == found, "the same test must give the same input")


def exporter_warns_of_laws(exporter: Exporter, test: ExportedTest) -> None:
    """Check that an input warns of every contact law that the code lacks, or refuses it."""
    for laws in PRESETS.values():
        try:
            found = _translated(exporter, replace(test, case=replace(test.case, laws=laws)))
        except ValueError:
            continue
        lacking = exporter.conventions.warnings(laws) if exporter.conventions and found else ()
        for warning in lacking:
            require(found and warning in found.warnings, f"the input must warn: {warning}")


def exporter_warns_of_mechanisms(exporter: Exporter, test: ExportedTest) -> None:
    """Check that an input names a mechanism of the contacts that the code lacks, or refuses it."""
    lacking = MicroSlip(micro_slip=1.0)
    try:
        found = _translated(exporter, replace(test, case=replace(test.case, mechanisms=(lacking,))))
    except ValueError as error:
        require(lacking.name in str(error), f"the error must name the mechanism {lacking.name}, got {error}")
        return
    named = found is None or any(lacking.name in warning for warning in found.warnings)
    require(named, f"the input must warn that it lacks the mechanism {lacking.name}")


EXPORTER_CHECKS: Sequence[Callable[[Exporter, ExportedTest], None]] = (
    exporter_explains_its_terms,
    exporter_explains_its_input,
    exporter_warns_of_laws,
    exporter_warns_of_mechanisms,
)
"""Checks of an exporter with a test that the code can have."""
