"""Batches before they run: predicted costs, what fits a device, and what becomes of a batch that fails."""

import gc
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dem_warp import Case, CaseResult, Progress
from experiments.cases import OwnWorkers
from experiments.cases.forecast.work import work_of
from experiments.cases.workers import batches, own
from experiments.cases.workers.batches import device_bytes, plan_batches, relative_work
from experiments.cases.workers.call_results import CallResults, ExpectedProgress
from experiments.studyfile import Study, load_study

Write = Callable[..., Path]


@pytest.fixture(autouse=True, scope="module")
def _young() -> None:
    """Leave what earlier tests left out of the collections between two attempts."""
    gc.freeze()


@pytest.fixture
def cases(small_study: Study) -> list[Case]:
    return [small_study.case({"E": 0.3}, seed) for seed in range(8)]


class Stub:
    """Stands in for the simulator: cases end in a cone, or as scripted."""

    def __init__(self, cone: Callable[..., CaseResult], faults: dict[int, Exception], room: int = 99) -> None:
        self.cone, self.faults, self.room = cone, faults, room
        self.sizes: list[int] = []
        self.ended: list[int] = []

    def __call__(
        self, cases: Sequence[Case], on_result: Callable[[int, CaseResult], None], **_: object
    ) -> None:
        self.sizes.append(len(cases))
        if len(cases) > self.room:
            raise RuntimeError("Failed to allocate 123456 bytes on device 'cuda:0'")
        for index, case in enumerate(cases):
            if fault := self.faults.get(case.seed):
                raise fault
            self.ended.append(case.seed)
            on_result(index, self.cone())


def test_a_case_costs_what_its_steps_and_spheres_do(write_study: Write) -> None:
    study = load_study(write_study())
    stiff = load_study(study.file, "stiff")
    more = load_study(write_study(("grain_count = 30", "grain_count = 300")))
    soft, hard, large = (each.case({}, 1) for each in (study, stiff, more))
    costs = relative_work([soft, hard, large])
    # A time step follows from the square root of the modulus, which is 400 times as high.
    assert costs[1] / costs[0] == pytest.approx(20.0, rel=0.01)
    assert costs[2] > 2.0 * costs[0]


def test_on_cpus_every_case_is_a_batch_and_the_costly_ones_come_first(cases: list[Case]) -> None:
    costs = np.array([1.0, 3.0, 2.0, 3.0, 1.0, 1.0, 1.0, 9.0])
    assert plan_batches(cases, costs, 2) == [[7], [1], [3], [2], [0], [4], [5], [6]]


def test_on_gpus_workers_get_batches_of_like_cost_that_their_memory_holds(
    cases: list[Case], monkeypatch: pytest.MonkeyPatch
) -> None:
    costs = np.array([1.0, 3.0, 2.0, 3.0, 1.0, 1.0, 1.0, 9.0])
    # One round for two workers, dealt out in turn.
    assert plan_batches(cases, costs, 2, memory=1e12) == [[7, 3, 0, 5], [1, 2, 4, 6]]
    # Room for two worlds: two rounds, the costly cases in the first.
    room = 2.0 * device_bytes(cases[0]) / batches.MEMORY_SHARE
    halves = plan_batches(cases, costs, 2, memory=1.01 * room)
    assert sorted(map(len, halves)) == [2, 2, 2, 2]
    assert {7, 1, 3, 2} == {index for batch in halves[:2] for index in batch}
    monkeypatch.setattr(batches, "WORLDS", 3)
    assert sorted(len(batch) for batch in plan_batches(cases, costs, 1, memory=1e12)) == [2, 3, 3]
    # As full as can be: six worlds of ten thirds that fill a GPU are two launches of three, not three of two.
    monkeypatch.setattr(batches, "FULL_GRAINS", 3.3 * work_of(cases[0]).grains)
    assert list(map(len, plan_batches(cases[:6], costs[:6], 1, memory=1e12))) == [3, 3]
    assert list(map(len, plan_batches(cases[:4], costs[:4], 1, memory=1e12))) == [2, 2]
    monkeypatch.setattr(batches, "WORLDS", 1024)
    assert list(map(len, plan_batches(cases[:4], costs[:4], 1, memory=1e12))) == [4]
    assert list(map(len, plan_batches(cases, costs, 1, memory=1e12))) == [4, 4]
    assert list(map(len, plan_batches(cases, costs, 2, memory=1e12))) == [4, 4]


