"""``dem-warp discover``, run as a person runs it on the trial study and its shipped bank."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from experiments import api
from experiments.cli import app
from experiments.discover import devices
from experiments.discover.outcome_table import OutcomeTable
from experiments.discover.wave import WaveRunner
from experiments.measurement.observables import PHOTOGRAPHED
from experiments.report.discovery import Terms
from experiments.runs.campaign import check_runs
from experiments.runs.search import OUTCOMES, Job, SearchResult, run_search
from experiments.studyfile import load_study

TRIAL = Path(__file__).parents[3] / "experiments" / "studies" / "trial"
STUDY = TRIAL / "study.toml"
DATA = Path(__file__).parent / "data"


def discover(*arguments: object, device: str = "cpu") -> tuple[int, str, str]:
    """Run the command at bench scale; return its exit code, standard output and standard error."""
    words = ["discover", str(STUDY), *map(str, arguments), "--scale", "bench", "--device", device]
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


@pytest.fixture
def two_gpus(monkeypatch: pytest.MonkeyPatch) -> None:
    """A machine with two GPUs, as far as names go."""
    known = ["cpu", "cuda:0", "cuda:1"]

    def resolve(name: str | None) -> str:
        name = {None: "cuda:0", "cuda": "cuda:0"}.get(name, name)
        if name not in known:
            raise ValueError(f"device: must be one of {known}, got {name!r}")
        return name

    monkeypatch.setattr(devices, "resolve_device", resolve)


@pytest.mark.usefixtures("two_gpus")
@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ("cuda:0,cuda:2", "must be one of"),
        ("cuda:0,", "must be one of"),
        ("cuda,cuda:0", "must name each device once"),
        ("cpu,cuda:0", "must be the CPU alone or GPUs only"),
    ],
)
def test_devices_that_cannot_work_together_end_with_code_2(tmp_path: Path, asked: str, said: str) -> None:
    out = tmp_path / "out"
    code, _, err = discover(DATA / "nothing-missing.csv", "--out", out, device=asked)
    assert code == 2
    assert "--device" in err
    assert said in err
    assert asked in err
    assert not out.exists()


@pytest.mark.usefixtures("two_gpus")
def test_a_wave_is_spread_over_the_devices_that_are_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[str | None] = []

    def note(job: Job, *_: object) -> SearchResult:
        asked.append(job.device)
        return SearchResult(None, Terms({}, {}, {}), job.folder)

    monkeypatch.setattr(api, "run_search", note)
    code, _, err = discover(DATA / "nothing-missing.csv", "--out", tmp_path / "out", device="cuda, cuda:1")
    assert (code, asked) == (0, ["cuda:0,cuda:1"])
    assert "on cuda:0,cuda:1" in err
    study = load_study(STUDY, "bench")
    runner = WaveRunner(study.measurement, OutcomeTable(tmp_path / "outcomes.sqlite"), asked[0], drivers=4)
    assert runner.drivers == ["cuda:0", "cuda:1", "cuda:0", "cuda:1"]


def test_heaps_that_lack_nothing_raise_no_alarm_with_a_balance_or_photographs_only(tmp_path: Path) -> None:
    out = tmp_path / "out"
    code, said, err = discover(DATA / "nothing-missing.csv", "--out", out)
    assert (code, said) == (0, "")
    assert "Nothing is missing that these data could show. " in err
    files = [".lock", "files.json", "report.html", "results.json", "settings.json", "study.json", "tables"]
    assert sorted(path.name for path in out.iterdir() if path.name != OUTCOMES) == files
    code, said, _ = discover(
        DATA / "nothing-missing.csv", "--out", out, "--resume", "--photographs-only", "--json"
    )
    found = json.loads(said)
    assert code == 0
    assert found["discovery"]["verdict"] == "none"
    # Only what a photograph shows is left.
    means = np.array(found["discovery"]["data"]["means"], dtype=float)
    assert np.isfinite(means).sum(axis=1).tolist() == [len(PHOTOGRAPHED)] * len(means)


def test_a_tilted_plate_is_found_on_the_real_engine(tmp_path: Path) -> None:
    # Fewer fresh runs than the study's own: the tilt is many standard errors.
    few = {"refinement_points": 2, "refinement_rounds": 1, "shortlist": 1, "direct_runs": 2}
    study = load_study(STUDY, "bench", {"discover": {"settings": few}})
    ended = run_search(Job(study, TRIAL / "tilted-bench.csv", tmp_path / "out", device="cpu"))
    found = ended.discovery
    assert found is not None
    assert found.named == ("plate_tilt",)
    assert found.chosen is not None
    [size] = found.chosen.sizes
    # Hidden: 5 degrees. Half a 90 % interval is 1.64 standard errors, so its full width holds 99.9 %.
    width = size.high - size.low
    assert size.value - width < 5.0 < size.value + width
    # The trial's companion sets the truth beside.
    assert "What was hidden" in ended.page.read_text(encoding="utf-8")
    training, held_out = found.before_after
    assert training.after.value < training.before.value
    assert held_out.after.value < held_out.before.value
    again = load_study(tmp_path / "out" / "study-with-plate_tilt.toml")
    check_runs(again)
    assert again.factors[-1].name == "plate_tilt"
