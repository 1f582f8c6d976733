"""The way of a study from the command that calibrates to the engine, traced as it runs.

A step is a call that receives a study, counted once for each pair of functions, in the order of their first
calls, in a calibration at the scale bench whose engine is a stand-in.
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from types import CodeType, FrameType
from typing import Any

from experiments.api import calibrate
from experiments.evidence.house import stand_in
from experiments.evidence.house.counts import PACKAGES, ROOT, Count, heights, imports_between_rooms
from experiments.studyfile import Study, load_study

STUDY = ROOT / "experiments" / "studies" / "buckwheat" / "study.toml"


@cache
def _room(file: str) -> str:
    """Room of a file of this repository; empty for others."""
    path = Path(file)
    if not path.is_relative_to(ROOT):
        return ""
    package, *inside = path.relative_to(ROOT).parts
    return f"{package}.{inside[0].removesuffix('.py')}" if package in PACKAGES else ""


@contextmanager
def _traced(steps: dict[tuple[CodeType | None, CodeType], str]) -> Iterator[None]:
    """Note the room of each step, by the functions that call and that are called."""

    def note(frame: FrameType, event: str, _: Any) -> None:
        code = frame.f_code
        if event != "call" or not _room(code.co_filename):
            return
        names = code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]
        if any(isinstance(frame.f_locals.get(name), Study) for name in names):
            caller = frame.f_back
            while caller is not None and not _room(caller.f_code.co_filename):
                caller = caller.f_back
            steps.setdefault((caller and caller.f_code, code), _room(code.co_filename))

    sys.settrace(note)
    threading.settrace(note)
    try:
        yield
    finally:
        sys.settrace(None)
        threading.settrace(None)  # type: ignore[arg-type]


def rooms_of_a_calibration() -> list[str]:
    """Rooms of all steps, in order."""
    steps: dict[tuple[CodeType | None, CodeType], str] = {}
    words = f'"{sys.executable}" "{stand_in.__file__}"'
    study = load_study(STUDY, "bench", {"measurement": {"azimuths": 2, "pixels": 200}})
    study = study.with_engine({"command": words})
    with TemporaryDirectory() as folder, _traced(steps):
        calibrate(study, Path(folder) / "out", device="cpu", workers=2)
    return list(steps.values())


def walk() -> list[Count]:
    """Count the changes of room, and those to a room on a higher floor."""
    floor = heights(imports_between_rooms("experiments"))
    changes = [pair for pair in pairwise(rooms_of_a_calibration()) if pair[0] != pair[1]]
    climbs = sum(floor.get(above, 0) > floor.get(below, 0) for below, above in changes)
    return [
        Count("calibrate to the engine, changes of room", len(changes), 45),
        Count("calibrate to the engine, climbs", climbs, 12),
    ]
