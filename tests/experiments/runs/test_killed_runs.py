"""Each command killed at ten points, started twice in one folder, and resumed to the same results."""

import json
import os
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

import numpy as np
import pytest
from commandline import dem_warp
from cone_engine import SEEDS, cone_engine, observe, without_pages

from experiments.cases import execute
from experiments.cases.engines import engines
from experiments.cases.show import heap
from experiments.cases.store.outcome_table import OutcomeTable
from experiments.discover import engine_simulator

KILLS = 10
KILLED = 99
"""Exit code of a process that was killed."""

FEW = """
[campaign.noise_floor]
replicates = 5

[discover]
mechanisms = ["contact_adhesion"]
settings = { bank_points = 40, bank_mechanism_points = 6 }
"""
"""Cases that a campaign and a bank need at least."""


@dataclass
class Command:
    """A command and what must be the same however often it was killed."""

    words: tuple[object, ...]
    results: str
    """File of its results."""
    folder: Path
    whole: Path = field(init=False)
    writes: int = field(init=False)
    """Files that an uninterrupted run puts in place, and rows that it saves."""

    def __post_init__(self) -> None:
        self.whole = self.folder / "whole"
        self.writes = self.run(self.whole)

    def run(self, out: Path, *more: str) -> int:
        """Run it to its end; return how much it has written."""
        with writes_counted() as count:
            code, _, said = dem_warp(*self.words, "--out", out, *more)
        assert code == 0, said
        return count.number

    def kill(self, out: Path, at: int) -> int:
        """Run it in a copy of this process until its write of some number; return its exit code."""
        if (child := os.fork()) == 0:
            with suppress(BaseException), writes_counted(at):
                dem_warp(*self.words, "--out", out)
            os._exit(0)
        return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])

    def found(self, out: Path) -> Any:
        """Read its results."""
        path = out / self.results
        if path.suffix == ".npz":
            with np.load(path) as arrays:
                return {name: arrays[name].tobytes() for name in arrays}
        return json.loads(path.read_text(encoding="utf-8"))


class writes_counted:  # noqa: N801
    """Count what is put in place or saved, and end the process at once before the last that is allowed."""

    def __init__(self, kill_at: int | None = None) -> None:
        self.kill_at, self.number = kill_at, 0

    def __enter__(self) -> Self:
        self.replace, self.save = os.replace, OutcomeTable.save
        os.replace = self.counted(self.replace)  # type: ignore[assignment]
        OutcomeTable.save = self.counted(self.save)  # type: ignore[method-assign]
        return self

    def __exit__(self, *error: object) -> None:
        os.replace, OutcomeTable.save = self.replace, self.save  # type: ignore[assignment,method-assign]

    def counted(self, write: Callable[..., Any]) -> Callable[..., Any]:
        def counting(*arguments: Any, **rest: Any) -> Any:
            # whether progress and speeds are noted depends on the clock
            if Path(str(arguments[1])).name not in ("progress.json", "batches.json"):
                self.number += 1
                if self.number == self.kill_at:
                    os._exit(KILLED)
            return write(*arguments, **rest)

        return counting


@pytest.fixture(scope="module")
def _stand_ins(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Simulate and measure in no time, and write the results without a page."""

    def measure(_: Any, result: Any, names: tuple[str, ...]) -> tuple[np.ndarray, str]:
        return result.observables["truth"] + np.arange(len(names)), ""

    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(engines._DRIVERS, "cones", cone_engine)
        patch.setattr(execute, "observe", observe)
        patch.setattr(execute, "SAVE_EVERY", 0.0)
        patch.setattr(engine_simulator, "measure", measure)
        without_pages(patch)
        patch.setattr(heap, "_write_pictures", lambda *_: None)
        patch.setenv(SEEDS, str(tmp_path_factory.mktemp("seeds") / "seeds.txt"))
        yield


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory, small_text: str) -> Path:
    path = tmp_path_factory.mktemp("study") / "small.toml"
    path.write_text(f"{small_text}{FEW}", encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def _calibrate(_stand_ins: None, study: Path, tmp_path_factory: pytest.TempPathFactory) -> Command:
    words = ("calibrate", study, "--engine", "cones", "--device", "cpu")
    return Command(words, "results.json", tmp_path_factory.mktemp("calibrate"))


@pytest.fixture(scope="module", params=["calibrate", "discover", "bridge", "heap"])
def command(
    request: pytest.FixtureRequest, _calibrate: Command, study: Path, tmp_path_factory: pytest.TempPathFactory
) -> Command:
    if request.param == "calibrate":
        return _calibrate
    cones = ("--engine", "cones")
    words, results = {
        "discover": (("discover", study, *cones, "--device", "cpu"), "bank.npz"),
        "bridge": (("bridge", _calibrate.whole / "material.toml", *cones, "--workers", 1), "bridge.json"),
        "heap": (("heap", study, *cones, "--device", "cpu"), "angle.json"),
    }[request.param]
    return Command(words, results, tmp_path_factory.mktemp(request.param))


def simulated() -> list[str]:
    return Path(os.environ[SEEDS]).read_text(encoding="utf-8").split()


def test_a_run_killed_at_ten_points_is_resumed_to_the_same_results(command: Command, tmp_path: Path) -> None:
    cases = len(list((command.whole / "cases").glob("*.npz")))
    points = {1 + round(number * (command.writes - 1) / (KILLS - 1)) for number in range(KILLS)}
    ends = []
    for kill_at in points:  # fewer where a command writes less often
        out = tmp_path / str(kill_at)
        before = len(simulated())
        ends.append(command.kill(out, kill_at))
        if ends[-1] == KILLED:
            command.run(out, *(["--resume"] if (out / "study.json").is_file() else []))
        assert command.found(out) == command.found(command.whole)
        if cases:  # the case that was being saved is simulated again
            assert cases <= len(simulated()) - before <= cases + 1
    # Numbers that end together are saved at once: a run may write less often than the whole one, and end.
    assert set(ends) <= {KILLED, 0}
    assert ends.count(KILLED) >= len(points) // 2


def test_a_second_run_in_the_folder_is_refused(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    refused = []

    def begin_twice(*arguments: Any, **rest: Any) -> Any:
        if not refused:
            for more in ((), ("--resume",)):
                code, _, said = dem_warp(*command.words, "--out", tmp_path / "out", *more)
                refused.append((code, "another run is using this folder" in said))
        return cone_engine(*arguments, **rest)

    monkeypatch.setitem(engines._DRIVERS, "cones", begin_twice)
    assert dem_warp(*command.words, "--out", tmp_path / "out")[0] == 0
    assert refused == [(2, True)] * 2
