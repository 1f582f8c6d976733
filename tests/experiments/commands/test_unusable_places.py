"""Places that results cannot go to: each command ends with 2 before it works, and leaves nothing."""

import errno
import os
from pathlib import Path

import pytest
from commandline import refused

from experiments.io.errors import InputError
from experiments.io.files import require_folder, require_new_file

STUDY = Path(__file__).parents[1] / "small.toml"

COMMANDS = {
    "calibrate": ("calibrate", STUDY, "--device", "cpu", "--out"),
    "heap": ("heap", STUDY, "--device", "cpu", "--out"),
    "export": ("export", STUDY, "--to", "liggghts", "--approximate", "--out"),
    "clump": ("clump", "sphere:3", "--spheres", "1", "--out"),
    "picture": ("clump", "sphere:3", "--spheres", "1", "--picture"),
}

LONG = "x" * 300
"""Longer than the name of a file may be on the usual systems, 255."""


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("place", ["a-file/below.png", f"{LONG}.png", f"new/{LONG}.png", "a-file"])
def test_a_place_that_cannot_be_made_ends_with_2(
    command: str, place: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a-file").write_text("mine", encoding="utf-8")
    assert place[:20] in refused(*COMMANDS[command], place).replace(" ", "")
    assert os.listdir() == ["a-file"]
    assert Path("a-file").read_text(encoding="utf-8") == "mine"


@pytest.mark.parametrize("command", ["heap", "calibrate"])
def test_a_link_that_leads_nowhere_is_said_to_be_one(command: str, tmp_path: Path) -> None:
    (tmp_path / "out").symlink_to(tmp_path / "gone")
    said = refused(command, STUDY, "--device", "cpu", "--out", tmp_path / "out")
    assert ", got a broken link" in said
    assert not (tmp_path / "gone").exists()


@pytest.mark.parametrize("command", COMMANDS)
def test_a_folder_that_is_only_read_ends_with_2(command: str, tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    if os.access(tmp_path, os.W_OK):
        pytest.skip("root, and Windows, write there all the same")
    said = refused(*COMMANDS[command], tmp_path / "new.png")
    tmp_path.chmod(0o700)
    assert "Permission denied" in said


def test_a_place_that_serves_is_left_as_it_was(tmp_path: Path) -> None:
    (tmp_path / "here").mkdir()
    require_folder(tmp_path / "here")
    require_folder(tmp_path / "new" / "folder")
    require_new_file(tmp_path / "other" / "file.txt", "a file")
    assert [str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*")] == ["here"]


@pytest.mark.parametrize(
    ("number", "kind"), [(errno.ENOSPC, OSError), (errno.EROFS, InputError), (errno.EACCES, InputError)]
)
def test_a_full_disk_is_no_bad_input(
    number: int, kind: type[Exception], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(path: Path) -> None:
        raise OSError(number, os.strerror(number), str(path))

    monkeypatch.setattr(Path, "touch", fails)
    with pytest.raises(kind, match=f"(?i){os.strerror(number)}"):
        require_folder(tmp_path / "new")
    assert os.listdir(tmp_path) == []
