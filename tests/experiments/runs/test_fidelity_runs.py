"""Calibrations whose design is run at a cheaper scale: under a budget of time, and in a folder."""

import tomllib
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from commandline import dem_warp, refused
from cone_engine import stand_in

from dem_warp import Case, CaseResult
from experiments.cases.forecast import speed
from experiments.runs import fidelity
from experiments.runs.choices import Prepared, prepare
from experiments.runs.fidelity import with_budget
from experiments.runs.request import RunRequest

SCALES = """
[scale.soft]
numerics.modulus_scale = 16.0

[scale.softer]
numerics.modulus_scale = 400.0

[campaign.noise_floor]
replicates = 5
"""
Write = Callable[..., Path]


def prepared(path: Path, resume: bool = False) -> Prepared:
    return prepare(path, RunRequest(scale="stiff", out=path.parent / "out", device="cpu", resume=resume))


def chosen(found: Prepared) -> tuple[str, int]:
    section = found.study.campaign.fidelity
    assert section is not None
    return section.scale, section.runs


@pytest.fixture
def path(write_study: Write) -> Path:
    """Write a study with three scales: a step is 4 and 20 times as long at the cheaper ones."""
    return write_study(add=SCALES)


def test_without_a_known_speed_the_dearest_scale_of_a_quarter_is_taken(path: Path) -> None:
    assert chosen(with_budget(prepared(path), "30 min")) == ("soft", 12)


@pytest.mark.parametrize(
    ("budget", "taken"), [(1000.0, ("soft", 40)), (42.0, ("soft", 12)), (30.0, ("softer", 16))]
)
def test_a_budget_takes_the_dearest_scale_that_leaves_enough_runs(
    path: Path, monkeypatch: pytest.MonkeyPatch, budget: float, taken: tuple[str, int]
) -> None:
    design = {"soft": 30.0, "softer": 14.0}

    def seconds(found: Prepared) -> float:
        scale, runs = chosen(found)
        return design[scale] + 1.0 * runs

    monkeypatch.setattr(fidelity, "_seconds", seconds)
    assert chosen(with_budget(prepared(path), f"{budget:g} s")) == taken


def test_a_budget_counts_every_batch_at_its_speed(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(speed, "noted_speed", lambda *_: (1.0e6, (1,)))
    found = with_budget(prepared(path), "2 h")
    assert chosen(found) == ("soft", 40)
    said = refused("calibrate", path, "--scale", "stiff", "--device", "cpu", "--budget", "3 s")
    assert "--budget: must be at least" in said
    code, out, _ = dem_warp(
        "calibrate", path, "--scale", "stiff", "--device", "cpu", "--budget", "2 h", "--dry-run"
    )
    assert code == 0
    assert "runs at this scale" in out


@pytest.mark.parametrize(
    ("budget", "said"), [("30", "unit"), ("soon", "soon"), ("0 s", "longer than 0 s"), ("inf s", "inf")]
)
def test_what_is_no_time_is_refused(path: Path, budget: str, said: str) -> None:
    assert said in refused("calibrate", path, "--scale", "stiff", "--device", "cpu", "--budget", budget)


def test_runs_by_hand_have_one_scale(path: Path) -> None:
    said = refused("calibrate", path, "--scale", "stiff", "--by-hand", "--budget", "1 h")
    assert "campaign.fidelity.scale: cannot be combined with runs by hand" in said


def test_a_study_without_a_cheaper_scale_is_refused(write_study: Write) -> None:
    path = write_study()
    said = refused("calibrate", path, "--device", "cpu", "--budget", "1 h")
    assert "--budget: needs a cheaper [scale.NAME] of the study" in said
    path.write_text(path.read_text() + '\n[campaign.fidelity]\nscale = "stif"\n')
    assert "did you mean 'stiff'" in refused("calibrate", path, "--device", "cpu")


def test_the_design_is_simulated_at_the_cheaper_scale_and_the_report_says_so(
    path: Path, cone: Callable[..., CaseResult], monkeypatch: pytest.MonkeyPatch
) -> None:
    scales: Counter[float] = Counter()

    def engine(cases: Sequence[Case], *, on_result: Any, **_: Any) -> list[CaseResult]:
        for index, case in enumerate(cases):
            softened = case.numerics.modulus_scale
            scales[softened] += 1
            angle = 15.0 + 30.0 * case.grain_grain.static_friction - (2.0 if softened > 1.0 else 0.0)
            noise = 0.3 * ((case.seed % 1000) / 500.0 - 1.0)
            on_result(index, replace(cone(), observables={"truth": angle + noise}))
        return []

    stand_in(monkeypatch, engine)
    out = path.parent / "out"
    words = ("calibrate", path, "--scale", "stiff", "--device", "cpu", "--budget", "30 min", "--out", out)
    code, _, said = dem_warp(*words)
    assert code == 0, said
    assert "The design at the scale soft, 12 runs" in " ".join(said.split())
    # Six steps of the climb, six that move the surface, five that verify.
    assert (scales[1.0], set(scales)) == (6 + 6 + 5, {1.0, 16.0})
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "The surface at this scale" in page
    card = tomllib.loads((out / "material.toml").read_text(encoding="utf-8"))
    assert "surface" not in card
    # Heaps of the own scale stand at 30 degrees for .5; a unit of friction is 30 degrees.
    assert card["factor"]["E"]["chosen"] == pytest.approx(0.5, abs=0.02)
    before = sum(scales.values())
    assert dem_warp(*words, "--resume")[0] == 0
    assert sum(scales.values()) == before
    monkeypatch.setattr(speed, "noted_speed", lambda *_: (1.0e9, (1,)))
    assert chosen(with_budget(prepared(path, resume=True), "10 h")) == ("soft", 12)
