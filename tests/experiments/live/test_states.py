"""States of a run by its folder: waiting, running, finished, failed, interrupted, of an older version."""

import json
import logging
import os
import random
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from conftest import KEY, NAME, begin

from dem_warp import CaseResult, Progress
from experiments.cases import Store, open_folder
from experiments.cases.store.folder import is_used
from experiments.io.files import JOURNAL
from experiments.journal.journal import BEAT, CASES, PROGRESS, Journal
from experiments.live.run_charts import charts_of
from experiments.live.run_state import RunState
from experiments.live.watch_routes import state_text
from experiments.studyfile import Study

Cone = Callable[..., CaseResult]


def test_an_empty_folder_waits(tmp_path: Path) -> None:
    state = RunState.read(tmp_path)
    assert state.progress.state == "waiting"
    assert json.loads(state_text(tmp_path))["heaps"] == []


def test_a_run_that_ends_is_finished(run_folder: Path, small_study: Study) -> None:
    with Journal(run_folder, "calibrate", small_study) as journal:
        journal.say("half way")
        assert RunState.read(run_folder).progress.state == "running"
    state = RunState.read(run_folder)
    assert state.progress.state == "finished"
    assert [line.text for line in state.log] == ["The run begins.", "half way", "The run has ended."]


@pytest.mark.parametrize(
    ("error", "state", "said"),
    [
        (KeyboardInterrupt(), "interrupted", "The run was interrupted."),
        (ValueError("no heap"), "failed", "The run failed: no heap"),
    ],
)
def test_a_run_that_is_broken_off_says_so(
    run_folder: Path, small_study: Study, error: BaseException, state: str, said: str
) -> None:
    with pytest.raises(type(error)), Journal(run_folder, "calibrate", small_study):
        raise error
    found = RunState.read(run_folder).progress
    assert (found.state, found.message) == (state, said)


def test_a_killed_run_is_interrupted(run_folder: Path, small_study: Study, cone: Cone) -> None:
    """One that was killed leaves the word that it runs, and an old sign of life."""
    begin(run_folder, small_study, cone)._ended.set()
    past = time.time() - 120.0
    for name in (BEAT, PROGRESS):
        (run_folder / JOURNAL / name).touch()
        os.utime(run_folder / JOURNAL / name, (past, past))
    state = RunState.read(run_folder)
    assert state.progress.state == "interrupted"
    assert state.progress.message.startswith("No sign of life for 2 min")
    # what it had under way is still shown
    assert [heap["id"] for heap in state.heaps] == [f"preview/{NAME}", f"case/{KEY}"]


