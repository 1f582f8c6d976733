"""Runs on a disk that is too small, and then grows: a file system in memory, of a chosen size."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from experiments.evidence.robustness.faults.attempt import Attempt, begun, calibrate, content, finished_cases
from experiments.evidence.robustness.faults.kills import differing, lost

ROOM = 64_000
"""Size to which the disk grows [kB]."""

ADVICE = "free some room on the disk"
"""Way out that the message must name."""


@dataclass(frozen=True)
class FullDisk:
    """One run on a disk that was too small."""

    size: int
    """Of the disk [kB]."""
    code: int
    """Exit code; 0: the disk sufficed."""
    kept: int
    """Cases that were finished then."""
    fault: str
    """Rule that the run broke; empty: none."""


def mounted(place: Path) -> None:
    """Make a file system in memory, the only one that this benchmark fills.

    Raises
    ------
    CalledProcessError
        Without the right to mount, which ``unshare --map-root-user --mount`` gives.
    """
    place.mkdir(parents=True, exist_ok=True)
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={ROOM}k", "tmpfs", str(place)], check=True)


def full_disk(place: Path, size: int, expected: Mapping[str, str]) -> FullDisk:
    """Run a campaign on a disk of a size [kB], and let it go on with room enough."""
    said, folder = place.with_suffix(".txt"), place / "out"
    _resize(place, size)
    first = Attempt(calibrate(folder, 1), said).ending()
    before = finished_cases(folder)
    fault = "" if first.is_clear else f"said: {first.said[-300:]}"
    if first.code not in (0, 1, 2) or (first.code and ADVICE not in first.said):
        fault = fault or f"exit {first.code}: {first.said[-300:]}"
    _resize(place, ROOM)
    if first.code:
        last = Attempt(calibrate(folder, 1, begun(folder)), said).ending()
        fault = fault or ("" if last.code == 0 else f"exit {last.code}, resumed: {last.said[-300:]}")
        fault = fault or lost(before, finished_cases(folder))
    fault = fault or differing(expected, content(folder))
    shutil.rmtree(folder, ignore_errors=True)
    return FullDisk(size, first.code, len(before), fault)


def _resize(place: Path, size: int) -> None:
    subprocess.run(["mount", "-o", f"remount,size={size}k", str(place)], check=True)
