"""Files of measured profiles: heights of a drum's surface or a heap's outline, as a tidy CSV.

A row is a point, ``replicate, x, z`` with units, or, for a heap, ``replicate, picture, pixel``: a photograph,
or a file of spheres of another code, whose grain may be given by its ``type``. The column ``view`` numbers
views of a heap, or frames of a drum.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sized
from pathlib import Path
from typing import NamedTuple

import numpy as np

from dem_warp.scenes.drum_surface import STATIONS
from experiments.io.errors import InputError
from experiments.io.rows import Row, read_rows
from experiments.io.units import Quantity
from experiments.measurement.duplicates import Duplicates
from experiments.measurement.value_limits import ValueLimits
from imaging import PictureError

COLUMNS = ("replicate", "view", "x", "z", "picture", "pixel", "type")
"""Columns of a file of profiles."""

LEAST_STATIONS = 3
"""Fewest stations of a drum that all profiles span."""

WIDEST_GAP = 0.25
"""Largest gap between neighbouring points of a drum's profile, over its radius: stations are 0.2 apart."""

MIRRORED = 5.0
"""Rise to the right [deg] above which a drum's surface, which falls to the right, is mirrored."""

LEAST_POINTS = 8
"""Fewest points of a heap's profile."""

FOOT = 0.1
"""Largest height of a profile's ends, as a part of the heap's height."""


class Profiles(NamedTuple):
    """Measured profiles."""

    names: list[str]
    """Replicate of each profile."""
    stations: list[int]
    """Numbers of the stations, from 0."""
    heights: np.ndarray
    """Mean over the views of each profile [m], shape (profiles, stations)."""
    views: list[np.ndarray]
    """Views of each profile [m], shape (views, stations)."""


class _Points(NamedTuple):
    """Heights of one view by place [m], and the line of its first row."""

    line: int
    heights: dict[float, float]


def read_drum_profiles(path: Path, radius: float) -> Profiles:
    """Read profiles of a drum of a radius [m] as heights above its axis, at its stations."""
    found: dict[str, dict[str, _Points]] = {}
    for row in read_rows(path, ("replicate", "x", "z"), COLUMNS[:4]):
        x, z = _take_point(row, found)
        if np.hypot(x, z) > radius:
            problem = f"must be in the drum, within {1e3 * radius:g} mm of its axis"
            raise InputError(f"{path}:{row.line}: x, z", problem, f"x {row['x']}, z {row['z']}")
    _require_rows(found, path)
    places = np.array(STATIONS) * radius
    views = {name: [view.heights for view in each.values()] for name, each in found.items()}
    ends = [(min(view), max(view)) for each in views.values() for view in each]
    low, high = max(end[0] for end in ends), min(end[1] for end in ends)
    kept = [number for number, place in enumerate(places) if low <= place <= high]
    if len(kept) < LEAST_STATIONS:
        span = f"{1e3 * low:.4g} to {1e3 * high:.4g} mm, {len(kept)} stations"
        raise InputError(str(path), f"all profiles must span {LEAST_STATIONS} stations of the drum", span)
    for each in found.values():
        for view in each.values():
            _check_surface(view, radius, f"{path}:{view.line}")
    _require_own_points(found, path)
    heights = {name: [_between(view, places[kept]) for view in each] for name, each in views.items()}
    return _profiles(kept, heights)


def read_heap_profiles(path: Path, fit: str, size: ValueLimits) -> Profiles:
    """Read outlines of heaps at the stations of `imaging.heap_profile`, from points, pictures and spheres.

    ``fit`` is that of the flanks in pictures and spheres, ``size`` has the limits of the heap's height.
    """
    points: dict[str, dict[str, _Points]] = {}
    heaps: dict[str, list[np.ndarray]] = {}
    pictures = Duplicates()
    for row in read_rows(path, ("replicate",), COLUMNS):
        if row["picture"]:
            if row["x"] or row["z"]:
                raise row.error("must not be in a row with a point", "picture")
            heaps.setdefault(_label(row), []).extend(_pictured(row, fit, size))
            # views of one heap must be different pictures, too
            pictures.add_file(path.parent / row["picture"], row.line, row["picture"], row.place("picture"))
        else:
            _, z = _take_point(row, points)
            if z < 0.0:
                raise row.error("must be 0 or more: the plate is z = 0", "z")
            heaps.setdefault(row["replicate"], [])
    for name, views in points.items():
        heaps[name] += [_outline(view, f"{path}:{view.line}", size) for view in views.values()]
    _require_own_points(points, path)
    _require_rows(heaps, path)
    stations = list(range(len(next(iter(heaps.values()))[0])))
    return _profiles(stations, heaps)


def _profiles(stations: list[int], found: Mapping[str, list[np.ndarray]]) -> Profiles:
    views = [np.array(each) for each in found.values()]
    means = [each.mean(axis=0) for each in views]
    return Profiles(list(found), stations, np.array(means).reshape(len(means), len(stations)), views)


