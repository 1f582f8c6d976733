"""Runs that are killed at random moments, and resumed until they end."""

from __future__ import annotations

import random
import shutil
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from experiments.evidence.robustness.faults.attempt import Attempt, begun, calibrate, content, finished_cases

MOST = 6
"""Kills of one campaign."""

KINDS = ("parent", "parent", "parent", "worker")
"""Processes that are killed: the command itself, or, less often as it takes longer, one of its workers."""


NAMED = 3
"""Files that a fault names; the others are counted."""


@dataclass(frozen=True)
class Kill:
    """One kill, and what came of it."""

    kind: str
    after: float
    """Wall time at which it came [s]."""
    kept: int
    """Cases that were finished then."""
    fault: str
    """Rule that the run broke; empty: none."""


def killed_campaign(
    folder: Path, expected: Mapping[str, str], seconds: float, rng: random.Random
) -> Iterator[Kill]:
    """Run a campaign that takes some seconds, kill it again and again, and let it end.

    The last kill bears the faults that the end shows.
    """
    said = folder.with_suffix(".txt")
    kills: list[Kill] = []
    before: dict[str, tuple[int, int]] = {}
    for _ in range(rng.randint(1, MOST)):
        kind = rng.choice(KINDS)
        workers = 2 if kind == "worker" else rng.choice((1, 2))
        attempt = Attempt(calibrate(folder, workers, begun(folder)), said)
        while kind == "worker" and not attempt.workers and not attempt.wait(0.01):
            pass
        after = rng.uniform(0.0, seconds)
        ended = attempt.wait(after)
        if not ended:
            ended = not _kill(attempt, kind, rng)
        ending = attempt.ending()
        now = finished_cases(folder)
        fault = lost(before, now) or ("" if ending.is_clear else f"said: {ending.said[-300:]}")
        before = now
        if not ended:
            kills.append(Kill(kind, round(after, 2), len(now), fault))
    ending = Attempt(calibrate(folder, rng.choice((1, 2)), begun(folder)), said).ending()
    now = finished_cases(folder)
    fault = lost(before, now) or ("" if ending.code == 0 else f"exit {ending.code}: {ending.said[-300:]}")
    fault = fault or differing(expected, content(folder))
    yield from kills[:-1]
    if kills:
        yield Kill(kills[-1].kind, kills[-1].after, kills[-1].kept, kills[-1].fault or fault)
    elif fault:
        yield Kill("none", 0.0, len(now), fault)
    shutil.rmtree(folder)


def _kill(attempt: Attempt, kind: str, rng: random.Random) -> bool:
    """Kill a command or one of its workers; tell that there was one."""
    targets = attempt.workers if kind == "worker" else [attempt.process]
    if not targets:
        return False
    try:
        attempt.kill(rng.choice(targets))
    except ProcessLookupError:
        return False
    return True


def lost(before: Mapping[str, tuple[int, int]], now: Mapping[str, tuple[int, int]]) -> str:
    """Say which finished case is gone, or was written again."""
    return next((f"case {name} lost or done twice" for name in before if now.get(name) != before[name]), "")


def differing(expected: Mapping[str, str], found: Mapping[str, str]) -> str:
    """Name the files that a run without faults left otherwise; empty: none."""
    names = sorted(name for name in expected.keys() | found.keys() if expected.get(name) != found.get(name))
    shown = ", ".join(names[:NAMED]) + (f" and {len(names) - NAMED} more" if len(names) > NAMED else "")
    return f"other than without faults: {shown}" if names else ""
