"""The outputs of a folder: all of one study, listed last; one run at a time, and no links."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from experiments.cases import open_folder
from experiments.cases.store.outputs import DRAFTS, LIST, changed_outputs, publishing, sha256_of
from experiments.io.errors import StoreError
from experiments.runs.run_folder import locked
from experiments.studyfile import Study, load_study

WriteStudy = Callable[..., Path]


@pytest.fixture
def other(write_study: WriteStudy) -> Study:
    """Load the small study with another target."""
    return load_study(write_study(("n = 5", "n = 6")))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a folder that a run may make."""
    return tmp_path / "out"


def publish(folder: Path, study: Study, *names: str, **made_from: object) -> None:
    with publishing(folder, study, **made_from) as drafts:
        for name in names:
            (drafts / name).parent.mkdir(parents=True, exist_ok=True)
            (drafts / name).write_text(study.sha256, encoding="utf-8")


def listed(folder: Path) -> dict:
    return json.loads((folder / LIST).read_text(encoding="utf-8"))


def files_of(folder: Path) -> set[str]:
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


def test_every_output_is_listed_with_its_hash_and_its_study(folder: Path, small_study: Study) -> None:
    publish(folder, small_study, "report.html", "tables/cases.csv")
    assert files_of(folder) == {LIST, "report.html", "study.json", "tables/cases.csv"}
    found = listed(folder)
    assert found["made_from"]["study"] == small_study.sha256
    assert found["files"] == {name: sha256_of(folder / name) for name in files_of(folder) - {LIST}}


def test_outputs_of_another_study_are_removed_and_other_files_stay(
    folder: Path, small_study: Study, other: Study
) -> None:
    publish(folder, small_study, "report.html", "material.toml", "old/table.csv")
    (folder / "notes.txt").write_text("mine", encoding="utf-8")
    publish(folder, other, "report.html")
    assert files_of(folder) == {LIST, "notes.txt", "report.html", "study.json"}
    assert not (folder / "old").exists()
    assert (folder / "report.html").read_text(encoding="utf-8") == other.sha256


def test_outputs_of_the_same_study_stay_with_new_ones(folder: Path, small_study: Study) -> None:
    for name in ("report.html", "record/page.md"):
        publish(folder, small_study, name, data="a")
    assert {"report.html", "record/page.md"} < set(listed(folder)["files"])
    publish(folder, small_study, "record/page.md", data="b")
    assert not (folder / "report.html").exists()


def test_a_run_that_stops_leaves_the_earlier_outputs_as_they_were(
    folder: Path, small_study: Study, other: Study
) -> None:
    publish(folder, small_study, "report.html", "material.toml")
    before = {name: sha256_of(folder / name) for name in files_of(folder)}
    assert open_folder(folder, other, resume=True)[1] == ["study.target.n: 5 -> 6"]

    def stop() -> None:
        with publishing(folder, other) as drafts:
            (drafts / "report.html").write_text("half", encoding="utf-8")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        stop()
    assert {name: sha256_of(folder / name) for name in files_of(folder)} == before


