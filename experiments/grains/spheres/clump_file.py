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
"""Unit of a clump's file that names none."""
GRAIN_SIZES = (1e-4, 0.1)
"""Sizes [m] between which a grain's length lies unless a person names the unit: metres taken for millimetres,
or the reverse, end far outside."""
COMPUTABLE = (1e3, 1e-9)
"""Farthest place or largest radius, and least radius of a sphere [m], whatever its unit: far from the ends of
floats when cubed and squared."""
GAP = 1e-3
"""Gap between spheres that touch, over the smaller radius: text files hold six digits."""
MOST_SPHERES = 1000
"""Spheres of a clump: beyond, the file holds a heap."""


@dataclass(frozen=True)
class ClumpFile:
    """A clump, and how its file was read."""

    shape: ClumpShape
    """The clump."""
    told: str
    """Format and unit, in words."""


def length_unit(text: str) -> float:
    """Size of a unit of length [m]: its name (``mm``), or a length that is 1 in a file (``2.5 mm``).

    Raises
    ------
    ValueError
        When the text is neither.
    """
    name = text.strip()
    if name in UNITS["length"]:
        return UNITS["length"][name]
    rule = f"must be a unit of length ({', '.join(UNITS['length'])}), or a length above 0 such as 2.5 mm"
    try:
        size = Quantity.parse(name).to_base("length")
    except ValueError:
        raise ValueError(rule) from None
    if size <= 0.0:
        raise ValueError(rule)
    return size


def read_clump(path: Path, unit: str | None = None) -> ClumpFile:
    """Read a clump from a file of spheres, in whatever format.

    Parameters
    ----------
    path
        The file.
    unit
        Its unit, as `length_unit` reads it; None: the one that it names, or else `DEFAULT_UNIT`.

    Raises
    ------
    InputError
        When the file breaks a rule of its format, holds more than one body, names another unit, or has a size
        that no grain has and nobody named the unit.
    """
    file, place = read_spheres(path), str(path)
    size, said = _unit(file.unit, unit, place)
    if file.bodies is not None and file.body_count > 1:
        numbers = ", ".join(str(body) for body in np.unique(file.bodies)[:5])
        rule = "expected a clump's file holds one body: keep the lines of one"
        raise InputError(place, rule, f"{file.body_count} bodies ({numbers}, ...)")
    if len(file.spheres) > MOST_SPHERES:
        raise InputError(
            place, f"expected a clump has at most {MOST_SPHERES} spheres", f"{len(file.spheres)}"
        )
    spheres = file.spheres * size
    check_computable(spheres, place)
    check_one_body(spheres, place)
    if unit is None and file.unit is None:
        length = float(np.max(np.ptp(spheres[:, :3], axis=0) + 2.0 * spheres[:, 3].max()))
        check_grain_size(length, place, f"read in {DEFAULT_UNIT}")
    return ClumpFile(ClumpShape.from_spheres(spheres[:, :3], spheres[:, 3]), f"{file.told}; unit: {said}")


def _unit(named: float | None, given: str | None, place: str) -> tuple[float, str]:
    """Size of the file's unit, and where it is from."""
    if given is None:
        if named is None:
            return UNITS["length"][DEFAULT_UNIT], f"{DEFAULT_UNIT}, as the file names none"
        return named, f"{_named(named)}, as the file says"
    size = length_unit(given)
    if named is not None and size != named:
        raise InputError(
            place, "expected the unit given is that which the file names", f"{given} for {_named(named)}"
        )
    return size, given


def _named(size: float) -> str:
    return next((name for name, each in UNITS["length"].items() if each == size), f"{size:g} m")


def check_computable(spheres: np.ndarray, place: str) -> None:
    """Refuse spheres (n, 4) [m] whose volume and moments may be beyond floats.

    Raises
    ------
    InputError
        When one lies too far out, or is too large or too small.
    """
    largest, smallest = COMPUTABLE
    if np.abs(spheres).max() > largest or spheres[:, 3].min() < smallest:
        rule = f"expected a sphere lies within {largest:g} m, and its radius is at least {smallest:g} m"
        found = f"{np.abs(spheres).max():.4g} m and {spheres[:, 3].min():.4g} m"
        raise InputError(place, rule, found)


def check_grain_size(length: float, place: str, read_as: str) -> None:
    """Refuse a grain that is longer or shorter than any.

    Raises
    ------
    InputError
        When the length [m] lies outside `GRAIN_SIZES`.
    """
    low, high = GRAIN_SIZES
    if not low <= length <= high:
        sizes = f"{1e3 * low:g} to {1e3 * high:g} mm"
        rule = f"expected a grain is {sizes} long, unless its unit is named (--unit, clump_unit)"
        raise InputError(place, rule, f"{1e3 * length:.4g} mm, {read_as}")


def check_one_body(spheres: np.ndarray, place: str) -> None:
    """Refuse spheres (n, 4) that do not hold together.

    Raises
    ------
    InputError
        When they fall into parts that do not touch.
    """
    centers, radii = spheres[:, :3], spheres[:, 3]
    apart = np.linalg.norm(centers[:, None] - centers[None], axis=2)
    reach = radii[:, None] + radii[None] + GAP * np.minimum(radii[:, None], radii[None])
    if (parts := _parts(apart <= reach)) > 1:
        raise InputError(place, "expected the spheres of a clump touch one another", f"{parts} parts apart")


def _parts(touching: np.ndarray) -> int:
    """Count the parts that hold together, (n, n) saying who touches whom.

    SciPy counts them too, but takes longer to load than a study to be read.
    """
    count, left = 0, np.ones(len(touching), dtype=bool)
    while left.any():
        body = touching[np.argmax(left)]
        while (grown := touching[body].any(axis=0)).sum() > body.sum():
            body = grown
        count, left = count + 1, left & ~body
    return count
