"""Cores that a process may use, by its affinity and the control groups of Linux."""

import os
from pathlib import Path

import pytest

from dem_warp import cores


@pytest.mark.parametrize(
    ("files", "allowed"),
    [
        ({}, 8),
        ({"cpu.max": "max 100000"}, 8),
        ({"job/cpu.max": "150000 100000"}, 2),
        ({"job/cpu.max": "max 100000", "cpu.max": "300000 100000"}, 3),
        ({"job/cpu.max": "10000 100000"}, 1),
        ({"cpu/cpu.cfs_quota_us": "400000", "cpu/cpu.cfs_period_us": "100000"}, 4),
        ({"cpu/cpu.cfs_quota_us": "-1", "cpu/cpu.cfs_period_us": "100000"}, 8),
    ],
)
def test_cores_are_those_of_the_affinity_and_the_control_group(
    files: dict[str, str], allowed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(f"{text}\n", encoding="ascii")
    (tmp_path / "own").write_text("0::/job\n", encoding="ascii")
    monkeypatch.setattr(cores, "CGROUP", tmp_path / "own")
    monkeypatch.setattr(cores, "GROUPS", tmp_path)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(8)))
    assert cores.cores() == allowed
