"""Repose angles of heaps of other codes, measured like dem-warp's own."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from experiments.grains.spheres import SphereFile, format_of, length_unit, read_spheres
from experiments.grains.spheres.clump_file import unit_option
from experiments.io.errors import InputError
from experiments.io.units import read_quantity
from experiments.studyfile.study import MeasurementSection
from imaging import (
    Doubt,
    HeapAngle,
    HeapReadings,
    PictureError,
    ReposeAngle,
    heap_angle,
    heap_readings,
    overlay,
    snapshot,
)
from imaging.drawing.ground import REST, find_ground, height_axis, seen_upright
from imaging.geometry import Picture, Spheres
from imaging.photo.doubts import ROUGH_EDGE, doubts_of_mean

SIDES = ("left", "right")
READINGS = tuple(field.name for field in fields(HeapReadings))
"""Columns of the other readings of an outline."""
DEFAULT_UNIT = "m"
"""Unit of a heap's file without a unit; angles do not depend on it."""
BELOW = 0.5
"""Depth under the plate, in radii, of a sphere that fell off it."""
OVERFULL = 20.0
"""Largest volume of spheres over that of the box around them: those of a clump overlap."""
LEAST_PLANE, PLANE_OF_ALL, PLANE = 20, 0.02, 0.9
"""Fewest spheres in one plane that are mentioned, also as a part of all, and their least part of those within
`REST`: of equal grains on a plate of LIGGGHTS, LAMMPS and Yade, half have one depth in six digits."""


@dataclass(frozen=True)
class HeapSettings:
    """Known facts of the files of heaps."""

    unit: float | None = None
    """Unit of length [m]; None: the file's own, or metres."""
    plate_height: float | None = None
    """Height of the plate [m]; None: it is found."""
    types: tuple[str, ...] = ()
    """Types of the spheres that are grain; empty: all."""


@dataclass(frozen=True)
class MeasuredHeap:
    """A heap of a file, and its angle."""

    angle: HeapAngle
    source: str
    """Format of the file, and the measured part of it."""
    spheres: Spheres
    """Spheres [m] on the plate z = 0."""
    doubts: tuple[Doubt, ...] = ()
    """Doubts about the given plate."""

    def pictures(self) -> tuple[Picture, Picture]:
        """Draw the heap with the fitted flanks of its first view, and without."""
        pixels, azimuth = MeasurementSection().pixels, self.angle.azimuths[0]
        clean = snapshot(self.spheres.centers, self.spheres.radii, azimuth=azimuth, pixels=pixels)
        return overlay(clean, self.angle.views[0]), clean.image


def heap_settings(unit: str | None, plate_height: str | None, types: str | None = None) -> HeapSettings:
    """Read the options of files of heaps; raise `InputError` for an invalid unit or height."""
    size = None if unit is None else unit_option(unit)
    height = None if plate_height is None else read_quantity(plate_height, "length", "--plate-height")
    names = (name.strip() for name in (types or "").split(","))
    return HeapSettings(size, height, tuple(name for name in names if name))


def is_heap_file(path: Path) -> bool:
    """Return True if the content of a file is spheres; False for a picture or an unreadable file."""
    with suppress(InputError):
        return path.is_file() and format_of(path) is not None
    return False


def measure_heap_file(path: Path, fit: str, settings: HeapSettings) -> MeasuredHeap:
    """Measure the repose angle of the heap in a file of spheres; raise `PictureError` without a heap."""
    whole = read_spheres(path)
    file, notes = whole.of_types(settings.types, f"{path}, --type"), _notes(whole, settings)
    try:
        return _measured(file, path, fit, settings, notes)
    except PictureError as error:
        raise PictureError(str(path), "; ".join((str(error), *notes))) from None


def _notes(file: SphereFile, settings: HeapSettings) -> list[str]:
    """Mention several types, and spheres in one plane, which may be no grain."""
    counts = file.type_counts
    listed = ", ".join(f"{name} ({count} spheres)" for name, count in counts.items())
    kept = f"only {', '.join(settings.types)} measured" if settings.types else "all measured; --type chooses"
    notes = [f"types: {listed}; {kept}"] if len(counts) > 1 else []
    file = file.of_types(settings.types, "")
    for axis, name in enumerate("xyz"):
        along = file.spheres[:, axis]
        [(place, many)] = Counter(along.tolist()).most_common(1)
        near = np.count_nonzero(np.abs(along - place) < REST * np.median(file.spheres[:, 3]))
        if many >= max(LEAST_PLANE, PLANE_OF_ALL * len(along)) and many > PLANE * near:
            inside = file.chosen(along == place).type_counts
            of_type = f" of type {', '.join(inside)}" if inside else ""
            notes.append(f"{many} spheres{of_type} have the same {name}, {place:.4g}: a floor or a wall?")
    return notes