def test_the_launches_of_workers_that_share_a_gpu_fill_it_together(
    cases: list[Case], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(batches, "FULL_GRAINS", 4.0 * work_of(cases[0]).grains)
    costs = np.ones(8)
    assert list(map(len, plan_batches(cases, costs, 1, 1e12))) == [4, 4]
    assert list(map(len, plan_batches(cases, costs, 2, 1e12, sharing=2))) == [2] * 4
    assert list(map(len, plan_batches(cases, costs, 4, 1e12, sharing=2))) == [2] * 4


def test_what_needs_other_kernels_is_another_batch(cases: list[Case], small_study: Study) -> None:
    double = [replace(case, numerics=replace(case.numerics, precision="double")) for case in cases[:3]]
    planned = plan_batches([*cases, *double], np.ones(11), 1, memory=1e12)
    assert sorted(map(sorted, planned)) == [[*range(8)], [8, 9, 10]]


def test_a_batch_that_the_memory_does_not_hold_is_halved_and_tried_again(
    cases: list[Case], cone: Callable[..., CaseResult], monkeypatch: pytest.MonkeyPatch
) -> None:
    stub = Stub(cone, {}, room=3)
    monkeypatch.setattr(own, "simulate", stub)
    results = OwnWorkers("cpu").simulate(cases)
    assert [result.status for result in results] == ["finished"] * 8
    assert stub.sizes == [8, 4, 2, 2, 4, 2, 2]
    assert sorted(stub.ended) == list(range(8)), "each once"


def test_the_exception_of_a_case_ends_that_case_only(
    cases: list[Case], cone: Callable[..., CaseResult], monkeypatch: pytest.MonkeyPatch
) -> None:
    stub = Stub(cone, {5: ZeroDivisionError("division by zero")})
    monkeypatch.setattr(own, "simulate", stub)
    results = OwnWorkers("cpu").simulate(cases)
    assert [result.status for result in results] == ["finished"] * 5 + ["no-answer"] + ["finished"] * 2
    assert results[5].reason == "its simulation raised ZeroDivisionError: division by zero"
    assert sorted(stub.ended) == [0, 1, 2, 3, 4, 6, 7], "each once"


def test_a_case_too_large_for_a_device_ends_alone_and_says_so(
    cases: list[Case], cone: Callable[..., CaseResult], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(own, "simulate", Stub(cone, {}, room=0))
    results = OwnWorkers("cpu").simulate(cases[:2])
    assert {result.status for result in results} == {"no-answer"}
    assert "the device has not enough memory for it" in results[0].reason


def test_checkpoints_take_two_percent_of_a_launch_at_most() -> None:
    """A checkpoint of a world of 2,500 clumps takes 0.04 s with a slow disk."""
    assert own.checkpoint_interval(1) == 60.0
    for worlds in (30, 31, 128, 1024):
        assert 0.04 * worlds <= 0.02 * own.checkpoint_interval(worlds) * (1.0 + 1e-9)


@pytest.mark.parametrize(
    "error", [OSError("the disk is full"), KeyboardInterrupt(), ValueError("of the caller")]
)
def test_an_error_of_the_caller_is_no_cases(
    cases: list[Case], cone: Callable[..., CaseResult], monkeypatch: pytest.MonkeyPatch, error: BaseException
) -> None:
    stub = Stub(cone, {})
    monkeypatch.setattr(own, "simulate", stub)

    def keep(index: int, result: CaseResult) -> None:
        raise error

    with pytest.raises(type(error)):
        OwnWorkers("cpu").simulate(cases, on_result=keep)
    assert stub.sizes == [8]


def test_progress_is_weighed_by_cost_and_reported_from_the_start(
    cases: list[Case], cone: Callable[..., CaseResult]
) -> None:
    seen: list[Progress] = []
    batch = CallResults(cases[:2], None, seen.append, expected=40.0)
    batch.costs = np.array([3.0, 1.0])
    batch.report()
    batch.follow(0, [0, 1], Progress(0, 2, 0.5, {"fill": 2}, 1.0))
    batch.take(0, cone())
    batch.end(0)
    batch.take(1, cone())
    batch.report()
    assert [progress.fraction for progress in seen] == [0.0, 0.5, 0.875, 1.0]
    assert seen[0].phase_counts == {"waiting": 2}
    assert seen[1].phase_counts == {"fill": 2}
    first = seen[0]
    assert isinstance(first, ExpectedProgress)
    assert first.expected == 40.0
