"""Scripts that are given a device which is not there, or a file for a folder: an answer, nothing written."""

from importlib import import_module
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

ABSENT = "cuda:99"

SCRIPTS = [
    ("experiments.evidence.studies.cellulose.__main__", ["run", "--scale", "bench"]),
    ("experiments.evidence.studies.wheat.__main__", ["run", "--scale", "bench"]),
    ("experiments.evidence.verification.__main__", []),
]


def run(module: str, words: list[str]) -> tuple[int, str]:
    """Run a script; return its exit code, and what it says of an error."""
    script = import_module(module)
    app = getattr(script, "app", None)
    if app is None:
        app = typer.Typer()
        app.command()(script.main)
    result = CliRunner().invoke(app, words)
    return result.exit_code, result.stderr


@pytest.mark.parametrize(("module", "words"), SCRIPTS[:2])
def test_a_folder_that_is_a_file_is_refused_before_anything_runs(
    module: str, words: list[str], tmp_path: Path
) -> None:
    (tmp_path / "file").write_text("mine", encoding="utf-8")
    code, err = run(module, [*words, "--device", "cpu", "--out", str(tmp_path / "file")])
    assert code == 2
    assert str(tmp_path / "file") in err
    assert (tmp_path / "file").read_text(encoding="utf-8") == "mine"


@pytest.mark.parametrize(("module", "words"), SCRIPTS)
def test_a_device_that_is_not_there_is_answered_before_anything_is_written(
    module: str, words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    code, err = run(module, [*words, "--device", ABSENT])
    assert code == 2
    said = " ".join(err.replace("│", " ").split())
    assert "--device" in said
    assert f"got '{ABSENT}'" in said
    assert list(tmp_path.iterdir()) == []
