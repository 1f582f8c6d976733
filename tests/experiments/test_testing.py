"""Conformance tests of engines and exporters: ours and those of a plugin pass, wrong ones fail."""

import sys
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dem_warp import Case, CaseResult, simulate
from experiments.cases.engines.contract import command_program
from experiments.cases.engines.program import ProgramEngine
from experiments.export import EXPORTERS, ExportedTest, Exporter, Term, Translation
from experiments.studyfile import load_study
from experiments.testing import ENGINE_CHECKS, EXPORTER_CHECKS, Engine, engine_keeps_failures_apart

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "plugin"))

simulate_cones = import_module("grain_magnets.cones").simulate
LEAFLET = import_module("grain_magnets.leaflet").LEAFLET

CONES = f"'{sys.executable}' '{HERE / 'cases' / 'engines' / 'cone_program.py'}'"

engine_checks = pytest.mark.parametrize("check", ENGINE_CHECKS, ids=lambda check: check.__name__)
exporter_checks = pytest.mark.parametrize("check", EXPORTER_CHECKS, ids=lambda check: check.__name__)
NAN = float("nan")
Check = Callable[[Any, Any], None]


@pytest.fixture
def case(write_study: Callable[..., Path]) -> Case[Any]:
    """Case of three grains."""
    return load_study(write_study(("grain_count = 30", "grain_count = 3"))).case({}, 1)


@pytest.fixture(scope="module")
def exported() -> ExportedTest:
    """Test of the paper's study."""
    study = load_study(scale="bench")
    return ExportedTest(study.name, study.case({}, 1), "study.toml")


def program(folder: Path, way: str = "") -> ProgramEngine:
    return ProgramEngine(command_program(f"{CONES} {way}", folder, "engine.command"))


@engine_checks
@pytest.mark.parametrize("name", ["own", "program", "plugin"])
def test_engines_keep_the_contract(name: str, check: Check, case: Case[Any], tmp_path: Path) -> None:
    engines: dict[str, Engine] = {
        "own": partial(simulate, device="cpu", workers=1),
        "program": program(tmp_path),
        "plugin": simulate_cones,
    }
    check(engines[name], case)


def test_a_case_that_a_program_fails_on_changes_no_other(case: Case[Any], tmp_path: Path) -> None:
    # the program fails on odd seeds
    engine = program(tmp_path, "crash-odd")
    engine_keeps_failures_apart(engine, replace(case, seed=2), replace(case, seed=1))


def altered(change: Callable[[list[CaseResult]], list[CaseResult]]) -> Engine:
    """Return the plugin's engine with its results changed."""

    def engine(cases: Any, on_result: Any = None, **_: Any) -> list[CaseResult]:
        results = change(simulate_cones(cases))
        for index, result in enumerate(results if on_result else ()):
            on_result(index, result)
        return results

    return engine


def moved(results: list[CaseResult]) -> list[CaseResult]:
    noise = np.random.default_rng().normal(size=3)
    return [replace(result, positions=result.positions + noise) for result in results]


@pytest.mark.parametrize(
    ("engine", "problem"),
    [
        (altered(lambda results: results[::-1]), "positions differ"),
        (altered(moved), "positions differ"),
        (altered(lambda results: results[1:]), "gave"),
        (altered(lambda results: [replace(each, status="fine") for each in results]), "status"),
        (altered(lambda results: [replace(each, status="failed") for each in results]), "reason"),
        (
            altered(lambda results: [replace(each, observables={"x": float("nan")}) for each in results]),
            "observable",
        ),
        (lambda cases, on_result=None, **_: simulate_cones(cases), "on_result"),
    ],
)
def test_an_engine_that_breaks_the_contract_is_found(engine: Engine, problem: str, case: Case[Any]) -> None:
    def run_all() -> None:
        for check in ENGINE_CHECKS:
            check(engine, case)

    with pytest.raises((AssertionError, ValueError), match=problem):
        run_all()


@exporter_checks
@pytest.mark.parametrize("exporter", [*EXPORTERS.values(), LEAFLET], ids=lambda each: each.code)
def test_exporters_keep_the_contract(exporter: Exporter, check: Check, exported: ExportedTest) -> None:
    check(exporter, exported)


def silent(test: ExportedTest) -> Translation:
    return replace(LEAFLET.translate(test), warnings=())


def empty(test: ExportedTest) -> Translation:
    return replace(LEAFLET.translate(test), translated=())


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        ({"contact_terms": lambda contact: (Term("mu", 0.5, "1", "mu", ""),)}, "a source"),
        ({"contact_terms": lambda contact: (Term("mu", float("nan"), "1", "mu", "here"),)}, "finite"),
        ({"translate": empty}, "each part"),
        ({"translate": silent}, "mechanism"),
    ],
)
def test_an_exporter_that_breaks_the_contract_is_found(
    change: dict[str, Any], problem: str, exported: ExportedTest
) -> None:
    def run_all() -> None:
        for check in EXPORTER_CHECKS:
            check(replace(LEAFLET, **change), exported)

    with pytest.raises(AssertionError, match=problem):
        run_all()
