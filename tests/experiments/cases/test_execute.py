"""Tables of cases: what is simulated, what is kept, and how failures come back."""

import logging
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from threadpoolctl import threadpool_info

from dem_warp import Case, CaseResult, Progress, simulation
from experiments.cases import OwnWorkers, Store, run_cases
from experiments.cases.measuring import MeasuringThreads
from experiments.cases.workers import own
from experiments.studyfile import Study

Cone = Callable[..., CaseResult]

ANGLE_TOLERANCE = 1.0
"""A cone of 20 mm that is laid out on a 0.5 mm grid, standing on spheres of 0.5 mm [degrees]."""


class Engine:
    """Stands in for the simulator: a case with friction mu ends in a cone of slope mu, or as scripted."""

    def __init__(self, cone: Cone) -> None:
        self.cone = cone
        self.batches: list[list[Case]] = []
        self.endings: dict[int, tuple[str, str]] = {}
        self.interrupt_after: int | None = None
        self.checkpoints: list[Path] = []

    def __call__(
        self,
        cases: Sequence[Case],
        *,
        on_result: Callable[[int, CaseResult], None],
        checkpoint: Path,
        **_: Any,
    ) -> list[CaseResult]:
        self.batches.append(list(cases))
        self.checkpoints.append(checkpoint)
        results = []
        # The last case ends first: results do not come in order.
        for index in reversed(range(len(cases))):
            if self.interrupt_after is not None and len(results) >= self.interrupt_after:
                raise KeyboardInterrupt
            status, reason = self.endings.get(cases[index].seed, ("finished", ""))
            result = self.cone(cases[index].grain_grain.static_friction, status, reason)
            results.append(result)
            on_result(index, result)
        return results[::-1]


@pytest.fixture
def engine(cone: Cone, monkeypatch: pytest.MonkeyPatch) -> Engine:
    engine = Engine(cone)
    monkeypatch.setattr(own, "simulate", engine)
    return engine


def table_of(frictions: Sequence[float]) -> pd.DataFrame:
    runs = range(1, len(frictions) + 1)
    return pd.DataFrame({"stage": "climb", "run": runs, "E": frictions, "seed": [10 * run for run in runs]})


def test_all_rows_run_at_once_and_keep_their_order_and_labels(
    small_study: Study, engine: Engine, tmp_path: Path
) -> None:
    table = table_of([0.3, 0.5, 0.4])
    table.index = pd.Index([7, 3, 5])
    results = run_cases(small_study, table, Store(tmp_path))
    assert [len(batch) for batch in engine.batches] == [3]
    pd.testing.assert_frame_equal(results[list(table.columns)], table)
    expected = np.degrees(np.arctan(table["E"]))
    assert np.abs(results["angle"] - expected).max() < ANGLE_TOLERANCE
    assert (results["status"] == "finished").all()
    assert (results["time_to_rest"] == 0.5).all()
    assert results["case_key"].is_unique


def test_nothing_is_simulated_twice(small_study: Study, engine: Engine, tmp_path: Path) -> None:
    first = run_cases(small_study, table_of([0.3, 0.5]), Store(tmp_path))
    longer = run_cases(small_study, table_of([0.3, 0.5, 0.4]), Store(tmp_path))
    assert [len(batch) for batch in engine.batches] == [2, 1]
    pd.testing.assert_frame_equal(longer.iloc[:2], first)
    run_cases(small_study, table_of([0.3, 0.5, 0.4]), Store(tmp_path))
    assert len(engine.batches) == 2


def test_two_equal_rows_are_one_case(small_study: Study, engine: Engine, tmp_path: Path) -> None:
    table = pd.DataFrame({"E": [0.3, 0.3], "seed": [1, 1]})
    results = run_cases(small_study, table, Store(tmp_path))
    assert [len(batch) for batch in engine.batches] == [1]
    assert results["angle"].iloc[0] == results["angle"].iloc[1]


