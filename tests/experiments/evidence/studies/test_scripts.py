"""The buckwheat scripts, on an engine whose angle is a known plane of the two friction values."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from dem_warp import Case, CaseResult
from experiments.cases import execute
from experiments.cases.workers import own
from experiments.measurement.case_observables import Observed
from experiments.studies.buckwheat import climb, screening, surface, verification

TARGET = 30.148
SCATTER = 0.1


def plane(case: Case) -> float:
    """Repose angle [degrees]: the target at the paper's fourth step, and a scatter by seed."""
    e, f = case.grain_grain.static_friction, case.grain_wall.static_friction
    return TARGET + 15.0 * (e - 0.48) + 25.0 * (f - 0.45) + SCATTER * math.sin(12.9898 * case.seed)


@pytest.fixture(autouse=True)
def _plane_engine(cone: Callable[..., CaseResult], monkeypatch: pytest.MonkeyPatch) -> None:
    heap = cone()

    def simulate(
        cases: Sequence[Case], *, on_result: Callable[[int, CaseResult], None], **_: Any
    ) -> list[CaseResult]:
        results = [replace(heap, observables={"truth": plane(case)}) for case in cases]
        for index, result in enumerate(results):
            on_result(index, result)
        return results

    def observe(_: object, result: CaseResult, __: bool) -> Observed:
        return Observed({"angle": result.observables["truth"]}, SimpleNamespace(se=0.1))

    monkeypatch.setattr(own, "simulate", simulate)
    monkeypatch.setattr(execute, "observe", observe)


def test_screening_keeps_the_two_that_matter(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    screening.main("bench", tmp_path)
    kept = capsys.readouterr().out.splitlines()[-1]
    assert {"E", "F"} <= set(kept.removeprefix("kept: ").split(", "))
    assert (tmp_path / "screening-bench.csv").is_file()


def test_the_climb_ends_at_the_fourth_point(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    climb.main("bench", TARGET, tmp_path)
    assert capsys.readouterr().out.splitlines()[-1] == "nearest to the target: point 4"


def test_the_surface_leads_back_to_its_center(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    surface.main("bench", TARGET, out=tmp_path)
    lines = capsys.readouterr().out.splitlines()
    found = {line.split()[0]: float(line.split()[1]) for line in lines[-2:]}
    # The scatter moves the fitted mean by less than itself, so the contour by less than that over the slopes.
    assert found["E"] == pytest.approx(0.48, abs=SCATTER / 15.0)
    assert found["F"] == pytest.approx(0.45, abs=SCATTER / 25.0)


def test_verification_states_the_smallest_margin(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    verification.main("bench", TARGET, out=tmp_path)
    lines = capsys.readouterr().out.splitlines()
    margin = float(lines[-1].split("margin of ")[1].split()[0])
    # Welch's with 4 to 4.3 degrees of freedom (t = 2.13 to 2.10), as the heaps' sd of 0 to 0.1 is small
    # beside the target's: the difference's standard error lies between 0.518 / sqrt 5 = 0.232 and 0.236; the
    # difference is at most 0.07 + 0.1.
    assert 2.10 * 0.23 < margin < 2.14 * 0.24 + 0.17
