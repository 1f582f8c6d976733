"""A clump from a file of spheres: one body, in metres, of a size that a grain can have."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dem_warp import ClumpShape
from experiments.grains.spheres.reader import read_spheres
from experiments.io.errors import InputError
from experiments.io.units import UNITS, Quantity

DEFAULT_UNIT = "mm"
"""Unit of a clump's file without a unit."""
GRAIN_SIZES = (1e-4, 0.1)
"""Range of a grain's length [m] without a given unit: it finds metres read as millimetres, or the reverse."""
COMPUTABLE = (1e3, 1e-9)
"""Largest coordinate or radius, and least radius of a sphere [m], whose powers are far from the limits of
floats."""
GAP = 1e-3
"""Gap between touching spheres, over the smaller radius: text files have six digits."""
MOST_SPHERES = 1000
"""Most spheres of a clump; a larger file is a heap."""
LARGEST_CLUMP = 1_000_000
"""Bytes of the largest file of a clump: a line of a thousand characters for each sphere."""


@dataclass(frozen=True)
class ClumpFile:
    """A clump, and how its file was read."""

    shape: ClumpShape
    description: str
    """Format and unit."""


def length_unit(text: str) -> float:
    """Return the size of a unit [m], a name (``mm``) or the length of 1 (``2.5 mm``); raise `ValueError`."""
    name = text.strip()
    if name in UNITS["length"]:
        return UNITS["length"][name]
    try:
        size = Quantity.parse(name).to_base("length")
    except ValueError:
        size = 0.0
    if size <= 0.0:
        units = ", ".join(UNITS["length"])
        raise ValueError(f"must be a unit of length ({units}), or a positive length, e.g. 2.5 mm")
    return size


def unit_option(text: str) -> float:
    """Read the option ``--unit``, see `length_unit`."""
    try:
        return length_unit(text)
    except ValueError as error:
        raise InputError("--unit", str(error), text) from None


def read_clump(path: Path, unit: str | None = None) -> ClumpFile:
    """Read a clump from a file of spheres in a unit (see `length_unit`); default: the file's own, or mm."""
    file, place = read_spheres(path, LARGEST_CLUMP), str(path)
    size, source = _unit(file.unit, unit, place)
    if file.bodies is not None and file.body_count > 1:
        numbers = ", ".join(str(body) for body in np.unique(file.bodies)[:5])
        found = f"{file.body_count} bodies ({numbers}, ...)"
        raise InputError(place, "a clump must be one body", found, "Keep the lines of one body.")
    if len(file.spheres) > MOST_SPHERES:
        raise InputError(place, f"must have at most {MOST_SPHERES} spheres", f"{len(file.spheres)}")
    spheres = file.spheres * size
    check_computable(spheres, place)
    check_one_body(spheres, place)
    if unit is None and file.unit is None:
        length = float(np.max(np.ptp(spheres[:, :3], axis=0) + 2.0 * spheres[:, 3].max()))
        check_grain_size(length, place, f"read in {DEFAULT_UNIT}")
    shape = ClumpShape.from_spheres(spheres[:, :3], spheres[:, 3])
    return ClumpFile(shape, f"{file.description}; unit: {source}")


def _unit(named: float | None, given: str | None, place: str) -> tuple[float, str]:
    """Return the size of the file's unit, and its source."""
    if given is None:
        if named is None:
            return UNITS["length"][DEFAULT_UNIT], f"{DEFAULT_UNIT} (default)"
        return named, f"{_named(named)} (named in the file)"
    size = length_unit(given)
    if named is not None and size != named:
        raise InputError(place, f"the unit must be that of the file, {_named(named)}", given)
    return size, given


def _named(size: float) -> str:
    return next((name for name, each in UNITS["length"].items() if each == size), f"{size:g} m")


def check_computable(spheres: np.ndarray, place: str) -> None:
    """Refuse spheres (n, 4) [m] too far away, too large or too small for floats; raise `InputError`."""
    largest, smallest = COMPUTABLE
    if np.abs(spheres).max() > largest or spheres[:, 3].min() < smallest:
        problem = f"spheres must be within {largest:g} m, with radii of at least {smallest:g} m"
        found = f"{np.abs(spheres).max():.4g} m and {spheres[:, 3].min():.4g} m"
        raise InputError(place, problem, found)


def check_grain_size(length: float, place: str, read_as: str) -> None:
    """Refuse a grain whose length [m] is outside `GRAIN_SIZES`; raise `InputError`."""
    low, high = GRAIN_SIZES
    if not low <= length <= high:
        problem = f"the grain must be {1e3 * low:g} to {1e3 * high:g} mm long"
        found = f"{1e3 * length:.4g} mm, {read_as}"
        raise InputError(place, problem, found, "Give the unit (--unit, clump_unit) of another size.")


def check_one_body(spheres: np.ndarray, place: str) -> None:
    """Refuse spheres (n, 4) in parts that do not touch; raise `InputError`."""
    centers, radii = spheres[:, :3], spheres[:, 3]
    apart = np.linalg.norm(centers[:, None] - centers[None], axis=2)
    reach = radii[:, None] + radii[None] + GAP * np.minimum(radii[:, None], radii[None])
    touching = apart <= reach
    # a graph has as many parts as its Laplacian zeros; that of a chain of 1000 is 1e-5 next to them
    levels = np.linalg.eigvalsh(np.diag(touching.sum(axis=0)) - touching)
    if (parts := np.count_nonzero(levels < 1e-8)) > 1:
        raise InputError(place, "the spheres of a clump must touch", f"{parts} separate parts")
