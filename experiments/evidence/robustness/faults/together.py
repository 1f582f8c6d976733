"""Two campaigns in one folder at once."""

from __future__ import annotations

import random
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from experiments.evidence.robustness.faults.attempt import Attempt, begun, calibrate, content, finished_cases
from experiments.evidence.robustness.faults.kills import differing, lost

REFUSED = 2
"""Exit code of a command that bad input ends."""


@dataclass(frozen=True)
class Together:
    """Two campaigns that met in a folder."""

    later: float
    """Time by which the second began after the first [s]."""
    codes: str
    """Exit codes of both."""
    fault: str
    """Rule that they broke; empty: none."""


def two_campaigns(folder: Path, expected: Mapping[str, str], seconds: float, rng: random.Random) -> Together:
    """Begin a campaign, begin it again while it runs, kill the first half of the times, and let it end."""
    first_said, second_said = folder.with_suffix(".1.txt"), folder.with_suffix(".2.txt")
    later = rng.uniform(0.0, 0.6 * seconds)
    first = Attempt(calibrate(folder, 1), first_said)
    first.wait(later)
    second = Attempt(calibrate(folder, 1, begun(folder)), second_said)
    if rng.random() < 0.5 and not first.wait(rng.uniform(0.0, 0.5 * seconds)):
        first.kill()
    endings = [first.ending(), second.ending()]
    codes = [ending.code for ending in endings]
    unclear = next((ending.said[-300:] for ending in endings if not ending.is_clear), "")
    before = finished_cases(folder)
    if 0 not in codes:
        endings.append(Attempt(calibrate(folder, 1, begun(folder)), first_said).ending())
    fault = unclear and f"said: {unclear}"
    if codes == [0, 0]:
        fault = fault or "both ran"
    elif REFUSED not in codes and 0 not in codes:
        fault = fault or f"neither refused nor ended: {endings[-1].said[-300:]}"
    elif endings[-1].code != 0 and 0 not in codes:
        fault = fault or f"exit {endings[-1].code}, resumed: {endings[-1].said[-300:]}"
    fault = fault or lost(before, finished_cases(folder)) or differing(expected, content(folder))
    shutil.rmtree(folder, ignore_errors=True)
    return Together(round(later, 2), " ".join(map(str, codes)), fault)