def _take_point(row: Row, found: dict[str, dict[str, _Points]]) -> tuple[float, float]:
    """Add the point of a row to those of its view, and return it."""
    x, z = _length(row, "x"), _length(row, "z")
    views = found.setdefault(_label(row), {})
    view = views.setdefault(row["view"], _Points(row.line, {}))
    if x in view.heights:
        raise row.error("appears twice in the profile", "x")
    view.heights[x] = z
    return x, z


def _require_rows(found: Sized, path: Path) -> None:
    if not found:
        raise InputError(str(path), "has no rows below the names of the columns")


def _require_own_points(found: Mapping[str, Mapping[str, _Points]], path: Path) -> None:
    """Refuse a profile whose points are those of another replicate, to the last digit."""
    given = Duplicates()
    for name, views in found.items():
        for view in views.values():
            points = tuple(sorted(view.heights.items()))
            given.add(points, name, f"replicate {name}", f"{path}:{view.line}")


def _label(row: Row) -> str:
    if not row["replicate"]:
        raise row.error("needs a label, one for each profile", "replicate")
    return row["replicate"]


def _between(view: Mapping[float, float], places: np.ndarray) -> np.ndarray:
    x = sorted(view)
    return np.interp(places, x, [view[each] for each in x])


def _check_surface(view: _Points, radius: float, place: str) -> None:
    """Refuse a profile of a drum with a gap, or that rises where it must fall."""
    x = np.array(sorted(view.heights))
    z = np.array([view.heights[each] for each in x])
    widest = int(np.argmax(np.diff(x)))
    if x[widest + 1] - x[widest] > WIDEST_GAP * radius:
        problem = f"points must be at most {1e3 * WIDEST_GAP * radius:.4g} mm apart"
        gap = f"none between {1e3 * x[widest]:.4g} and {1e3 * x[widest + 1]:.4g} mm"
        raise InputError(f"{place}: x", problem, gap)
    rise = np.degrees(np.arctan(np.polyfit(x, z, 1)[0]))
    if rise > MIRRORED:
        problem = "the surface must be high on the left and fall to the right, z up"
        raise InputError(f"{place}: x, z", problem, f"a rise of {rise:.1f} deg", "Mirror x, or negate z.")


def _outline(view: _Points, place: str, size: ValueLimits) -> np.ndarray:
    """Return the heights of an outline at its stations, from its points."""
    from imaging import profile_heights

    x = np.array(sorted(view.heights))
    z = np.array([view.heights[each] for each in x])
    if len(x) < LEAST_POINTS:
        raise InputError(place, f"a heap's profile needs {LEAST_POINTS} points or more", len(x))
    if max(z[0], z[-1]) > FOOT * z.max():
        problem = f"both ends of a heap's profile must be lower than {FOOT:.0%} of its height"
        ends = f"{1e3 * z[0]:.4g} and {1e3 * z[-1]:.4g} of {1e3 * z.max():.4g} mm"
        raise InputError(place, problem, ends)
    try:
        heights = profile_heights(x, z, place)
    except PictureError as error:
        raise InputError(place, "the heap's profile has no area") from error
    size.require_height(float(z.max()), "Check the unit.", "", f"{place}: z")
    return heights


def _pictured(row: Row, fit: str, size: ValueLimits) -> Iterator[np.ndarray]:
    """Yield the heights of the outlines of a photograph, or of a file of spheres from all sides."""
    # a file of points needs no pictures
    from experiments.measurement.heap_files import heap_settings, is_heap_file, measure_heap_file
    from imaging import find_outline, heap_profile, heap_shape, measure, read_picture

    path, place = row.file.parent / row["picture"], row.place("picture")
    if not os.path.isfile(path):  # unlike Path.is_file, it accepts names that are too long
        raise row.error(f"no such file: {path}", "picture")
    try:
        if is_heap_file(path):
            heap = measure_heap_file(path, fit, heap_settings(None, None, row["type"]))
            height = max(heap_shape(view.outline).height for view in heap.angle.views)
            size.require_height(height, "Check its unit of length.", f" in {row['picture']}", place)
            yield from (heap_profile(view.outline) for view in heap.angle.views)
            return
        if not row["pixel"]:
            raise row.error("outlines in a picture need the size of its pixels, e.g. 0.1 mm", "pixel")
        pixel = read_pixel(row)
        seen = measure(find_outline(read_picture(path), meters_per_pixel=pixel, place=str(path)), fit)
    except PictureError as error:
        raise InputError(place, f"has no measurable heap: {error}") from None
    if seen.doubts:
        doubts = "; ".join(map(str, seen.doubts))
        raise InputError(place, f"is doubtful: {doubts}", hint="Crop the picture, or remove the row.")
    source = f" in {row['picture']}, with a pixel of {row['pixel']}"
    height = heap_shape(seen.outline).height
    size.require_height(height, "Check the size of the pixels.", source, row.place("pixel"))
    yield heap_profile(seen.outline)


def read_pixel(row: Row) -> float:
    """Read the size of a row's pixels [m]."""
    pixel = _length(row, "pixel")
    if pixel <= 0.0:
        raise row.error("must be positive", "pixel")
    return pixel


def _length(row: Row, column: str) -> float:
    try:
        return Quantity.parse(row[column]).to_base("length")
    except ValueError as error:
        raise row.error(str(error), column) from None
