"""Processes that simulate cases: they stay from call to call, and are replaced when one is lost."""

import multiprocessing
import os
import signal
import subprocess
import sys
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

import pytest
from worlds import SMALL_TUBE, assert_same_result, small_case

from dem_warp import CaseResult, Processes, Progress, simulate
from dem_warp.batch import Batch

CASES = [small_case(seed, replace(SMALL_TUBE, grain_count=4)) for seed in (1, 2)]
CASES.append(small_case(skin=1000.0))  # one that cannot be


@pytest.fixture(scope="module")
def alone() -> list[CaseResult]:
    """Return the results of the cases, each simulated by itself in this process."""
    return [simulate([case], "cpu", 1)[0] for case in CASES]


@dataclass(frozen=True)
class Signature:
    """Callback that leaves a file with the number of each process that simulates."""

    folder: Path

    def __call__(self, batch: Batch) -> None:
        (self.folder / str(os.getpid())).touch()


@dataclass(frozen=True)
class Loss:
    """Callback that kills the simulating process the first n times."""

    folder: Path
    times: int

    def __call__(self, batch: Batch) -> None:
        for number in range(self.times):
            with suppress(FileExistsError):
                (self.folder / str(number)).touch(exist_ok=False)
                os.kill(os.getpid(), signal.SIGKILL)


def signed(folder: Path, processes: Processes) -> set[str]:
    folder.mkdir()
    simulate(CASES, "cpu", processes, on_advance=Signature(folder))
    return {path.name for path in folder.iterdir()}


def test_processes_stay_from_call_to_call_with_the_same_bits_and_end_with_their_block(
    alone: list[CaseResult], tmp_path: Path
) -> None:
    other = multiprocessing.get_context("spawn").Process(target=signal.pause)
    other.start()
    others = set(multiprocessing.active_children())  # those of other tests may end at any time
    seen: list[Progress] = []
    with Processes(2) as processes:
        assert set(multiprocessing.active_children()) <= others
        first, second = (signed(tmp_path / name, processes) for name in ("first", "second"))
        assert len(first | second) <= 2
        again = simulate(CASES[::-1], "cpu", processes, on_progress=seen.append)[::-1]
        # One that is lost between two calls is replaced, and the processes of others are left alone.
        os.kill(int(min(first | second)), signal.SIGKILL)
        assert signed(tmp_path / "third", processes) - (first | second)
    assert set(multiprocessing.active_children()) <= others
    assert other.is_alive()
    other.terminate()
    other.join()
    for one, found in zip(alone, again, strict=True):
        assert_same_result(one, found)
    assert seen[0].total == seen[-1].done == len(CASES)
    assert seen[0].fraction < seen[-1].fraction == 1.0


def test_a_call_whose_processes_are_lost_repeatedly_is_given_up_and_others_go_on_in_another_one(
    alone: list[CaseResult], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("dem_warp.processes.LOSSES", 2)  # each costs a start
    found: dict[int, CaseResult] = {}
    loss = Loss(tmp_path, 3)
    with Processes(1) as processes:
        with pytest.raises(BrokenProcessPool, match="lost repeatedly"):
            processes.run(CASES, found.__setitem__, lambda *_: None, on_advance=loss)
        assert not found
        processes.run(CASES, found.__setitem__, lambda *_: None, on_advance=loss)
    for number, one in enumerate(alone):
        assert_same_result(one, found[number])


@pytest.mark.parametrize(("head", "said"), [("", "needs if __name__ == "), ("__name__\n", "")])
def test_a_script_without_a_guard_is_ended_in_one_sentence(head: str, said: str, tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(f"{head}from dem_warp.processes import require_guard\nrequire_guard()\n")
    run = subprocess.run([sys.executable, script], capture_output=True, text=True)
    assert (run.returncode, run.stderr.count("\n")) == ((1, 1) if said else (0, 0))
    assert said in run.stderr
