"""Forecasts of wall time: work that is predicted, speeds that are noted, and what they say of a batch."""

import json
import re
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from dem_warp import MECHANISMS, SCENES, CaseResult, PouredHeap, simulate
from experiments.cases import OwnWorkers
from experiments.cases.forecast import speed
from experiments.cases.forecast.speed import (
    Load,
    expected_seconds,
    forecast,
    note_batch,
    noted_speed,
    source_of,
)
from experiments.cases.forecast.work import Work, _phases, rest_of, work_of
from experiments.cases.workers import call_results
from experiments.cases.workers.call_results import CallResults, ExpectedProgress
from experiments.commands.console import describe_progress
from experiments.studyfile import Study

WORK = Work("balls", 100, 100, 1.0e-5, 1.0e6)


@pytest.fixture(autouse=True)
def notes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(speed, "NOTES", str(tmp_path / "notes" / "batches.json"))
    _phases.cache_clear()  # a case of an earlier test may have the same scene
    return tmp_path / "notes" / "batches.json"


def workers_of(count: int = 2, on_gpu: bool = False, sharing: int = 1, machine: str = "this") -> Any:
    return SimpleNamespace(count=count, on_gpu=on_gpu, sharing=sharing, machine=machine)


def test_no_scene_and_no_law_is_named_by_the_forecast() -> None:
    files = [*Path(speed.__file__).parent.glob("*.py"), Path("experiments/runs/plan.py")]
    text = "\n".join(file.read_text(encoding="utf-8") for file in files)
    names = [*SCENES, *MECHANISMS, *(kind.__name__ for kind in [*SCENES.values(), *MECHANISMS.values()])]
    assert len(names) > 20
    assert [name for name in names if re.search(rf"\b{re.escape(name)}\b", text)] == []


def test_steps_are_predicted_within_a_half(small_study: Study) -> None:
    case = small_study.case({"E": 0.4}, 1)
    [result] = simulate([case], "cpu", 1)
    steps = sum(phase["steps"] for phase in result.phases)
    work = work_of(case)
    assert 1 / 1.5 < work.steps / steps < 1.5
    assert work.grains == work.spheres == result.observables["grain_count"] == 30


def test_a_case_takes_its_rain_and_the_phases_that_its_test_expects(small_study: Study) -> None:
    case = small_study.case({}, 1)
    more = replace(case, scene=replace(case.scene, grain_count=330))
    seconds = [work_of(each).steps * each.time_step for each in (case, more)]
    assert seconds[1] - seconds[0] == pytest.approx(300 / case.scene.grains_per_second(case))
    fixed = replace(case, scene=replace(case.scene, duration=2.5))
    assert work_of(fixed).steps * case.time_step == pytest.approx(2.5)


def test_a_weighed_portion_takes_as_long_as_its_grains(small_study: Study) -> None:
    case = small_study.case({}, 1)
    funnel = PouredHeap(0.04, 0.05, 0.015, case.scene.wall_material, mass=0.002)
    weighed = work_of(replace(case, scene=funnel))
    counted = replace(funnel, mass=None, grain_count=weighed.grains)
    assert weighed == work_of(replace(case, scene=counted))


def test_cores_share_the_work_and_none_ends_before_its_longest_case() -> None:
    assert Load.of([WORK] * 8, workers_of()).sphere_steps == pytest.approx(4.0e8)
    long = replace(WORK, steps=9.0e6)
    assert Load.of([WORK, long], workers_of()).sphere_steps == pytest.approx(9.0e8)


def test_the_worlds_of_a_launch_step_together_until_the_last_one_ends() -> None:
    load = Load.of([WORK] * 30 + [replace(WORK, steps=2.0e6)], workers_of(1, on_gpu=True))
    assert (load.spheres, load.sphere_steps) == (3100.0, pytest.approx(3100 * 2.0e6))
    two = Load.of([WORK] * 30, workers_of(2, on_gpu=True))
    assert (two.spheres, two.sphere_steps) == (1500.0, pytest.approx(1500 * 1.0e6))