def _measured(
    file: SphereFile, path: Path, fit: str, settings: HeapSettings, notes: Iterable[str]
) -> MeasuredHeap:
    if settings.unit is not None and file.unit is not None and settings.unit != file.unit:
        problem = f"must be the unit of the file, {file.unit:g} m"
        raise InputError(f"{path}, --unit", problem, f"{settings.unit:g} m")
    size = settings.unit or file.unit or length_unit(DEFAULT_UNIT)
    spheres = Spheres.of(file.spheres[:, :3] * size, file.spheres[:, 3] * size)
    spheres = seen_upright(spheres, axis := height_axis(spheres))
    up = -1.0 if axis.startswith("-") else 1.0
    given = None if settings.plate_height is None else up * settings.plate_height
    room = float((np.ptp(spheres.centers, axis=0) + 2.0 * spheres.radii.max()).prod())
    if (filled := 4.0 * float((spheres.radii**3).sum()) / room) > OVERFULL:
        problem = f"the spheres would fill their room {filled:.0f} times: is the radius in another column?"
        raise InputError(str(path), problem)
    height = find_ground(spheres) if given is None else given
    standing = spheres.centers[:, 2] > height - BELOW * spheres.radii
    if not standing.any():
        raise InputError(f"{path}, --plate-height", "no sphere is above the plate", f"{1e3 * height:g} mm")
    heap = Spheres(spheres.centers[standing] - np.array([0.0, 0.0, height]), spheres.radii[standing])
    settled = MeasurementSection()
    bodies = len(heap.radii) if file.bodies is None else len(np.unique(file.bodies[standing]))
    angle = heap_angle(heap.centers, heap.radii, settled.azimuths, fit, settled.pixels, grain_count=bodies)
    low, high = 1e3 * heap.radii.min(), 1e3 * heap.radii.max()
    span = f"{low:.3g} mm" if high - low < 1e-3 * high else f"{low:.3g} to {high:.3g} mm"
    parts = [
        file.description,
        f"{len(heap.radii)} spheres of {span} radius"
        + ("" if file.bodies is None else f" in {bodies} grains"),
        f"plate {'found' if given is None else 'given'} at {1e3 * up * height:.4g} mm",
    ]
    if axis != "z":
        parts.append(f"height seems to be along {axis}, and is read so")
    if fallen := int(np.count_nonzero(~standing)):
        parts.append(f"{fallen} below it left out")
    doubts = _doubted_plate(spheres, height)
    return MeasuredHeap(angle, "; ".join((*parts, *notes)), heap, tuple(doubts))


def _doubted_plate(spheres: Spheres, height: float) -> Iterator[Doubt]:
    """Doubt a plate where other spheres of a file seem to rest."""
    with suppress(PictureError):
        found = find_ground(spheres)
        if abs(found - height) > BELOW * np.median(spheres.radii):
            yield Doubt("plate", f"given at {1e3 * height:.4g} mm; most spheres rest at {1e3 * found:.4g} mm")


def values_of(heap: MeasuredHeap, level: float) -> dict[str, Any]:
    """Return the values of a heap's row, without those of a camera; flanks are means over its views."""
    left, right = (float(np.mean([getattr(view, side) for view in heap.angle.views])) for side in SIDES)
    doubts = doubts_of_mean(heap.angle.mean, heap.angle.se, ROUGH_EDGE)
    values = mean_values(heap.angle, left, right, level, (*heap.doubts, *doubts))
    return values | {"source": heap.source}


def mean_values(
    angle: HeapAngle | ReposeAngle, left: float, right: float, level: float, doubts: Iterable[Doubt]
) -> dict[str, Any]:
    """Return the values of any row; other readings than the fit are means over the views of a heap."""
    low, high = angle.interval(level)
    values = {"left": left, "right": right, "mean": angle.mean, "se": angle.se, "low": low, "high": high}
    return values | _readings(angle) | {"doubts": [str(doubt) for doubt in doubts]}


def _readings(angle: HeapAngle | ReposeAngle) -> dict[str, float]:
    """Return the angle in every usual reading; empty where a flank has too few columns for one of them."""
    views = (angle,) if isinstance(angle, ReposeAngle) else angle.views
    with suppress(PictureError):
        found = [astuple(heap_readings(view.outline)) for view in views]
        return dict(zip(READINGS, np.mean(found, axis=0).tolist(), strict=True))
    return {}
