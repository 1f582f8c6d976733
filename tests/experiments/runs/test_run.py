"""A whole calibration in a folder: what it leaves there, and how it goes on after an interruption."""

import json
import math
import shutil
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from cone_engine import stand_in

from dem_warp import Case, CaseResult, Progress
from doe.discrepancy import Outcomes, bank_points, make_bank
from experiments import api
from experiments.calibrate import Campaign, Outcome, stages
from experiments.calibrate.stages import StageHook
from experiments.cases.store.outcome_table import OutcomeTable
from experiments.cases.store.outputs import LIST, sha256_of
from experiments.cases.workers import own
from experiments.discover.search import Search
from experiments.io.errors import InputError
from experiments.runs import calibration as run
from experiments.runs import choices, request, run_folder
from experiments.studyfile import Study, load_study

SLOPE = 30.0
"""Degrees that a unit of friction adds; the target of 30 is met at a friction of 0.5."""


class Engine:
    """Stands in for the simulator: counts its cases, and stops after a number of them."""

    def __init__(self, heap: CaseResult) -> None:
        self.heap = heap
        self.seeds: list[int] = []
        self.stop_after: float = math.inf

    def __call__(
        self, cases: Sequence[Case], *, on_result: Callable[[int, CaseResult], None], **_: Any
    ) -> list[CaseResult]:
        for index, case in enumerate(cases):
            if len(self.seeds) >= self.stop_after:
                raise KeyboardInterrupt
            self.seeds.append(case.seed)
            angle = 15.0 + SLOPE * case.grain_grain.static_friction + 0.3 * math.sin(12.9898 * case.seed)
            on_result(index, replace(self.heap, observables={"truth": angle}))
        return []


@pytest.fixture
def engine(cone: Callable[..., CaseResult], monkeypatch: pytest.MonkeyPatch) -> Engine:
    engine = Engine(cone())
    stand_in(monkeypatch, engine)
    return engine


@pytest.fixture
def _without_report(monkeypatch: pytest.MonkeyPatch) -> None:
    """Spare the megabytes of a page that the test does not read."""
    monkeypatch.setattr(run, "write_report", lambda *_, **__: None)


@pytest.fixture
def study(write_study: Callable[..., Path]) -> Study:
    """Load the small study with more replicates, so that the plane of one factor is calibrated."""
    return load_study(write_study(add="[campaign.noise_floor]\nreplicates = 5\n"))


def run_campaign(
    study: Study, folder: Path, resume: bool = False, on_stage: StageHook | None = None
) -> Campaign:
    prepared = choices.prepare(study, request.RunRequest(out=folder, device="cpu", resume=resume))
    return run.run_calibration(prepared, on_stage).campaign


def same_findings(a: Campaign, b: Campaign) -> bool:
    return json.dumps(a.to_dict(), sort_keys=True) == json.dumps(b.to_dict(), sort_keys=True)


def test_a_campaign_leaves_its_report_results_and_tables(
    study: Study, engine: Engine, tmp_path: Path
) -> None:
    folder = tmp_path / "out"
    names: list[str] = []
    campaign = run_campaign(study, folder, on_stage=lambda name, _: names.append(name))
    assert campaign.outcome == Outcome.CALIBRATED
    assert campaign.optimum is not None
    # The fit of a line to heaps that scatter by 0.2 degrees.
    assert campaign.optimum.point["E"] == pytest.approx(0.5, abs=0.3 / SLOPE)
    assert (names[0], names[-1]) == ("target", "verification")
    files = "report.html results.json study.json tables cases wall_times.csv material.toml files.json"
    assert {*files.split(), ".live", ".lock"} == {path.name for path in folder.iterdir()}
    results = json.loads((folder / "results.json").read_text(encoding="utf-8"))
    assert results["campaign"]["outcome"] == "calibrated"
    assert len(list((folder / "cases").iterdir())) == len(engine.seeds) == len(campaign.cases)


