"""Spheres of a file, and the interface of a format."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from experiments.io.errors import InputError
from experiments.io.files import check_lines
from experiments.io.texts import is_number, number, read_text

SPHERE_RULE = "a sphere must be x y z r: four finite numbers, r > 0"

TYPES = (
    "type", "types", "atomtype", "particletype", "speciestype", "species", "matid", "materialid", "material",
    "typelabel", "element",
)  # fmt: skip
"""Names of a type's column or array, in lower case without marks."""
LARGEST = 500_000_000
"""Size of the largest file of spheres that is read [bytes]: many frames of a heap."""
MOST = 1_500_000
"""Most spheres of a frame, and lines of a text of one frame."""
MANY = "Write the grains of the heap alone, and one frame."
"""Hint for a file of more."""


@dataclass(frozen=True)
class SphereFile:
    """Spheres of a file, in its own unit."""

    description: str
    """Format, and the part of the file that was read."""
    spheres: NDArray[np.float64]
    """Centre and radius of each sphere, shape (n, 4)."""
    bodies: NDArray[np.int64] | None = None
    """Number of each sphere's body, shape (n,); None where the file has no bodies."""
    unit: float | None = None
    """Size of its unit of length [m]; None where the file has no unit."""
    types: NDArray[np.str_] | None = None
    """Type of each sphere (material, species), shape (n,); None where the file has no types."""

    @property
    def body_count(self) -> int:
        """Number of bodies; without bodies, each sphere is one."""
        return len(self.spheres) if self.bodies is None else len(np.unique(self.bodies))

    @property
    def type_counts(self) -> dict[str, int]:
        """Number of spheres of each type, in the order of names; empty without types."""
        names, counts = np.unique([] if self.types is None else self.types, return_counts=True)
        return {str(name): int(count) for name, count in zip(names, counts, strict=True)}

    def chosen(self, kept: NDArray[np.bool_]) -> SphereFile:
        """Return the file with some of its spheres (n,) only."""
        bodies = None if self.bodies is None else self.bodies[kept]
        types = None if self.types is None else self.types[kept]
        return replace(self, spheres=self.spheres[kept], bodies=bodies, types=types)

    def of_types(self, types: Collection[str], place: str) -> SphereFile:
        """Return the file with the spheres of some types only; raise `InputError` for an unknown one."""
        known = self.type_counts
        if unknown := [name for name in types if name not in known]:
            listed = ", ".join(f"{name} ({count} spheres)" for name, count in known.items())
            raise InputError(place, f"must be a type of the file: {listed or 'it has none'}", unknown[0])
        return self.chosen(np.isin(self.types, list(types))) if self.types is not None and types else self


@dataclass(frozen=True)
class Format:
    """One format of files of spheres."""

    name: str
    """Name in messages."""
    recognises: Callable[[str], bool]
    """Returns True if the first 64 kB of a file, as text, have this format."""
    read: Callable[[Path], SphereFile]
    """Reads a file of this format; raises `InputError` for an invalid one."""


@dataclass(frozen=True)
class Columns:
    """Columns of a sphere's numbers."""

    x: int
    y: int
    z: int
    r: int
    is_diameter: bool = False
    """True where `r` is the column of the diameter."""
    body: int | None = None
    """Column of the body's number."""
    type: int | None = None
    """Column of the type."""

    def needed(self) -> tuple[int, ...]:
        """Return the columns of numbers that are read."""
        return (self.x, self.y, self.z, self.r, *(() if self.body is None else (self.body,)))


Row = tuple[int, Sequence[str]]
"""Number of a line, and its cells."""


def spheres_of(
    description: str,
    rows: Iterable[Row],
    columns: Columns,
    path: Path,
    delimiter: str | None = None,
    kind: str = "line",
) -> SphereFile:
    """Read rows of spheres with their bodies and types; errors name a row by its `kind`."""
    needed = columns.needed()
    values, types = [], []
    for line, cells in rows:
        valid = len(cells) > max(needed) and all(is_number(cells[column], delimiter) for column in needed)
        row = [number(cells[column]) for column in needed] if valid else [np.nan] * 4
        if not np.isfinite(row).all() or row[3] <= 0.0:
            raise InputError(f"{path}, {kind} {line}", SPHERE_RULE, " ".join(cells))
        values.append(row)
        if len(values) > MOST:
            raise InputError(str(path), f"must have at most {MOST:,} spheres", "more", MANY)
        if columns.type is not None:
            types.append(_type_name(cells[columns.type]) if len(cells) > columns.type else "")
    if not values:
        raise InputError(str(path), "has no spheres (x y z r)")
    table = np.array(values)
    spheres = table[:, :4] * np.array([1.0, 1.0, 1.0, 0.5 if columns.is_diameter else 1.0])
    bodies = None if columns.body is None else own_bodies(table[:, 4])
    return SphereFile(description, spheres, bodies, types=np.array(types) if types else None)


def text_of(path: Path, frames: int = 1) -> str:
    """Read a text with lines for at most `frames` times `MOST` spheres; see `read_text`."""
    check_lines(path, frames * MOST, MANY)
    return read_text(path, LARGEST)


def _type_name(cell: str) -> str:
    """Return the name of a type: 1 for 1.0, which tables of numbers have."""
    return f"{number(cell):g}" if is_number(cell) else cell


def own_bodies(numbers: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return whole numbers of bodies; each negative number becomes a separate body."""
    bodies = np.rint(numbers).astype(np.int64)
    alone = bodies < 0
    bodies[alone] = bodies.max(initial=0) + 1 + np.arange(np.count_nonzero(alone))
    return bodies


def content_lines(text: str) -> list[tuple[int, str]]:
    """Return lines that are not empty, without ``#`` comments and lines of ``%``, with their numbers."""
    lines = ((n, line.partition("#")[0].strip()) for n, line in enumerate(text.splitlines(), start=1))
    return [(n, line) for n, line in lines if line and not line.startswith("%")]
