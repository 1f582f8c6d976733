"""Errors of the machine, signals and strange names: each ends in a message, an exit code and a way out."""

import errno
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import pytest
from typer.testing import CliRunner

from experiments.cli import app
from experiments.commands.console import Attempt, plain
from experiments.io.toml_files import read_toml, toml_text
from experiments.runs import calibration, one_heap, run_folder

WriteStudy = Callable[..., Path]


@pytest.fixture
def calibrate(
    write_study: WriteStudy, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Callable[..., tuple[int, str]]:
    """Run ``dem-warp calibrate`` with a campaign of our own: exit code and messages."""

    def run(campaign: Callable[..., object], out: str = "out") -> tuple[int, str]:
        monkeypatch.chdir(tmp_path)
        monkeypatch.setattr(calibration, "run_campaign", campaign)
        words = ["calibrate", str(write_study()), "--device", "cpu", "--out", out]
        result = CliRunner().invoke(app, words)
        assert result.exception is None or isinstance(result.exception, SystemExit)
        return result.exit_code, result.stderr

    return run


def raising(error: BaseException) -> Callable[..., object]:
    def run(*_: object, **__: object) -> object:
        raise error

    return run


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (OSError(errno.ENOSPC, "No space left on device", "out/report.html"), "free some room on the disk"),
        (PermissionError(errno.EACCES, "Permission denied", "out/report.html"), "check the permissions"),
        (
            FileNotFoundError(errno.ENOENT, "No such file or directory", "out/x"),
            "nothing is moved or removed",
        ),
        (BrokenProcessPool("a worker died"), "a process was ended from outside"),
        (MemoryError(), "there is not enough memory"),
    ],
)
def test_errors_of_the_machine_say_the_way_out(
    calibrate: Callable[..., tuple[int, str]], error: BaseException, said: str
) -> None:
    code, err = calibrate(raising(error))
    assert code == 1
    assert said in err
    assert str(getattr(error, "filename", None) or "") in err
    assert "Resume with: dem-warp calibrate" in err
    assert "Traceback" not in err


def test_sigterm_ends_as_ctrl_c_does(calibrate: Callable[..., tuple[int, str]]) -> None:
    before = signal.getsignal(signal.SIGTERM)
    code, err = calibrate(lambda *_, **__: os.kill(os.getpid(), signal.SIGTERM))
    assert code == 143
    assert "Ended by SIGTERM. Resume with: dem-warp calibrate" in err
    assert signal.getsignal(signal.SIGTERM) is before


def test_before_there_is_a_folder_a_command_begins_again(
    calibrate: Callable[..., tuple[int, str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run_folder, "locked", raising(KeyboardInterrupt()))
    code, err = calibrate(raising(AssertionError()))
    assert code == 130
    assert "Begin again with: dem-warp calibrate" in err
    assert "--resume" not in err


@pytest.mark.parametrize(
    ("ending", "ended", "said"),
    [(signal.SIGTERM, 143, "Ended by SIGTERM."), (signal.SIGINT, 130, "Interrupted.")],
)
def test_a_heap_that_is_ended_says_how_to_continue(
    write_study: WriteStudy,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    ending: signal.Signals,
    ended: int,
    said: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(one_heap, "simulate_heap", lambda *_: os.kill(os.getpid(), ending))
    # what a test is started from may ignore Ctrl-C
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    study = write_study().rename(tmp_path / "my wheat.toml")
    words = [study.name, "--out", "my heap", "--set", "E=0.5", "--seed", "3", "--device", "cpu", "--json"]
    again = "dem-warp heap 'my wheat.toml' --out 'my heap' --device cpu --set E=0.5 --seed 3 --json --resume"
    for more in ([], ["--resume"]):
        result = CliRunner().invoke(app, ["heap", *words, *more])
        assert (result.exit_code, f"{said} Resume with: {again}\n" in result.stderr) == (ended, True)
    signal.signal(signal.SIGINT, before)


def test_an_option_with_several_values_is_repeated() -> None:
    attempt = Attempt.of("heap", None, out=Path("out"), set=["E=0.5", "F=40 deg"], scene=None)
    assert attempt.command == "dem-warp heap --out out --set E=0.5 --set 'F=40 deg'"


@pytest.mark.parametrize("out", ["x[/x]", "[bold]", "a\x1b[31mb", "a\u202eb"])
def test_a_strange_folder_is_named_as_it_is(calibrate: Callable[..., tuple[int, str]], out: str) -> None:
    code, err = calibrate(raising(KeyboardInterrupt()), out)
    assert code == 130
    assert plain(out) in err
    assert "\x1b" not in err
    assert "\u202e" not in err


def test_control_characters_of_a_study_never_reach_the_terminal(
    write_study: WriteStudy, tmp_path: Path
) -> None:
    path = write_study(('name = "Small"', 'name = "\\u001b]0;owned\\u0007"\nnote = "\\u009b31m"'))
    words = ["heap", str(path), "--device", "cpu", "--set", "\x1b[2JE=0.3", "--out", str(tmp_path / "out")]
    result = CliRunner().invoke(app, words)
    assert result.exit_code == 2
    assert not {"\x1b", "\x07", "\x9b"} & set(result.output)


def test_any_text_is_written_as_toml(tmp_path: Path) -> None:
    document = {"name": "".join(map(chr, range(0x250))), "a\x7fb": {"c": "\u202e\x7f"}}
    path = tmp_path / "any.toml"
    path.write_text(toml_text(document), encoding="utf-8")
    assert read_toml(path)[1] == document


def test_a_command_that_a_scheduler_ends_leaves_no_process(write_study: WriteStudy, tmp_path: Path) -> None:
    study = write_study(("grain_count = 30", 'grain_count = 30\nduration = "3600 s"'))
    program = "from experiments.cli import main; main()"
    words = ["calibrate", study, "--device", "cpu", "--workers", 2, "--out", tmp_path / "out"]
    environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
    with subprocess.Popen(
        [sys.executable, "-c", program, *map(str, words)],
        stderr=subprocess.PIPE, text=True, env=environment, start_new_session=True,
    ) as process:  # fmt: skip
        assert process.stderr is not None
        for line in process.stderr:
            if "%" in line:  # cases run
                os.killpg(process.pid, signal.SIGTERM)
                break
        # the end comes when no process has the pipe any more
        rest = process.stderr.read()
        assert process.wait(120) == 143
    assert "Resume with: dem-warp calibrate" in rest
    assert "Traceback" not in rest
