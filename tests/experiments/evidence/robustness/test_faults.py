"""Conclusions of the fault benchmarks from what they saw; the faults are done by the benchmarks."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest

from experiments.evidence.robustness.faults.attempt import content, finished_cases
from experiments.evidence.robustness.faults.kills import differing, lost
from experiments.evidence.robustness.faults.soak import growths, kills_by_kind


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "cases").mkdir()
    (tmp_path / ".live").mkdir()
    for name in ("cases/a.npz", "cases/.b.123.npz", ".live/run.json", "wall_times.csv", "results.json"):
        (tmp_path / name).write_text("{}", encoding="utf-8")
    return tmp_path


def test_half_a_case_has_not_finished(folder: Path) -> None:
    assert set(finished_cases(folder)) == {"a.npz"}


def test_a_case_that_is_written_again_is_told(folder: Path) -> None:
    before = finished_cases(folder)
    assert lost(before, finished_cases(folder)) == ""
    again = folder / "again"
    again.write_text("{}", encoding="utf-8")
    again.replace(folder / "cases" / "a.npz")
    assert "a.npz" in lost(before, finished_cases(folder))
    assert "a.npz" in lost(before, {})


def test_leftovers_of_a_kill_count_and_the_journal_does_not(folder: Path) -> None:
    assert set(content(folder)) == {"cases/a.npz", "cases/.b.123.npz", "results.json"}
    (folder / ".live" / ".run.json.77").write_text("", encoding="utf-8")
    assert os.path.join(".live", ".run.json.77") in content(folder)
    assert differing({}, dict.fromkeys("abcde", "")).endswith("a, b, c and 2 more")


def soaked(megabytes: list[float], files: list[int], kind: str = "client") -> dict[str, list[dict[str, Any]]]:
    place = {"piece": 1, "process": "worker of the lasting cluster", "born": 7}
    return {
        "campaigns": [{"campaign": i, "kind": kind, "fault": ""} for i in range(len(files))],
        "kills": [{"kind": kind, "fault": "lost" if i == 3 else ""} for i in range(5)],
        "sizes": [
            {**place, "campaign": i, "minutes": 6.0 * i, "megabytes": size, "files": count}
            for i, (size, count) in enumerate(zip(megabytes, files, strict=True))
        ],
    }


@pytest.mark.parametrize(
    ("megabytes", "files", "grown"),
    [
        ([200.0, 300.0, *[301.0] * 10], [9] * 12, "no"),
        ([300.0 + 5.0 * i for i in range(12)], [9] * 12, "yes"),
        ([300.0] * 12, [9] * 11 + [10], "yes"),
    ],
)
def test_growth_is_told_from_a_warm_start(megabytes: list[float], files: list[int], grown: str) -> None:
    [row] = growths(soaked(megabytes, files))
    assert row["grown"] == grown
    assert row["campaigns"] == 12


def test_a_process_is_judged_by_its_own_campaigns() -> None:
    assert growths(soaked([300.0] * 12, [9] * 12, "parent")) == []
    assert growths(soaked([300.0] * 3, [9] * 3)) == []


def test_broken_rules_are_counted_by_kind() -> None:
    [row] = kills_by_kind(soaked([300.0] * 3, [9] * 3))
    assert (row["killed"], row["kills"], row["campaigns"], row["rules broken"]) == ("client", 5, 3, 1)