def note(works: list[Work], workers: Any, seconds: float, part: float = 1.0) -> None:
    note_batch(works, workers, part, seconds)


def test_the_time_is_unknown_until_a_like_batch_has_finished_here() -> None:
    assert forecast([WORK] * 4, workers_of()) == (None, ())
    note([WORK] * 4, workers_of(), 20.0)
    assert forecast([WORK] * 8, workers_of()) == (pytest.approx(40.0), (0,))
    note([WORK] * 4, workers_of(), 10.0)
    assert forecast([WORK] * 4, workers_of()) == (pytest.approx(2.0e8 / 1.5e7), (0, 1))
    unlike = (
        replace(WORK, kind="rods"), replace(WORK, spheres=201), replace(WORK, time_step=2.0e-5),
    )  # fmt: skip
    for work in unlike:
        assert forecast([work] * 4, workers_of()) == (None, ())
    assert forecast([WORK], workers_of(machine="another")) == (None, ())


@pytest.mark.parametrize("on_gpu", [False, True])
def test_what_a_command_takes_apart_from_its_batches_is_noted_and_is_no_speed(on_gpu: bool) -> None:
    workers, rest = workers_of(2, on_gpu), [rest_of("calibrate")]
    note([WORK] * 4, workers, 20.0)
    speeds = noted_speed("this")
    for seconds in (30.0, 12.0, 12.5):
        note(rest, workers, seconds)
    assert forecast(rest, workers)[0] == pytest.approx(12.5)
    assert forecast([rest_of("heap")], workers) == (None, ())
    assert noted_speed("this") == speeds


def test_a_launch_of_another_size_tells_nothing_of_a_gpu() -> None:
    note([WORK] * 30, workers_of(1, on_gpu=True), 10.0)
    assert forecast([WORK] * 50, workers_of(1, on_gpu=True))[0] == pytest.approx(10.0 * 5 / 3)
    assert forecast([WORK] * 70, workers_of(1, on_gpu=True)) == (None, ())
    assert forecast([WORK] * 30, workers_of(2, on_gpu=True, sharing=2)) == (None, ())


