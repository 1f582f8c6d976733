"""Photographs of heaps: angles measured as the simulated ones are, and refused where they were not."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from glob import glob
from pathlib import Path
from typing import TYPE_CHECKING

from experiments.io.errors import InputError, Problem
from imaging import FITS, FitSettings, PictureError

if TYPE_CHECKING:
    from imaging import ReposeAngle

SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp", ".heic", ".heif")
"""Endings of the pictures that are looked for in a folder."""


@dataclass(frozen=True)
class _Stated:
    """Angle of which no more is known than how it was measured, an `imaging.Angle`."""

    fit: FitSettings
    mean: float = math.nan
    se: float = math.nan
    dof: float = math.nan


def require_same_fit(fit: str, own: str, place: str) -> None:
    """Refuse angles of a ``fit``, measured at a ``place``, other than the study's ``own``.

    Raises
    ------
    InputError
        When the two do not compare, or there is no such fit.
    """
    if fit == own and fit in FITS:
        return
    from imaging import compare

    try:
        compare(*(_Stated(FitSettings.of(name)) for name in (fit, own)))
    except PictureError as error:
        raise InputError(place, f"measured and simulated angles must compare: {error}", fit) from None


def find_pictures(pattern: str, folder: Path, place: str) -> list[Path]:
    """Find the pictures that a folder or a pattern as ``photos/*.jpg``, relative to ``folder``, names.

    Raises
    ------
    InputError
        When there are fewer than two.
    """
    named = folder / pattern
    if os.path.isdir(named):  # a name too long is none, and raises nothing
        found = sorted(path for path in named.iterdir() if path.suffix.lower() in SUFFIXES)
    else:
        found = sorted(map(Path, glob(str(named))))
    if len(found) < 2:
        rule = f"must name at least two pictures of heaps (looked for {named})"
        raise InputError(place, rule, f"{pattern}: {len(found)} found")
    return found


def measure_pictures(paths: Sequence[Path], fit: str) -> dict[Path, ReposeAngle]:
    """Measure the repose angle of the heap in each picture; one in doubt is measured too.

    Raises
    ------
    InputError
        With every picture that shows no measurable heap.
    """
    from imaging import measure_photograph

    angles: dict[Path, ReposeAngle] = {}
    problems = []
    for path in paths:
        try:
            angles[path] = measure_photograph(path, fit)
        except PictureError as error:
            problems.append(Problem(str(path), "must show a heap that can be measured", str(error)))
    if problems:
        raise InputError.of(problems)
    return angles