@pytest.mark.usefixtures("_without_report")
def test_a_run_goes_on_in_a_folder_that_was_removed_meanwhile(
    study: Study, engine: Engine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole, folder = run_campaign(study, tmp_path / "whole"), tmp_path / "out"

    def removing(cases: Sequence[Case], **rest: Any) -> list[CaseResult]:
        if len(list(folder.glob("cases/*"))) > 7:
            shutil.rmtree(folder)
            monkeypatch.setattr(own, "simulate", engine)
            engine.stop_after = total - 1
        return engine(cases, **rest)

    total, engine.seeds = len(engine.seeds), []
    monkeypatch.setattr(own, "simulate", removing)
    with pytest.raises(KeyboardInterrupt):
        run_campaign(study, folder)
    engine.stop_after, engine.seeds = math.inf, []
    assert same_findings(run_campaign(study, folder, resume=True), whole)
    assert 8 < len(engine.seeds) < total, "what came after the folder was removed is there"


@pytest.mark.usefixtures("_without_report", "engine")
def test_a_script_may_hand_over_a_study_or_its_file(write_study: Callable[..., Path], tmp_path: Path) -> None:
    path = write_study(add="[campaign.noise_floor]\nreplicates = 5\n")
    by_file = api.calibrate(str(path), tmp_path / "file", device="cpu")
    by_study = api.calibrate(load_study(path), tmp_path / "study", device="cpu")
    assert by_file.campaign is not None
    assert by_study.campaign is not None
    assert same_findings(by_file.campaign, by_study.campaign)
    for wrong, rule in (
        ({"scale": "stiff"}, "is loaded at the scale None"),
        ({"engine": "none"}, "engine: must be"),
    ):
        with pytest.raises(InputError, match=rule):
            api.calibrate(load_study(path), tmp_path / "wrong", device="cpu", **wrong)
    assert not (tmp_path / "wrong").exists()


@pytest.mark.usefixtures("_without_report")
def test_a_finished_campaign_simulates_nothing_and_another_replicate_only_that(
    write_study: Callable[..., Path], engine: Engine, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    five = load_study(write_study(add="[campaign.noise_floor]\nreplicates = 5\n"))
    first = run_campaign(five, tmp_path / "out")
    count = len(engine.seeds)
    assert same_findings(run_campaign(five, tmp_path / "out", resume=True), first)
    assert len(engine.seeds) == count
    six = load_study(write_study(add="[campaign.noise_floor]\nreplicates = 6\n"))
    second = run_campaign(six, tmp_path / "out", resume=True)
    assert "study.campaign.noise_floor.replicates: 5 -> 6" in caplog.text
    assert first.noise_floor is not None
    assert second.noise_floor is not None
    pd.testing.assert_frame_equal(second.noise_floor.cases.iloc[:5], first.noise_floor.cases)
    assert len(engine.seeds) == count + 1


FIXED = """
[campaign]
noise_floor.replicates = 5
selection.keep = ["E"]
surface.center = { E = 0.5 }
surface.half_range = { E = 0.1 }
"""
"""Decisions that leave nothing of the composite design to the climb."""


@pytest.mark.usefixtures("_without_report")
def test_cases_of_later_stages_that_are_certain_run_earlier_and_each_once(
    write_study: Callable[..., Path], engine: Engine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = load_study(write_study(add=FIXED))
    early = run_campaign(study, tmp_path / "early")
    assert len(engine.seeds) == len(set(engine.seeds)) == len(early.cases)
    monkeypatch.setattr(stages, "fixed_box", lambda *_: None)
    assert same_findings(early, run_campaign(study, tmp_path / "late"))
    titles = [
        pd.read_csv(tmp_path / name / run_folder.WALL_TIMES_FILE)["stage"].tolist()
        for name in ("late", "early")
    ]
    assert titles == [
        ["noise floor, screening", "climb", "surface", "verification"],
        ["noise floor, screening, surface", "climb, verification"],
    ]


def leave_bank(study: Study, folder: Path, table: bool = True) -> None:
    """Leave a bank in a folder, and the table of outcomes that it was made of, as a search does."""
    search, names = Search.of(study), tuple(each.name for each in study.measurable)
    points = bank_points(search.space, search.settings)
    outcomes = Outcomes(np.ones((len(points), len(names))), ("",) * len(points))
    make_bank(search.space, names, points, outcomes, search.fingerprint).save(folder / run_folder.BANK)
    if table:
        OutcomeTable(folder / run_folder.OUTCOMES).save({"key": (np.ones(1), "")})


def listed(folder: Path) -> dict[str, str]:
    found: dict[str, str] = json.loads((folder / LIST).read_text(encoding="utf-8"))["files"]
    return found


@pytest.mark.usefixtures("_without_report", "engine")
def test_a_bank_goes_when_another_grain_or_test_is_run_and_stays_while_it_serves(
    write_study: Callable[..., Path], tmp_path: Path
) -> None:
    folder, more = tmp_path / "out", "[campaign.noise_floor]\nreplicates = 5\n"
    first = load_study(write_study(add=more))
    run_campaign(first, folder)
    leave_bank(first, folder)
    outcomes = sha256_of(folder / run_folder.OUTCOMES)
    for same_heaps in (first, load_study(write_study(("n = 5", "n = 6"), add=more))):
        run_campaign(same_heaps, folder, resume=True)
        assert listed(folder)[run_folder.BANK] == sha256_of(folder / run_folder.BANK)
    wider = load_study(write_study(('diameter = "28 mm"', 'diameter = "29 mm"'), add=more))
    run_campaign(wider, folder, resume=True)
    assert not (folder / run_folder.BANK).exists()
    assert run_folder.BANK not in listed(folder)
    # its rows are found by all that determines them, as the stored cases are
    assert sha256_of(folder / run_folder.OUTCOMES) == outcomes


@pytest.mark.usefixtures("_without_report", "engine")
def test_a_bank_that_a_person_brought_is_left_alone(study: Study, tmp_path: Path) -> None:
    run_campaign(study, tmp_path / "out")
    other = load_study(study.file, study.scale, {"wall": {"poisson_ratio": 0.2}})
    leave_bank(other, tmp_path / "out", table=False)
    run_campaign(study, tmp_path / "out", resume=True)
    assert (tmp_path / "out" / run_folder.BANK).is_file()
    assert run_folder.BANK not in listed(tmp_path / "out")


def test_a_run_that_was_killed_and_resumed_has_the_wall_time_of_all_its_parts(
    small_study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run_folder, "SAVE_WALL_TIME", 0.0)
    clock = iter([0.0, 60.0, 0.0, 7.0, 9.0])
    monkeypatch.setattr(run_folder.time, "perf_counter", lambda: next(clock))
    journal: Any = SimpleNamespace(batch=lambda _: nullcontext(lambda _: None))
    cases: list[int] = []

    def part(killed: bool) -> None:
        nothing: Any = None
        folder = run_folder.Run(small_study, tmp_path, nothing, nothing, journal, lambda _: nullcontext())
        with folder.batch("climb", lambda: len(cases)) as report:
            report(Progress(0, 1, 0.5, {}, 60.0))
            if killed:
                raise KeyboardInterrupt
            cases.append(1)

    with pytest.raises(KeyboardInterrupt):
        part(killed=True)
    part(killed=False)
    rows = pd.read_csv(tmp_path / run_folder.WALL_TIMES_FILE)
    assert rows["stage"].tolist() == ["climb", "climb"]
    assert rows["simulated"].tolist() == [0, 1]
    assert rows["seconds"].tolist() == [60.0, 9.0]
    workers: Any = SimpleNamespace(described={})
    run = run_folder.Run(small_study, tmp_path, workers, workers, journal, lambda _: nullcontext())
    assert run.provenance["seconds"] == 69.0
