"""Cores that a process may use."""

import math
import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

CGROUP, GROUPS = Path("/proc/self/cgroup"), Path("/sys/fs/cgroup")
"""The control group of this process on Linux, and the folder of all of them."""


def cores() -> int:
    """Count the cores that this process may use: by its affinity, and by the quota of its control group."""
    allowed = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, min(allowed, math.ceil(min(_quotas(), default=allowed))))


def _quotas() -> Iterator[float]:
    """Yield the cores that the control groups of this process allow, in both versions of Linux's groups."""
    with suppress(OSError):
        own = CGROUP.read_text(encoding="ascii").partition("0::/")[2].strip()
        for folder in (GROUPS / own, *(GROUPS / own).parents):
            with suppress(OSError, ValueError):
                yield _share((folder / "cpu.max").read_text(encoding="ascii"))
    with suppress(OSError, ValueError):
        files = (GROUPS / f"cpu/cpu.cfs_{name}_us" for name in ("quota", "period"))
        if (share := _share(" ".join(file.read_text(encoding="ascii") for file in files))) > 0.0:
            yield share


def _share(text: str) -> float:
    quota, period = text.split()
    return int(quota) / int(period)