def test_a_run_that_stops_between_two_moves_is_put_right_by_the_next(
    folder: Path, small_study: Study, other: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    publish(folder, small_study, "a.txt", "b.txt", "c.txt")
    moves, move = [], Path.replace

    def stop_at_the_second(path: Path, target: Path) -> Path:
        if DRAFTS in path.parts and path.name in ("a.txt", "d.txt"):
            moves.append(path)
            if len(moves) == 2:
                raise KeyboardInterrupt
        return move(path, target)

    with monkeypatch.context() as patch:
        patch.setattr(Path, "replace", stop_at_the_second)
        with pytest.raises(KeyboardInterrupt):
            publish(folder, other, "a.txt", "d.txt")
    # the list says of itself that it is not the last word, and names all that may lie there
    assert listed(folder)["made_from"] == {}
    assert {"a.txt", "b.txt", "c.txt", "d.txt"} < set(listed(folder)["files"])
    publish(folder, small_study, "c.txt")
    assert files_of(folder) == {LIST, "c.txt", "study.json"}


def test_an_output_that_was_changed_is_named(
    folder: Path, small_study: Study, caplog: pytest.LogCaptureFixture
) -> None:
    publish(folder, small_study, "material.toml", "report.html")
    (folder / "material.toml").write_text("my own", encoding="utf-8")
    assert changed_outputs(folder) == ["material.toml"]
    open_folder(folder, small_study, resume=True)
    assert "material.toml has changed since the earlier run" in caplog.text


@pytest.mark.parametrize("name", ["../outside.txt", "/outside.txt", "a/../../outside.txt", ""])
def test_a_list_that_leads_out_of_the_folder_is_refused(
    tmp_path: Path, folder: Path, small_study: Study, name: str
) -> None:
    outside = tmp_path / "outside.txt"
    publish(folder, small_study, "a.txt")
    outside.write_text("mine", encoding="utf-8")
    (folder / LIST).write_text(json.dumps({"made_from": {}, "files": {name: None}}), encoding="utf-8")
    with pytest.raises(StoreError, match="list of files"):
        open_folder(folder, small_study, resume=True)
    with pytest.raises(StoreError, match="list of files"):
        publish(folder, small_study, "a.txt")
    assert outside.read_text(encoding="utf-8") == "mine"


@pytest.mark.parametrize("content", ["", "{}", '{"made_from": {}, "files": {"a": 1}}', "[" * 100_000])
def test_an_invalid_list_is_refused(folder: Path, small_study: Study, content: str) -> None:
    publish(folder, small_study, "a.txt")
    (folder / LIST).write_text(content, encoding="utf-8")
    with pytest.raises(StoreError, match="list of files"):
        open_folder(folder, small_study, resume=True)


def test_a_folder_to_resume_must_be_there(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    for name in ("none", "empty"):
        with (
            pytest.raises(StoreError, match=r"no such folder|the folder is empty"),
            locked(tmp_path / name, True),
        ):
            pass
    assert not (tmp_path / "none").exists()


@pytest.mark.parametrize("link", ["study.json", "cases", "tables/cases.csv", ".lock"])
def test_links_in_a_folder_are_not_followed(
    tmp_path: Path, folder: Path, small_study: Study, link: str
) -> None:
    outside = tmp_path / "outside"
    publish(folder, small_study, "tables/effects.csv")
    outside.mkdir()
    (folder / link).unlink(missing_ok=True)
    (folder / link).symlink_to(outside)
    with pytest.raises(StoreError, match="must hold no links"), locked(folder, resume=True):
        pass
    assert list(outside.iterdir()) == []


@pytest.mark.parametrize("place", ["cases/0a1b.npz", "bank.npz", "tables/effects.csv"])
def test_a_folder_where_a_file_belongs_is_refused_before_anything_runs(
    folder: Path, small_study: Study, place: str
) -> None:
    publish(folder, small_study, "tables/effects.csv")
    (folder / place).unlink(missing_ok=True)
    (folder / place / "mine").mkdir(parents=True)
    with pytest.raises(StoreError) as caught, locked(folder, resume=True):
        open_folder(folder, small_study, resume=True)
    assert caught.value.place == str(folder / place)
    assert caught.value.value == "a folder"
    assert (folder / place / "mine").is_dir()


def test_a_file_where_the_stored_cases_belong_is_refused(folder: Path, small_study: Study) -> None:
    publish(folder, small_study, "report.html")
    (folder / "cases").write_text("mine", encoding="utf-8")
    with pytest.raises(StoreError, match="must be the folder of the stored cases"):
        open_folder(folder, small_study, resume=True)


def test_a_resumed_folder_loses_what_a_killed_run_had_half_written(folder: Path, small_study: Study) -> None:
    with locked(folder):
        open_folder(folder, small_study)
    (folder / "cases").mkdir()
    halves = [folder / ".wall_times.30816.csv", folder / "cases" / ".0a1b.77.npz"]
    others = [folder / ".notes.csv", folder / "wall_times.2.csv"]
    for path in (*halves, *others):
        path.write_text("half", encoding="utf-8")
    with locked(folder, resume=True):
        assert [path.exists() for path in (*halves, *others)] == [False, False, True, True]
