"""``dem-warp discover``, run as a person runs it on the trial study and its shipped bank."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from experiments.cli import app

TRIAL = Path(__file__).parents[3] / "experiments" / "studies" / "trial"
STUDY = TRIAL / "study.toml"
SHIPPED = TRIAL / "bank-bench.npz"
DATA = Path(__file__).parent / "data"


def discover(*arguments: object) -> tuple[int, str, str]:
    """Run the command at bench scale; return its exit code, standard output and standard error."""
    words = ["discover", str(STUDY), *map(str, arguments), "--scale", "bench", "--device", "cpu"]
    result = CliRunner().invoke(app, words)
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result.exit_code, result.stdout, result.stderr


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("condition,replicate,observable,value\nslow,1,height,0.01\n", "must be a condition of the study"),
        ("condition,replicate,observable,value\nbase,1,height,40\n", "row 2"),
        ("condition,replicate,observable,value,unit\nbase,1,height,12,furlong\n", "furlong"),
        ("condition,replicate,value\nbase,1,0.01\n", "observable"),
    ],
)
def test_data_that_cannot_be_right_end_with_code_2_and_leave_nothing(
    tmp_path: Path, text: str, said: str
) -> None:
    data = tmp_path / "measured.csv"
    data.write_text(text, encoding="utf-8")
    code, out, err = discover(data, "--out", tmp_path / "out")
    assert code == 2
    assert out == ""
    assert "measured.csv" in err
    assert said in err or "measured.csv:2" in err
    assert not (tmp_path / "out").exists()


def test_a_folder_in_use_is_never_written_to(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "mine.txt").write_text("kept", encoding="utf-8")
    code, _, err = discover(DATA / "nothing-missing.csv", "--out", tmp_path / "out")
    assert code == 2
    assert "must be new or empty; --resume goes on in it" in err
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["mine.txt"]


def test_a_file_that_is_no_bank_is_an_error_and_leaves_nothing(tmp_path: Path) -> None:
    code, _, err = discover(DATA / "nothing-missing.csv", "--bank", STUDY, "--out", tmp_path / "out")
    assert code == 2
    assert "must be a bank" in err
    assert not (tmp_path / "out").exists()
