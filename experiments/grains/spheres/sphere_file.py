"""Spheres as a file holds them, and what a format does to read them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from experiments.io.errors import InputError
from experiments.io.texts import is_number, number

SPHERE_RULE = "expected a sphere is x y z r: four finite numbers, r > 0"

LARGEST = 500_000_000
"""Bytes of the largest file of spheres that is read: frames of a heap of millions."""


@dataclass(frozen=True)
class SphereFile:
    """Spheres of a file, in its own unit."""

    told: str
    """Format, and which part of the file was taken."""
    spheres: NDArray[np.float64]
    """Centre and radius of each sphere, shape (n, 4)."""
    bodies: NDArray[np.int64] | None = None
    """Number of the body that each sphere belongs to, shape (n,); None where the file does not say."""
    unit: float | None = None
    """Size of its unit of length [m]; None where the file names none."""

    @property
    def body_count(self) -> int:
        """Number of bodies; each sphere is one where the file does not say."""
        return len(self.spheres) if self.bodies is None else len(np.unique(self.bodies))


@dataclass(frozen=True)
class Format:
    """One format of files of spheres."""

    name: str
    """Name in messages."""
    recognises: Callable[[str], bool]
    """Tells by the first 64 kB of a file, as text, that this is the format."""
    read: Callable[[Path], SphereFile]
    """Reads a file of this format; raises `InputError` on what breaks its rules."""


@dataclass(frozen=True)
class Columns:
    """Places of a sphere's numbers in a row."""

    x: int
    y: int
    z: int
    r: int
    is_diameter: bool = False
    """The fourth number is the diameter."""
    body: int | None = None
    """Column of the body's number."""

    def needed(self) -> tuple[int, ...]:
        """Columns that are read."""
        return (self.x, self.y, self.z, self.r, *(() if self.body is None else (self.body,)))


Row = tuple[int, Sequence[str]]
"""Number of a line, and its cells."""


def spheres_of(
    rows: Iterable[Row], columns: Columns, path: Path, delimiter: str | None = None
) -> tuple[NDArray[np.float64], NDArray[np.int64] | None]:
    """Read rows of spheres.

    Returns
    -------
    spheres : (n, 4) array
        Centres and radii in the file's unit.
    bodies : (n,) array or None
        Bodies' numbers; a negative number in the file stands for a sphere of its own.

    Raises
    ------
    InputError
        When a row is too short or a number is none, or there is no row.
    """
    needed = columns.needed()
    values = []
    for line, cells in rows:
        if len(cells) <= max(needed) or not all(is_number(cells[column], delimiter) for column in needed):
            raise InputError(f"{path}, line {line}", SPHERE_RULE, " ".join(cells))
        row = [number(cells[column]) for column in needed]
        if not np.isfinite(row).all() or row[3] <= 0.0:
            raise InputError(f"{path}, line {line}", SPHERE_RULE, " ".join(cells))
        values.append(row)
    if not values:
        raise InputError(str(path), "needs at least one sphere (x y z r)", "none")
    table = np.array(values)
    spheres = table[:, :4] * np.array([1.0, 1.0, 1.0, 0.5 if columns.is_diameter else 1.0])
    return spheres, None if columns.body is None else own_bodies(table[:, 4])


def own_bodies(numbers: NDArray[np.float64]) -> NDArray[np.int64]:
    """Number bodies; each negative number stands for a body of its own."""
    bodies = np.rint(numbers).astype(np.int64)
    alone = bodies < 0
    bodies[alone] = bodies.max(initial=0) + 1 + np.arange(np.count_nonzero(alone))
    return bodies


def content_lines(text: str) -> list[tuple[int, str]]:
    """Lines that are not empty, without ``#`` comments, and their numbers."""
    lines = ((n, line.partition("#")[0].strip()) for n, line in enumerate(text.splitlines(), start=1))
    return [(n, line) for n, line in lines if line]