def test_batches_of_another_number_of_workers_count_where_none_had_as_many(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(speed, "cores", lambda: 4)
    two, one, many = (workers_of(n, machine=f"this, CPU, {n} worker{'s' * (n > 1)}") for n in (2, 1, 16))
    note([WORK] * 4, two, 20.0)
    assert forecast([WORK], one) == (pytest.approx(10.0), (0,))
    # sixteen workers on four cores are each as slow as they are many
    assert forecast([WORK], many) == (None, ())
    note([WORK], one, 8.0)
    assert forecast([WORK], one) == (pytest.approx(8.0), (1,))
    assert forecast([WORK] * 4, two) == (pytest.approx(20.0), (0,))


def test_impossible_speeds_are_not_noted_and_one_outlier_counts_little(notes: Path) -> None:
    note([WORK], workers_of(), 0.01)
    note([WORK], workers_of(), 50.0, part=0.1)
    note([replace(WORK, steps=1.0e9)], workers_of(), 1.0)
    assert not notes.exists()
    for seconds in (10.0, 10.0, 200.0):
        note([WORK], workers_of(), seconds)
    assert forecast([WORK], workers_of())[0] == pytest.approx(10.0)


def test_a_damaged_file_and_speeds_of_an_earlier_format_are_ignored(
    notes: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(speed, "LARGE", 1.0)
    notes.parent.mkdir()
    load = asdict(Load.of([WORK], workers_of()))
    rows: list[Any] = [{"load": load, "speed": 1.0e7}]
    for text in ('{"this": {"step": 1e-7}}', "[]", "{", json.dumps({"format": 0, "batches": rows})):
        notes.write_text(text, encoding="utf-8")
        assert noted_speed("this") is None
    rows += [{"load": load, "speed": value} for value in (0.0, -1.0, 1.0e12)]
    rows += [{"load": load | {"spheres": 0.0}, "speed": 1.0e7}]
    notes.write_text(json.dumps({"format": 1, "batches": rows}), encoding="utf-8")
    assert noted_speed("this") == (1.0e7, (0,))


@pytest.mark.parametrize("bad", [9.0e8, 3.0e12, 10.0, 0.0, -1.0, float("inf"), float("nan"), "fast", None])
def test_a_bad_value_in_the_cache_changes_no_forecast(notes: Path, bad: Any) -> None:
    load = asdict(Load.of([WORK], workers_of()))
    notes.parent.mkdir()
    notes.write_text(json.dumps({"format": 1, "batches": [{"load": load, "speed": bad}]}), encoding="utf-8")
    assert forecast([WORK], workers_of()) == (None, ())
    note([WORK], workers_of(), 10.0)
    assert forecast([WORK], workers_of())[0] == pytest.approx(10.0)


def test_a_slow_first_start_is_no_part_of_the_speed(
    small_study: Study, cone: Callable[..., CaseResult], monkeypatch: pytest.MonkeyPatch
) -> None:
    now = [0.0]
    monkeypatch.setattr(call_results, "time", SimpleNamespace(perf_counter=lambda: now[0]))
    call = CallResults([small_study.case({}, seed) for seed in (1, 2)], None, None, at_once=2)
    # The first worker compiles for 90 s, the second starts 20 s after it; both then work for 8 s.
    for now[0], share, phases in (
        (90.0, 0.0, {"waiting": 2}),
        (91.0, 0.1, {"fill": 1, "waiting": 1}),
        (111.0, 0.2, {"fill": 2}),
    ):
        call.follow(0, [0, 1], ExpectedProgress(0, 2, share, phases, 0.0))
    now[0] = 119.0
    for index in (0, 1):
        call.take(index, cone())
    assert call.pace == (pytest.approx(0.8), pytest.approx(8.0))


def test_a_finished_batch_notes_its_speed(small_study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(speed, "LEAST_SECONDS", 0.0)
    monkeypatch.setattr(speed, "LARGE", 1.0)
    cases = [small_study.case({}, seed) for seed in (1, 2)]
    workers = OwnWorkers("cpu", 1)
    assert expected_seconds(cases, workers) is None
    workers.simulate(cases)
    value, noted = noted_speed(workers.machine) or (0.0, ())
    assert 1.0e4 < value < 1.0e8
    assert source_of(noted) == "from 1 batch on this machine"
    assert 0.0 < (expected_seconds(cases, workers) or 0.0) < 600.0


def test_cases_that_failed_early_leave_no_speed(small_study: Study) -> None:
    call = CallResults([small_study.case({}, 1)], None, None)
    call._begun = (0.1, 0.0)
    for status, part in (("finished", 0.9), ("failed", 0.0)):
        call.results = {0: SimpleNamespace(status=status)}  # type: ignore[dict-item]
        assert call.pace[0] == pytest.approx(part)


def test_the_time_left_follows_the_progress_after_a_tenth() -> None:
    begun = ExpectedProgress(0, 10, 0.0, {"waiting": 10}, 4.0, expected=100.0)
    assert describe_progress(begun).startswith("1 min 36 s left")
    late = ExpectedProgress(0, 10, 0.0, {"fill": 2}, 200.0, expected=100.0)
    assert describe_progress(late).startswith("10 s left")
    half = ExpectedProgress(5, 10, 0.5, {"lift": 2}, 300.0, expected=100.0)
    assert describe_progress(half).startswith("5 min 0 s left")
    unknown = ExpectedProgress(0, 10, 0.0, {}, 4.0)
    assert "left" not in describe_progress(unknown)