def test_a_run_gives_signs_of_life(
    run_folder: Path, small_study: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("experiments.journal.journal.BEAT_EVERY", 0.01)
    with Journal(run_folder, "calibrate", small_study):
        ended = time.monotonic() + 90.0
        while not (run_folder / JOURNAL / BEAT).exists():
            assert time.monotonic() < ended


def test_folders_of_older_versions_show_what_they_hold(
    tmp_path: Path, small_study: Study, cone: Cone
) -> None:
    folder = tmp_path / "old"
    store, _ = open_folder(folder, small_study)
    store.save(KEY, cone())
    state = RunState.read(folder)
    assert (state.run.command, state.run.study) == ("calibrate", "Small")
    assert state.progress.state == "interrupted"
    assert [heap["id"] for heap in state.heaps] == [f"case/{KEY}"]
    (folder / "results.json").write_text("{}", encoding="utf-8")
    tables = folder / "tables"
    tables.mkdir()
    head, *rows = (
        "stage,run,status,angle,case_key",
        f"screening,2,finished,,{KEY}",
        "climb,1,finished,30.5,other",
    )
    (tables / "cases.csv").write_text("\n".join([head, *rows]), encoding="utf-8")
    decisions = 'stage,rule,outcome\nscreening,the rule,"E, F are kept"\nscreening,,more\nclimb,,over\n'
    (tables / "decisions.csv").write_text(decisions, encoding="utf-8")
    state = RunState.read(folder)
    assert state.progress.state == "finished"
    assert [(heap["id"], heap["title"], heap["angle"]) for heap in state.heaps] == [
        ("case/other", "climb, run 1", 30.5),
        (f"case/{KEY}", "screening, run 2", None),
    ]
    assert [(s.name, [d.outcome for d in s.decisions]) for s in state.stages] == [
        ("screening", ["E, F are kept", "more"]),
        ("climb", ["over"]),
    ]


@pytest.mark.parametrize(
    "content", [b"", b"status\n\xff\n", b'a,"', b"status,angle\nfinished,nan,3\n", b"\0\n\0"]
)
def test_a_damaged_table_of_an_older_version_is_ignored(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "tables").mkdir()
    for name in ("cases.csv", "decisions.csv"):
        (tmp_path / "tables" / name).write_bytes(content)
    state = RunState.read(tmp_path)
    assert state.stages == []
    assert all(case.get("angle") is None for case in state.cases.values())


def test_progress_has_the_time_left(run_folder: Path, small_study: Study) -> None:
    with Journal(run_folder, "calibrate", small_study) as journal:
        with journal.batch("screening") as note:
            note(Progress(0, 4, 0.0, {"fill": 2}, 0.0))
            journal._noted = 0.0
            note(Progress(1, 4, 0.25, {"lift": 2}, 30.0))
            state = RunState.read(run_folder)
            assert (state.progress.title, state.progress.done, state.progress.total) == ("screening", 1, 4)
            assert state.left == "1 min 30 s"
        assert RunState.read(run_folder).left == ""


def test_warnings_of_a_run_are_in_its_log(run_folder: Path, small_study: Study) -> None:
    with Journal(run_folder, "calibrate", small_study):
        logging.getLogger("experiments.runs").warning("a %s is doubtful", "picture")
    logging.getLogger("experiments.runs").warning("after the end")
    said = [(line.level, line.text) for line in RunState.read(run_folder).log]
    assert ("warning", "a picture is doubtful") in said
    assert "after the end" not in [text for _, text in said]


def test_a_journal_is_no_result(run_folder: Path, small_study: Study) -> None:
    with Journal(run_folder, "heap", small_study):
        pass
    assert not is_used(run_folder)
    with Journal(run_folder, "heap", small_study):
        pass
    assert len(RunState.read(run_folder).log) == 2, "the notes of the run before are gone"
    with Journal(run_folder, "heap", small_study, resume=True):
        pass
    assert len(RunState.read(run_folder).log) == 4


def test_a_journal_that_cannot_be_written_ends_no_run(tmp_path: Path, small_study: Study, cone: Cone) -> None:
    (tmp_path / JOURNAL).write_text("a file in its way", encoding="utf-8")
    with Journal(tmp_path, "heap", small_study, resume=True) as journal:
        journal.say("nobody hears")
        journal.ended(KEY, {"status": "finished"})
        journal.previews.write(NAME, cone(), {"phase": "lift", "fraction": 0.5})
        with journal.batch("heap"):
            pass
    assert RunState.read(tmp_path).log == []


def test_damaged_notes_are_ignored(run_folder: Path, small_study: Study, cone: Cone) -> None:
    begin(run_folder, small_study, cone)
    for name in ("run.json", "stages.jsonl", "log.jsonl", PROGRESS, CASES):
        path = run_folder / JOURNAL / name
        whole = path.read_bytes() if path.exists() else b""
        path.write_bytes(whole + b'{"half": \n[1]\nnull\n\xff\n')
    (run_folder / JOURNAL / "previews" / f"{NAME}.npz").write_bytes(b"PK")
    state = RunState.read(run_folder)
    assert len(state.cases) == 2
    assert json.loads(state_text(run_folder))["cases"]["ended"] == 1


def test_mutated_journals_are_no_traceback(run_folder: Path, small_study: Study, cone: Cone) -> None:
    """A folder may come from anyone: whatever is in it, the page has a state."""
    begin(run_folder, small_study, cone)
    rng = random.Random(5)
    for path in [path for path in (run_folder / JOURNAL).iterdir() if path.is_file() and path.name != BEAT]:
        whole = path.read_bytes()
        for _ in range(12):
            start = rng.randrange(len(whole) + 1)
            piece = rng.choice((b"", b"1e999", b'{"a": [[]]}', b"\xff", b"\0"))
            path.write_bytes(whole[:start] + piece + whole[start + rng.choice((0, 1, 8, 64)) :])
            json.loads(state_text(run_folder), parse_constant=lambda name: pytest.fail(name))
        path.write_bytes(whole)


def test_notes_of_other_kinds_of_values_are_no_traceback(run_folder: Path) -> None:
    """A folder may come from anyone."""
    (run_folder / JOURNAL).mkdir(parents=True)
    odd = {"responses": [3], "factors": 5, "study": [1], "state": {"a": 1}, "left": "x", "phases": 3}
    (run_folder / JOURNAL / "run.json").write_text(json.dumps(odd), encoding="utf-8")
    (run_folder / JOURNAL / PROGRESS).write_text(json.dumps(odd), encoding="utf-8")
    cases = [{"status": 1, "angle": "x"}, {"case_key": {}, "angle": 3, "run": "x", "stage": "climb"}]
    (run_folder / JOURNAL / CASES).write_text("\n".join(map(json.dumps, cases)), encoding="utf-8")
    stages = '{"name": "screening", "tables": 3}\n{"name": "target", "responses": {"a": 4}}\n'
    (run_folder / JOURNAL / "stages.jsonl").write_text(stages, encoding="utf-8")
    json.loads(state_text(run_folder))


def test_charts_follow_the_cases(run_folder: Path, small_study: Study, cone: Cone) -> None:
    journal = begin(run_folder, small_study, cone)
    assert [chart.name for chart in charts_of(RunState.read(run_folder))] == ["course"]
    journal.ended("c" * 64, {"status": "finished", "reason": "", "angle": 31.0, "angle_se": 0.5})
    course, over = charts_of(RunState.read(run_folder))
    assert over.name == "over-E"
    assert list(over.figure.data[0].y) == [26.5, 31.0]
    assert len(course.figure.layout.shapes) == 2, "the target's band and its mean"


def test_a_stored_heap_needs_no_preview(run_folder: Path, small_study: Study, cone: Cone) -> None:
    journal = begin(run_folder, small_study, cone)
    Store(run_folder / "cases").save("c" * 64, cone())
    journal.ended("c" * 64, {"status": "finished", "reason": "", "angle": 31.0})
    assert [heap["at_rest"] for heap in RunState.read(run_folder).heaps] == [True, True]
