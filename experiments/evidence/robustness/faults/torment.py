"""Campaigns whose parent, worker, scheduler or client is killed at random moments, and which go on."""

from __future__ import annotations

import os
import random
import shutil
import signal
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from experiments.evidence.robustness.faults.attempt import (
    Attempt,
    Command,
    begun,
    calibrate,
    content,
    finished_cases,
)
from experiments.evidence.robustness.faults.kills import Kill, differing, lost
from experiments.evidence.robustness.faults.lasting import Cluster, Resident

MOST = 6
"""Kills of one campaign."""


@dataclass(frozen=True)
class Victim:
    """A process that is killed, and a run that feels it."""

    start: Callable[[Path, Path], Command]
    """Begins a campaign in a folder, or goes on in it; its messages go to a file."""
    target: Callable[[Command], Command | int | None]
    """Names the process to be killed; None: there is none now."""
    mend: Callable[[], None] = lambda: None
    """Starts anew what was killed, where the run does not."""
    run_goes_on: bool = False
    """The run itself must survive the kill."""


def victims(resident: Resident, lasting: Cluster, mortal: Cluster, rng: random.Random) -> dict[str, Victim]:
    """All kinds of kills by their names."""

    def alone(folder: Path, said: Path) -> Command:
        return Attempt(calibrate(folder, rng.choice((1, 2)), begun(folder)), said)

    def in_resident(folder: Path, said: Path) -> Command:
        return resident.run(calibrate(folder, 2, begun(folder)), said)

    def on(cluster: Cluster) -> Callable[[Path, Path], Command]:
        return lambda folder, said: Attempt(calibrate(folder, cluster.address, begun(folder)), said)

    def worker_of(run: Command) -> int | None:
        return rng.choice(run.workers or [None])

    return {
        "parent": Victim(alone, lambda run: run),
        "worker": Victim(in_resident, worker_of),
        "client": Victim(on(lasting), lambda run: run),
        "scheduler": Victim(on(mortal), lambda run: mortal.scheduler, mortal.restart),
        "worker of a scheduler": Victim(on(mortal), lambda run: mortal.worker, mortal.replace_worker, True),
    }


def tormented(
    folder: Path, kind: str, victim: Victim, expected: Mapping[str, str], seconds: float, rng: random.Random
) -> tuple[list[Kill], str]:
    """Run a campaign that takes some seconds, kill again and again, and let it end.

    Returns
    -------
    list of Kill
        All kills.
    str
        Rule that the end breaks; empty: none.
    """
    said, kills, run = folder.with_suffix(".txt"), [], None
    before: dict[str, tuple[int, int]] = {}
    for _ in range(rng.randint(1, MOST)):
        run = run or victim.start(folder, said)
        after = rng.uniform(0.0, seconds)
        killed, ended = False, run.wait(after)
        while not ended and not (killed := _killed(victim.target(run))):
            ended = run.wait(0.01)
        if killed:
            victim.mend()
        now, fault = finished_cases(folder), ""
        if not (killed and victim.run_goes_on):
            ending, run = run.ending(), None
            now = finished_cases(folder)
            if not ending.is_clear or (ending.code != 0 and not killed):
                fault = f"exit {ending.code}: {ending.said[-300:]}"
        fault = lost(before, now) or fault
        before = now
        if killed:
            kills.append(Kill(kind, round(after, 2), len(now), fault))
        elif fault:
            return kills, fault
    ending = (run or victim.start(folder, said)).ending()
    if kills and victim.run_goes_on and ending.code and ending.is_clear:
        # a case that loses one worker after another is given up in words: the run that goes on must end
        ending = victim.start(folder, said).ending()
    fault = lost(before, finished_cases(folder))
    fault = fault or ("" if ending.code == 0 else f"exit {ending.code}: {ending.said[-300:]}")
    fault = fault or differing(expected, content(folder))
    if not fault:
        shutil.rmtree(folder)
    return kills, fault


def _killed(target: Command | int | None) -> bool:
    """Kill a process without a word; tell that there was one."""
    if target is None or (isinstance(target, Command) and target.has_ended()):
        return False
    try:
        os.kill(target.process if isinstance(target, Command) else target, signal.SIGKILL)
    except ProcessLookupError:
        return False
    return True
