"""A command that is killed and resumed, and the rules that its folder is held to."""

import os
import random
from pathlib import Path

import pytest

from experiments.evidence.robustness import kill_and_resume
from experiments.evidence.robustness.kill_and_resume import (
    CAMPAIGN,
    content,
    differing,
    fault_of,
    finished_cases,
    killed_run,
    lost,
    start,
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "cases").mkdir()
    (tmp_path / ".live").mkdir()
    for name in ("cases/a.npz", "cases/.b.123.npz", ".live/run.json", "wall_times.csv", "results.json"):
        (tmp_path / name).write_text("{}", encoding="utf-8")
    return tmp_path


def test_a_case_that_is_written_again_is_named(folder: Path) -> None:
    before = finished_cases(folder)
    assert set(before) == {"a.npz"}
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
    assert differing({}, dict.fromkeys("abcde", "")).endswith("a, b, c (5 in all)")


def test_a_killed_campaign_ends_as_one_that_was_let_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(kill_and_resume, "MOST", 1)
    whole, words = tmp_path / "whole", (*CAMPAIGN[:-1], "1")
    assert fault_of(start(words, whole), whole) == ""
    kills = killed_run(0, words, tmp_path / "killed", content(whole), 6.0, random.Random(3))
    assert kills
    assert [kill.fault for kill in kills if kill.fault] == []
