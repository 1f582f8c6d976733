"""Files of measured profiles of drums and heaps, curves of a press and of a tool, points of shear; CSV.

A row is a point, ``replicate`` and with units ``x, z``, ``strain, stress``, ``normal, shear`` or ``depth,
force``; or a picture: ``replicate, picture`` of a drum along its axis, ``replicate, picture, pixel`` of a
heap, a photograph or a file of spheres of another code, whose grain may be given by its ``type``. The column
``view`` numbers views of a heap, or frames of a drum.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from dem_warp.scenes.drum_surface import STATIONS
from dem_warp.scenes.penetration import PARTS
from dem_warp.scenes.press_curve import LOADED, UNLOADED, strains_of
from dem_warp.scenes.shear_points import LOADS
from experiments.io.errors import InputError
from experiments.io.rows import Row, read_rows
from experiments.io.units import Quantity
from experiments.measurement.duplicates import Duplicates
from experiments.measurement.value_limits import ValueLimits
from experiments.studyfile.observables import SHEAR_PROFILE, SURFACE
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

OTHER_STRESS = 0.1
"""Part by which the largest stress of a curve may differ from that of the test."""

OTHER_DEPTH = 0.02
"""Part by which a curve of a tool may end above the depth of the test."""

LEAST_LOADS = 2
"""Fewest loads of a shear test besides its pre-shear."""

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


def read_profiles(path: Path, fit: str, size: ValueLimits) -> Profiles:
    """Read the profiles of a test with a profile: of a drum, a press, a tool, a shear test or a heap."""
    if size.radius is not None:
        return read_drum_profiles(path, size.radius)
    if size.stress is not None:
        return (read_shear_points if size.profile == SHEAR_PROFILE else read_press_curves)(path, size.stress)
    if size.depth:
        return read_force_curves(path, size.depth)
    return read_heap_profiles(path, fit, size)


def read_force_curves(path: Path, depth: float) -> Profiles:
    """Read forces on a tool on its way down to a depth [m], as means over equal parts of this depth.

    A depth is that of the tip below the surface of the bed; there the force is 0 where a curve begins later.
    """
    found: dict[str, dict[float, float]] = {}
    for row in read_rows(path, ("replicate", "depth", "force"), ("replicate", "depth", "force")):
        points, place = found.setdefault(_label(row), {}), _number(row, "depth", "length")
        if place <= max(points, default=-math.inf):
            raise row.error("must be larger than in the row before", "depth")
        points[place] = _number(row, "force", "force")
    given, forces, ends = Duplicates(), [], depth * np.arange(PARTS + 1) / PARTS
    for name, points in found.items():
        given.add(tuple(points.items()), name, f"replicate {name}", str(path))
        deepest, gap = max(points), np.diff([0.0, *(each for each in points if each > 0.0)]).max(initial=0.0)
        if deepest < (1 - OTHER_DEPTH) * depth or gap > depth / PARTS:
            problem = (
                f"points must be at most {1e3 * depth / PARTS:.4g} mm apart, down to the study's depth, "
            )
            problem += f"{1e3 * depth:.4g} mm"
            raise InputError(f"{path}: replicate {name}", problem, f"{1e3 * deepest:.4g} mm")
        curve = ({0.0: 0.0} if min(points) > 0.0 else {}) | points
        places = np.union1d(ends, list(curve))
        force = np.interp(places, list(curve), list(curve.values()))
        work = np.append(0.0, np.cumsum(np.diff(places) * (force[1:] + force[:-1]) / 2))
        forces.append(np.diff(np.interp(ends, places, work)) * PARTS / depth)
    return _profiles(list(range(PARTS)), {name: [each] for name, each in zip(found, forces, strict=True)})


def read_press_curves(path: Path, stress: float) -> Profiles:
    """Read curves of a piston that goes down to a stress [Pa] and back, as strains at parts of this stress.

    The rows of a curve are in the order of the measurement. The strain is counted from the seat of the
    piston, as that of the simulated test.
    """
    found: dict[str, list[list[float]]] = {}
    for row in read_rows(path, ("replicate", "strain", "stress"), ("replicate", "strain", "stress")):
        pressure, strain = _number(row, "stress", "pressure"), _number(row, "strain", "")
        if not -1.0 < strain < 1.0:
            raise row.error("must be a part of the height, between -1 and 1", "strain")
        found.setdefault(_label(row), []).append([pressure, 1.0 - strain])
    given, strains = Duplicates(), []
    for name, curve in found.items():
        given.add(tuple(map(tuple, curve)), name, f"replicate {name}", str(path))
        largest = max(pressure for pressure, _ in curve)
        _require_largest(largest, stress, f"{path}: replicate {name}")
        strains.append(strains_of(curve, largest))
    both = all(curve[-1][0] <= UNLOADED[-1] * stress for curve in found.values())
    kept = list(range(len(LOADED) + len(UNLOADED) * both))
    return _profiles(kept, {name: [each[kept]] for name, each in zip(found, strains, strict=True)})


def read_shear_points(path: Path, stress: float) -> Profiles:
    """Read shear stresses at the loads of a test, from those next to them, and of its pre-shear at a stress.

    The row with the largest normal stress, about `stress` [Pa], is the pre-shear.
    """
    found: dict[str, list[list[float]]] = {}
    for row in read_rows(path, ("replicate", "normal", "shear"), ("replicate", "normal", "shear")):
        found.setdefault(_label(row), []).append(
            [_number(row, name, "pressure") for name in ("normal", "shear")]
        )
    given = Duplicates()
    shears, spans = [], []
    for name, points in found.items():
        given.add(tuple(map(tuple, points)), name, f"replicate {name}", str(path))
        normal, shear = np.array(sorted(points)).T
        _require_largest(float(normal[-1]), stress, f"{path}: replicate {name}")
        if len(normal) < LEAST_LOADS + 1 or (np.diff(normal) <= 0.0).any():
            problem = f"needs {LEAST_LOADS} different normal stresses or more below that of the pre-shear"
            raise InputError(f"{path}: replicate {name}", problem, ", ".join(f"{n:g} Pa" for n in normal))
        parts = np.array(LOADS) * normal[-1]
        spans.append((parts > 0.99 * normal[0]) & (parts < 1.01 * normal[-2]))
        shears.append(np.append(np.interp(parts, normal[:-1], shear[:-1]), shear[-1]))
    kept = np.flatnonzero([*np.all(spans, axis=0), True]).tolist()
    return _profiles(kept, {name: [each[kept]] for name, each in zip(found, shears, strict=True)})


def _require_largest(largest: float, stress: float, place: str) -> None:
    """Refuse a test whose largest stress [Pa] is not that of the study."""
    if not abs(largest / stress - 1.0) < OTHER_STRESS:
        problem = f"the largest stress must be that of the study, {stress:g} Pa"
        raise InputError(place, problem, f"{largest:g} Pa")


def read_drum_profiles(path: Path, radius: float) -> Profiles:
    """Read profiles of a drum of a radius [m] as heights above its axis, at its stations."""
    found: dict[str, dict[str, _Points]] = {}
    pictured: dict[str, list[dict[int, float]]] = {}
    pictures = Duplicates()
    for row in read_rows(path, ("replicate",), COLUMNS[:5]):
        if row["picture"]:
            _require_no_point(row)
            pictured.setdefault(_label(row), []).append(_drawn_surface(row, radius))
            pictures.add_file(path.parent / row["picture"], row.line, row["picture"], row.place("picture"))
            continue
        x, z = _take_point(row, found)
        if np.hypot(x, z) > radius:
            problem = f"must be in the drum, within {1e3 * radius:g} mm of its axis"
            raise InputError(f"{path}:{row.line}: x, z", problem, f"x {row['x']}, z {row['z']}")
    places = np.array(STATIONS) * radius
    heights = pictured
    for name, each in found.items():
        heights.setdefault(name, []).extend(_at_stations(view.heights, places) for view in each.values())
    profiles = profiles_of(heights, str(path))
    for each in found.values():
        for view in each.values():
            _check_surface(view, radius, f"{path}:{view.line}")
    _require_own_points(found, path)
    return profiles


def profiles_of(views: Mapping[str, Sequence[Mapping[int, float]]], place: str) -> Profiles:
    """Gather the views of drums, heights by station [m], at the stations that all of them have."""
    shown = [set(view) for each in views.values() for view in each]
    kept = sorted(set.intersection(*shown)) if shown else []
    if len(kept) < LEAST_STATIONS:
        span = f"{len(kept)} in all of {len(shown)} profiles"
        raise InputError(place, f"all profiles must span {LEAST_STATIONS} stations of the drum", span)
    heights = {name: [np.array([view[n] for n in kept]) for view in each] for name, each in views.items()}
    return _profiles(kept, heights)


def _drawn_surface(row: Row, radius: float) -> dict[int, float]:
    """Return the heights of the surface in a picture of a drum, by station [m]."""
    # a file of points needs no pictures
    from experiments.measurement.drum_pictures import sure_observed

    seen = sure_observed(row.file.parent / row["picture"], radius, None, row.place("picture"))
    return {number: seen[name] for number, name in enumerate(SURFACE) if name in seen}


def _at_stations(view: Mapping[float, float], places: np.ndarray) -> dict[int, float]:
    """Return the heights between the points of a view at the stations that it spans."""
    x, z = np.array(sorted(view.items())).T
    heights = np.interp(places, x, z)
    return {n: float(h) for n, h in enumerate(heights) if x[0] <= places[n] <= x[-1]}


def read_heap_profiles(path: Path, fit: str, size: ValueLimits) -> Profiles:
    """Read outlines of heaps at the stations of `imaging.heap_profile`, from points, pictures and spheres.

    ``fit`` is that of the flanks in pictures and spheres, ``size`` has the limits of the heap's height.
    """
    points: dict[str, dict[str, _Points]] = {}
    heaps: dict[str, list[np.ndarray]] = {}
    pictures = Duplicates()
    for row in read_rows(path, ("replicate",), COLUMNS):
        if row["picture"]:
            _require_no_point(row)
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
    stations = list(range(len(next(iter(heaps.values()))[0])))
    return _profiles(stations, heaps)


def _profiles(stations: list[int], found: Mapping[str, list[np.ndarray]]) -> Profiles:
    views = [np.array(each) for each in found.values()]
    means = [each.mean(axis=0) for each in views]
    return Profiles(list(found), stations, np.array(means).reshape(len(means), len(stations)), views)


def _take_point(row: Row, found: dict[str, dict[str, _Points]]) -> tuple[float, float]:
    """Add the point of a row to those of its view, and return it."""
    x, z = _number(row, "x", "length"), _number(row, "z", "length")
    views = found.setdefault(_label(row), {})
    view = views.setdefault(row["view"], _Points(row.line, {}))
    if x in view.heights:
        raise row.error("appears twice in the profile", "x")
    view.heights[x] = z
    return x, z


def _require_no_point(row: Row) -> None:
    if row["x"] or row["z"]:
        raise row.error("must not be in a row with a point", "picture")


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


def _check_surface(view: _Points, radius: float, place: str) -> None:
    """Refuse a profile of a drum with a gap, or that rises where it must fall."""
    x, z = np.array(sorted(view.heights.items())).T
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

    x, z = np.array(sorted(view.heights.items())).T
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
    spheres = is_heap_file(path)
    if row[unused := "pixel" if spheres else "type"]:
        raise row.error(f"is for {'photographs' if spheres else 'files of spheres'}, unlike {path}", unused)
    try:
        if spheres:
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
    pixel = _number(row, "pixel", "length")
    if pixel <= 0.0:
        raise row.error("must be positive", "pixel")
    return pixel


def _number(row: Row, column: str, dimension: str) -> float:
    try:
        return Quantity.parse(row[column]).to_base(dimension)
    except ValueError as error:
        raise row.error(str(error), column) from None
