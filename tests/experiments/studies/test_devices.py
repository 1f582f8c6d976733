"""Scripts that are given a device which is not there: an answer, exit code 2, and nothing written."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

ABSENT = "cuda:99"

SCRIPTS = [
    ("experiments.studies.cellulose.__main__", ["run", "--scale", "bench"]),
    ("experiments.studies.wheat_drums.__main__", ["run", "--scale", "bench"]),
    ("experiments.studies.buckwheat.bases.__main__", ["simulate"]),
    ("experiments.studies.buckwheat.sensitivity.__main__", []),
    ("experiments.studies.buckwheat.climb", []),
    ("experiments.benchmarks.outlines.run", ["--out", "out"]),
    ("experiments.verification.__main__", []),
]


@pytest.mark.parametrize(("module", "words"), SCRIPTS)
def test_a_device_that_is_not_there_is_answered_before_anything_is_written(
    module: str, words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    script = import_module(module)
    app = getattr(script, "app", None)
    if app is None:
        app = typer.Typer()
        app.command()(script.main)
    result = CliRunner().invoke(app, [*words, "--device", ABSENT])
    assert result.exit_code == 2
    said = " ".join(result.stderr.replace("│", " ").split())
    assert "--device" in said
    assert f"not {ABSENT}" in said
    assert list(tmp_path.iterdir()) == []
