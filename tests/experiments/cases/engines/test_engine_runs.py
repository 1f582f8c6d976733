"""Campaigns and searches on a program of one's own: whole, interrupted, resumed, and refused."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from experiments import api
from experiments.cases import OwnWorkers
from experiments.cases.engines.contract import command_program
from experiments.cases.engines.program import ProgramEngine
from experiments.cases.store.outcome_table import OutcomeTable
from experiments.cli import app
from experiments.discover.engine_simulator import EngineSimulator
from experiments.discover.mechanism_files import library_for
from experiments.measurement.case_observables import measure
from experiments.studyfile import load_study
from experiments.studyfile.observables import PHOTOGRAPHED

CONES = Path(__file__).with_name("cone_program.py")
Write = Callable[..., Path]


def section(way: str = "", more: str = "") -> str:
    return f"\n[engine]\ncommand = \"'{sys.executable}' '{CONES}' {way}\"\n{more}\n"


def runs(path: Path) -> Counter[str]:
    return Counter((path / "runs.txt").read_text().split())


def test_a_campaign_runs_on_a_program_and_reports_it(write_study: Write, tmp_path: Path) -> None:
    study, out = write_study(add=section(more="workers = 2")), tmp_path / "out"
    ended = api.calibrate(study, out, device="cpu")
    assert ended.campaign is not None
    assert ended.campaign.outcome == "calibrated"
    # 15 degrees and 30 more for a friction of 1, aim 30: half; a heap of these cones reads a degree off.
    assert ended.campaign.optimum is not None
    assert ended.campaign.optimum.point["E"] == pytest.approx(0.5, abs=0.05)
    results = json.loads((out / "results.json").read_text())
    assert results["provenance"]["engine"]["program"] == "cones 1.0"
    assert set(runs(out / "cases").values()) == {1}, "every case ran once"
    assert not (out / "cases" / "unfinished").exists()


def test_a_killed_campaign_goes_on_without_losing_or_repeating_a_case(
    write_study: Write, tmp_path: Path
) -> None:
    study, out = write_study(add=section(more="workers = 2")), tmp_path / "out"
    words = ["calibrate", str(study), "--out", str(out), "--device", "cpu"]
    order = [sys.executable, "-c", f"from experiments.cli import app; app({words!r})"]
    first = subprocess.Popen(order, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    stored, deadline = out / "cases", time.monotonic() + 120.0
    while len(list(stored.glob("[!.]*.npz"))) < 3 and first.poll() is None and time.monotonic() < deadline:
        time.sleep(0.01)
    os.kill(first.pid, signal.SIGKILL)
    first.wait()
    kept = {path.name for path in stored.glob("[!.]*.npz")}
    assert len(kept) >= 3
    ended = api.calibrate(study, out, device="cpu", resume=True)
    assert ended.campaign is not None
    assert kept <= {path.name for path in stored.glob("[!.]*.npz")}
    counts = runs(stored)
    # Those that ran when the campaign was killed, two at the most, began twice.
    assert sum(count - 1 for count in counts.values()) <= 2
    assert len(counts) == len(ended.campaign.cases)


def test_cases_that_the_program_fails_at_are_rows_and_are_tried_again(
    write_study: Write, tmp_path: Path
) -> None:
    study, out = write_study(add=section("crash")), tmp_path / "out"
    ended = api.calibrate(study, out, device="cpu")
    assert ended.campaign is not None
    assert ended.campaign.outcome == "too-many-failed-runs"
    cases = ended.campaign.cases
    assert set(cases["status"]) == {"no-answer"}
    assert cases["reason"].str.contains("no license was found").all()
    assert list((out / "cases" / "failed").iterdir())
    again = api.calibrate(study, out, device="cpu", resume=True)
    assert again.campaign is not None
    assert set(runs(out / "cases").values()) == {2}


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


@pytest.mark.usefixtures("_one_thread")
def test_discover_searches_with_a_program(write_study: Write, tmp_path: Path) -> None:
    settings = "settings = { bank_points = 10, bank_mechanism_points = 6 }"
    search = f'\n[discover]\nmechanisms = ["contact_adhesion"]\n{settings}\n'
    path = write_study(add=section(more="workers = 2") + search)
    study = load_study(path)
    engine = ProgramEngine(command_program(f"'{sys.executable}' '{CONES}'", Path(), "command"))
    heaps = engine([study.case({"E": 0.4}, seed) for seed in range(101, 105)])
    rows = [
        {"condition": "base", "replicate": number, "observable": name, "value": value}
        for number, heap in enumerate(heaps, 1)
        for name, value in zip(PHOTOGRAPHED, measure(study.measurement, heap, PHOTOGRAPHED)[0], strict=True)
        if name in ("flank_angle", "height", "r50")
    ]
    pd.DataFrame(rows).to_csv(tmp_path / "measured.csv", index=False)
    words = ["discover", str(path), str(tmp_path / "measured.csv"), "--out", str(tmp_path / "out")]
    result = CliRunner().invoke(app, [*words, "--device", "cpu", "--json"])
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    assert found["discovery"]["verdict"] == "none", "the data are of the model itself"
    assert (tmp_path / "out" / "report.html").is_file()


@pytest.fixture
def _one_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "1")


@pytest.mark.parametrize("command", ["calibrate", "discover"])
@pytest.mark.parametrize(
    ("words", "text", "said"),
    [
        (["--engine", "rocky"], "", "engine: must be one of"),
        ([], '\n[engine]\ncommand = "no-such-solver"\n', "must begin with a program that can be run"),
    ],
)
def test_an_engine_that_is_not_there_ends_with_code_2_and_leaves_nothing(
    write_study: Write, tmp_path: Path, command: str, words: list[str], text: str, said: str
) -> None:
    out = tmp_path / "out"
    study = write_study(add=text)
    result = CliRunner().invoke(app, [command, str(study), "--out", str(out), "--device", "cpu", *words])
    assert (result.exit_code, out.exists()) == (2, False)
    assert said in " ".join(result.stderr.split())


def test_a_heap_that_cannot_be_drawn_is_told_with_its_reason(write_study: Write, tmp_path: Path) -> None:
    study, out = write_study(add=section("high")), tmp_path / "out"
    result = CliRunner().invoke(app, ["heap", str(study), "--out", str(out), "--device", "cpu"])
    assert result.exit_code == 1
    assert "no heap" in result.stderr
    assert (out / "heap.vtp").exists()
    assert not (out / "snapshot.png").exists()
