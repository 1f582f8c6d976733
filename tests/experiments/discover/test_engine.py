"""The engine as a simulator: its answers, what it keeps, and points that it refuses."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from dem_warp import Case, CaseResult, Progress, simulate
from doe.discrepancy import Point
from experiments.cases import OwnWorkers, execute
from experiments.cases.measuring import measuring_processes
from experiments.cases.store.outcome_table import OutcomeTable
from experiments.cases.workers import own
from experiments.discover.engine_simulator import EngineSimulator
from experiments.discover.mechanism_files import library_for
from experiments.measurement.case_observables import measure
from experiments.studyfile import Study, load_study
from experiments.studyfile.observables import NAMES

CONDITIONS = """
[condition.base]

[condition.wide]
scene.lifted-cylinder.diameter = "32 mm"
"""

POINTS = [
    Point((0.3,), (), "base", 1),
    Point((0.5,), (), "wide", 2),
    Point((0.3,), (("rolling_torque", 0.1),), "base", 1),
]


class Scripted:
    """Stands in for the simulator: cases end, or the machine fails, as scripted."""

    def __init__(self, endings: Sequence[CaseResult | Exception]) -> None:
        self.endings = endings

    def __call__(
        self, cases: Sequence[Case], on_result: Callable[[int, CaseResult], None], **_: object
    ) -> None:
        assert self.endings, "nothing may be simulated again"
        assert len(cases) >= len(self.endings)
        for index, ending in enumerate(self.endings):
            if isinstance(ending, Exception):
                raise ending
            on_result(index, ending)


class KilledError(Exception):
    """Stands for what ends a run in the middle."""


@pytest.fixture
def study(write_study: Callable[..., Path]) -> Study:
    return load_study(write_study(add=CONDITIONS))


@pytest.fixture
def table(tmp_path: Path) -> OutcomeTable:
    return OutcomeTable(tmp_path / "cases" / "outcomes.sqlite")


def build(study: Study, table: OutcomeTable) -> EngineSimulator:
    return EngineSimulator(study, library_for(study), table, OwnWorkers("cpu", 1))


def test_points_are_answered_by_heaps_measured_and_kept(
    study: Study, table: OutcomeTable, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(execute, "measuring_processes", measuring_processes)
    seen: list[Progress] = []
    with build(study, table) as simulator:
        outcomes = simulator([*POINTS, POINTS[0]], seen.append)
        assert (seen[-1].done, seen[-1].total, seen[-1].fraction) == (3, 3, 1.0)

        [direct] = simulate([study.under("wide").case({"E": 0.5}, 2)], device="cpu", workers=1)
        assert outcomes.reasons == ("",) * 4
        np.testing.assert_array_equal(outcomes.values[1], measure(study.measurement, direct)[0])
        np.testing.assert_array_equal(outcomes.values[0], outcomes.values[3])
        assert (outcomes.values[0] != outcomes.values[2]).any()

    monkeypatch.setattr(own, "simulate", Scripted([]))
    again = build(study, table)(POINTS)
    np.testing.assert_array_equal(again.values, outcomes.values[:3])


def test_a_run_that_was_killed_keeps_what_it_had_measured(
    study: Study, table: OutcomeTable, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(execute, "SAVE_EVERY", 0.0)

    def kill(progress: Progress) -> None:
        if progress.done == 2:
            raise KilledError

    with pytest.raises(KilledError):
        build(study, table)(POINTS, kill)
    kept = len(table)
    seen: list[Progress] = []
    with build(study, table) as simulator:
        assert simulator(POINTS, seen.append).finished.all()
    assert kept >= 1
    assert seen[-1].total == len(POINTS) - kept


def test_cases_that_fail_are_kept_with_their_reasons_and_not_simulated_again(
    study: Study, table: OutcomeTable, monkeypatch: pytest.MonkeyPatch, cone: Callable[..., CaseResult]
) -> None:
    reasons = ("the tube is clogged", "a grain was too fast", "a neighbour list overflowed")
    statuses = ("failed", "diverged", "overflow")
    endings = [cone(status=status, reason=why) for status, why in zip(statuses, reasons, strict=True)]
    monkeypatch.setattr(own, "simulate", Scripted(endings))
    with build(study, table) as simulator:
        found = simulator(POINTS).reasons
    # The costly case, of the wide tube, is simulated first.
    assert found == (reasons[1], reasons[0], reasons[2])
    monkeypatch.setattr(own, "simulate", Scripted([]))
    again = build(study, table)(POINTS)
    assert again.reasons == found
    assert np.isnan(again.values).all()


def test_a_case_that_the_machine_ended_is_no_outcome(
    study: Study, table: OutcomeTable, monkeypatch: pytest.MonkeyPatch, cone: Callable[..., CaseResult]
) -> None:
    clogged = cone(status="failed", reason="the tube is clogged")
    sizes: list[int] = []

    def full(cases: Sequence[Case], on_result: Callable[[int, CaseResult], None], **_: object) -> None:
        sizes.append(len(cases))
        if len(cases) == len(POINTS):
            on_result(0, clogged)
        raise MemoryError

    monkeypatch.setattr(own, "simulate", full)
    with pytest.raises(MemoryError):
        build(study, table)(POINTS)
    assert sizes == [3, 1], "what is left is halved, and a case alone is too much for the machine"
    # The first may have been measured by then, or not.
    kept = len(table)
    assert kept <= 1
    monkeypatch.setattr(own, "simulate", Scripted([clogged] * (len(POINTS) - kept)))
    with build(study, table) as simulator:
        assert simulator(POINTS).reasons == (clogged.reason,) * len(POINTS)
    assert len(table) == len(POINTS)


def test_what_the_study_refuses_is_an_outcome_with_its_reason(study: Study, table: OutcomeTable) -> None:
    both = (("rolling_spring", 0.1), ("rolling_torque", 0.1))
    outcomes = build(study, table)([Point((0.3,), both, "base", 1), Point((-1.0,), (), "base", 1)])
    assert not outcomes.finished.any()
    assert "given twice" in outcomes.reasons[0]
    assert np.isnan(outcomes.values).all()
    assert outcomes.values.shape == (2, len(NAMES))
    assert len(table) == 0


def test_a_point_of_another_study_is_an_error(study: Study, table: OutcomeTable) -> None:
    for point, rule in (
        (Point((0.3,), (), "wid", 1), "Point.condition: must be one of base, wide"),
        (Point((0.3,), (("glue", 1.0),), "base", 1), "Point.sizes: must name mechanisms of the library"),
        (Point((0.3, 0.4), (), "base", 1), "Point.theta: must be one value for each of E"),
    ):
        with pytest.raises(ValueError, match=rule):
            build(study, table)([point])


def test_everything_that_determines_an_outcome_is_in_its_key(
    study: Study, table: OutcomeTable, write_study: Callable[..., Path]
) -> None:
    simulator = build(study, table)
    points = [*POINTS, Point((0.3,), (), "base", 2), Point((0.3,), (("rolling_torque", 0.2),), "base", 1)]
    keys = {simulator.key(simulator.case(point)) for point in points}
    finer = build(load_study(write_study(("pixels = 200", "pixels = 300"), add=CONDITIONS)), table)
    keys |= {finer.key(finer.case(POINTS[0]))}
    assert len(keys) == len(points) + 1
