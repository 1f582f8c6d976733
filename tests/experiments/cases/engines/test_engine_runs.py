"""Cases and searches on a program of one's own: kept, repeated where it fails, and refused."""

import math
import sys
from collections import Counter
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from commandline import dem_warp

from dem_warp import CaseResult, Progress
from experiments.cases import OwnWorkers, Store, engine_of, run_cases
from experiments.cases.engines.program import _gather, empty_result
from experiments.cases.store.outcome_table import OutcomeTable
from experiments.discover.engine_simulator import EngineSimulator
from experiments.discover.mechanism_files import library_for
from experiments.io.errors import InputError
from experiments.studyfile import Study, load_study
from experiments.studyfile.observables import PHOTOGRAPHED

CONES = Path(__file__).with_name("cone_program.py")
Write = Callable[..., Path]


def section(way: str = "", more: str = "") -> str:
    return f"\n[engine]\ncommand = \"'{sys.executable}' '{CONES}' {way}\"\n{more}\n"


def runs(path: Path) -> Counter[str]:
    return Counter((path / "runs.txt").read_text().split())


def test_results_are_checked_whoever_made_them(small_study: Study) -> None:
    cases, workers = [small_study.case({}, seed) for seed in (1, 2)], OwnWorkers("cpu", 1)
    heap = empty_result("finished", "", {})
    odd = replace(heap, observables={"grain_count": 3.0, "t55": math.nan}, provenance={"engine": "odd"})
    # neither of them calls on_result
    good, bad = workers.simulate(cases, lambda cases, **_: [heap, odd])
    assert good is heap
    assert (bad.status, bad.reason) == ("failed", "odd returned t55 = nan")
    assert bad.observables == {"grain_count": 3.0}
    scene = replace(odd, provenance={})
    bad = workers.simulate(cases, lambda cases, **_: [scene, heap])[0]
    # the module that has the scene, and its package
    assert bad.reason.startswith("dem_warp.scenes.lifted_cylinder returned t55")
    for wrong in (None, [heap], [heap, "heap"]):
        with pytest.raises(InputError, match="engine: must"):
            workers.simulate(cases, lambda cases, wrong=wrong, **_: wrong)


def test_cases_of_a_program_are_stored_and_its_failures_repeated(write_study: Write, tmp_path: Path) -> None:
    study, store = load_study(write_study(add=section("crash-odd"))), tmp_path / "cases"
    table = pd.DataFrame({"seed": [2, 1, 4], "E": [0.3, 0.4, 0.5]})
    for attempt in (1, 2):
        cases = run_cases(study, table, Store(store, engine_of(study)), OwnWorkers("cpu", 2))
        assert cases["status"].tolist() == ["finished", "no-answer", "finished"]
        assert "no license was found" in cases["reason"][1]
        # 15 degrees and 30 more for a friction of 1; a heap of these cones reads a degree off
        assert cases["angle"].dropna().tolist() == pytest.approx([24.0, 30.0], abs=1.5)
        assert runs(tmp_path / "cases") == {"2": 1, "4": 1, "1": attempt}
        assert len(list((store / "failed").iterdir())) == 1
    assert not (store / "unfinished").exists()


def test_a_search_asks_a_program_and_keeps_what_it_answers(write_study: Write, tmp_path: Path) -> None:
    study = load_study(write_study(add=section("crash-odd", 'observables = ["fill_height"]')))
    assert EngineSimulator(study, (), OutcomeTable(tmp_path / "t.sqlite")).observables == (
        *PHOTOGRAPHED,
        "fill_height",
    )
    study = load_study(write_study(add=section("crash-odd")))
    from doe.discrepancy import Point

    points = [Point((0.3,), (), "base", 2), Point((0.5,), (), "base", 4), Point((0.4,), (), "base", 1)]
    table = OutcomeTable(tmp_path / "out" / "outcomes.sqlite")
    with EngineSimulator(study, library_for(study), table, OwnWorkers("cpu", 2)) as simulator:
        outcomes = simulator(points)
        assert simulator.observables == PHOTOGRAPHED
    assert outcomes.reasons[:2] == ("", "")
    assert "no license was found" in outcomes.reasons[2]
    assert len(table) == 2, "a failure of the program is tried again"
    low, high, _ = outcomes.values[:, 0]  # noqa: PD011  (an array)
    assert high > low + 3.0, "more friction, a steeper cone"
    with EngineSimulator(study, library_for(study), table, OwnWorkers("cpu", 1)) as simulator:
        again = simulator(points)
    np.testing.assert_array_equal(again.values, outcomes.values)
    assert runs(tmp_path / "out") == {"2": 1, "4": 1, "1": 2}


def test_a_heap_that_cannot_be_drawn_has_a_reason(write_study: Write, tmp_path: Path) -> None:
    study, out = write_study(add=section("high")), tmp_path / "out"
    code, _, err = dem_warp("heap", study, "--out", out, "--device", "cpu")
    assert (code, "no heap" in err) == (1, True)
    assert f"'{CONES}' high" in err.splitlines()[0], "the program that a study starts is named first"
    assert (out / "heap.vtp").exists()
    assert not (out / "snapshot.png").exists()


def test_only_the_programs_that_run_are_counted_as_running() -> None:
    begun: dict[Future[CaseResult], int] = {Future(): index for index in range(8)}
    next(iter(begun)).set_running_or_notify_cancel()  # one worker
    seen: list[Progress] = []

    def watch(progress: Progress) -> None:
        seen.append(progress)
        raise InterruptedError

    with pytest.raises(InterruptedError):
        _gather(begun, None, watch)
    assert (seen[0].done, seen[0].total, seen[0].phase_counts) == (0, 8, {"run": 1})
