"""The way of a study from the command that calibrates to the kernel, traced as it runs.

A step is a call that hands a study on, counted once for each pair of functions: of a calibration at the scale
bench whose engine is a stand-in. Members of the study itself are no steps.
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from types import CodeType, FrameType

from experiments.api import calibrate
from experiments.evidence.house import stand_in
from experiments.evidence.house.counts import PACKAGES, ROOT, Count, heights, imports_between_rooms
from experiments.studies.default import BUCKWHEAT
from experiments.studyfile import Study

Step = tuple[str, str]
"""Rooms of a call: of the function that calls, and of the one that is called."""


@cache
def _room(code: CodeType) -> str:
    """Room of a function of this repository; empty for others."""
    path = Path(code.co_filename)
    if not path.is_relative_to(ROOT):
        return ""
    package, *inside = path.relative_to(ROOT).parts
    return f"{package}.{inside[0].removesuffix('.py')}" if package in PACKAGES else ""


def _hands_a_study_on(frame: FrameType) -> bool:
    code = frame.f_code
    names = code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]
    first = frame.f_locals.get(names[0]) if names else None
    return not isinstance(first, Study) or names[0] != "self"