def test_checkpoints_outlive_an_interruption_and_no_more(
    small_study: Study, engine: Engine, tmp_path: Path
) -> None:
    store = Store(tmp_path / "cases")
    left = store.unfinished / "half.npz"
    left.parent.mkdir(parents=True)
    left.write_bytes(b"half a case")
    engine.interrupt_after = 1
    with pytest.raises(KeyboardInterrupt):
        run_cases(small_study, table_of([0.3, 0.5]), store)
    assert engine.checkpoints == [store.unfinished]
    assert left.exists()
    engine.interrupt_after = None
    run_cases(small_study, table_of([0.3, 0.5]), store)
    assert [[case.seed for case in batch] for batch in engine.batches] == [[10, 20], [10]]
    assert not store.unfinished.exists()
    assert len(list(store.folder.iterdir())) == 2


def test_an_interrupted_case_goes_on_in_the_middle(
    small_study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(own, "CHECKPOINT_EVERY", 0.0)
    monkeypatch.setattr(simulation, "REPORT_EVERY", 0.0)

    def run(folder: str, progress: Callable[[Progress], None] | None = None) -> pd.DataFrame:
        return run_cases(
            small_study, table_of([0.3]), Store(tmp_path / folder), OwnWorkers("cpu", 1), progress
        )

    def interrupt(progress: Progress) -> None:
        if progress.fraction > 0.5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run("cut", interrupt)
    fractions: list[float] = []
    resumed = run("cut", lambda progress: fractions.append(progress.fraction))
    assert fractions[0] > 0.5
    whole = run("whole")
    assert whole["status"].iloc[0] == "finished"
    pd.testing.assert_frame_equal(resumed, whole, check_exact=True)


def test_a_failed_case_is_a_row_and_not_run_again(small_study: Study, engine: Engine, tmp_path: Path) -> None:
    engine.endings = {20: ("diverged", "too fast"), 30: ("failed", "not at rest")}
    results = run_cases(small_study, table_of([0.3, 0.4, 0.5]), Store(tmp_path))
    assert list(results["status"]) == ["finished", "diverged", "failed"]
    assert list(results["reason"]) == ["", "too fast", "not at rest"]
    assert list(results["angle"].isna()) == [False, True, True]
    engine.endings = {}
    again = run_cases(small_study, table_of([0.3, 0.4, 0.5]), Store(tmp_path))
    assert len(engine.batches) == 1
    pd.testing.assert_frame_equal(again, results)


def test_settings_that_are_not_physical_are_a_row(small_study: Study, engine: Engine, tmp_path: Path) -> None:
    results = run_cases(small_study, table_of([0.3, -0.1]), Store(tmp_path))
    assert list(results["status"]) == ["finished", "refused"]
    assert "greater than or equal to 0" in results["reason"].iloc[1]
    assert [len(batch) for batch in engine.batches] == [1]


def test_a_plate_without_grains_has_no_angle_and_says_why(
    small_study: Study, engine: Engine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    heap = engine.cone()
    none = {name: getattr(heap, name)[:0] for name in ("positions", "orientations", "sizes", "shapes")}
    empty = replace(heap, **none)
    monkeypatch.setattr(engine, "cone", lambda *_: empty)
    [row] = run_cases(small_study, table_of([0.3]), Store(tmp_path)).to_dict("records")
    assert (row["status"], np.isnan(row["angle"])) == ("finished", True)
    assert row["reason"].startswith("no heap: ")


def test_a_damaged_case_is_named_and_simulated_again(
    small_study: Study, engine: Engine, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    store = Store(tmp_path)
    before = run_cases(small_study, table_of([0.3, 0.5]), store)
    damaged = store.path(before["case_key"].iloc[1])
    damaged.write_bytes(damaged.read_bytes()[:-100])
    with caplog.at_level(logging.WARNING):
        after = run_cases(small_study, table_of([0.3, 0.5]), store)
    assert str(damaged) in caplog.text
    assert [case.seed for case in engine.batches[1]] == [20]
    pd.testing.assert_frame_equal(before, after)


def test_a_table_must_have_seeds_and_room_for_results(small_study: Study, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="'seed'"):
        run_cases(small_study, pd.DataFrame({"E": [0.3]}), Store(tmp_path))
    with pytest.raises(ValueError, match="angle"):
        run_cases(small_study, table_of([0.3]).assign(angle=1.0), Store(tmp_path))


def test_blas_has_one_thread_only_while_heaps_are_measured() -> None:
    def threads() -> list[int]:
        return [pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"]

    before = threads()
    with MeasuringThreads(2) as pool:
        assert set(pool.submit(threads).result()) == {1}
    assert threads() == before
