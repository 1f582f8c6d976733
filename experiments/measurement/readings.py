"""Readings of one row of a file of measured heaps."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from experiments.io.errors import InputError, Problem
from experiments.io.rows import Row
from experiments.io.texts import nearest_name
from experiments.io.units import Quantity
from experiments.measurement.profile_files import read_pixel, read_profiles
from experiments.measurement.value_limits import ValueLimits
from experiments.studyfile.observables import DIMENSIONS, PROFILES, Observable, View
from imaging import FITS

if TYPE_CHECKING:
    from imaging import Outline, PictureError

CLOGGED = "the tube clogged"
"""Reason of a replicate without a heap because the grains stayed in the tube."""
CLOGGED_ROW = "clogged"
"""Observable of a row for such a replicate."""
NOT_SHOWN = "needs a value: photographs do not show it"
PIXEL_RULE = "lengths in a picture need the size of its pixels, e.g. 0.1 mm"


@dataclass(frozen=True)
class Reading:
    """One value of one heap."""

    row: Row
    observable: str
    """Name of the observable, or `CLOGGED_ROW`."""
    value: float
    """Value in the unit of the observable; NaN without a heap."""
    picture: str = ""
    """Picture that it was measured on, or empty."""
    doubt: Problem | None = None
    """Reason why it is impossible, most often its unit or the size of the picture's pixels."""


class Outlines:
    """Outlines of the pictures of one file; each picture is read once."""

    def __init__(self) -> None:
        self._found: dict[tuple[Path, float | None], Outline | PictureError] = {}

    def find(self, path: Path, pixel: float | None) -> Outline:
        """Find the outline in a picture with pixels of a size [m]; raise `PictureError` without a heap."""
        # a file of numbers needs no pictures
        from imaging import PictureError, find_outline, read_picture

        if (path, pixel) not in self._found:
            try:
                picture = read_picture(path)
                self._found[path, pixel] = find_outline(picture, meters_per_pixel=pixel, place=str(path))
            except PictureError as error:
                self._found[path, pixel] = error
        known = self._found[path, pixel]
        if isinstance(known, PictureError):
            raise known
        return known


def require_same_fit(fit: str, own: str, place: str) -> None:
    """Refuse angles of a ``fit`` other than the study's ``own``; raise `InputError`."""
    if fit not in FITS:
        raise InputError(place, f"must be one of {', '.join(FITS)}", fit)
    if fit != own:
        raise InputError(place, f"must be {own!r}, the fit of the study: other angles do not compare", fit)


def readings_of(
    row: Row, size: ValueLimits, fit: str, known: Mapping[str, Observable], outlines: Outlines
) -> Iterator[Reading]:
    """Read the values of a row, within the limits of its test; raise `PictureError` for a bad picture.

    ``known`` has the observables of the test by name and by alias, ``outlines`` those of the file's pictures.
    """
    name = row["observable"]
    if row["profile"]:
        yield from _profiled(row, size, fit, known)
    elif name == CLOGGED_ROW:
        if row["value"] or row["picture"]:
            raise row.error("must have no value and no picture: there is no heap", "observable")
        yield Reading(row, CLOGGED_ROW, np.nan)
    elif name and name not in known:
        rule = f"must be an observable or {CLOGGED_ROW!r}, {nearest_name(name, [*known, CLOGGED_ROW])}"
        raise row.error(rule, "observable")
    elif row["value"]:
        if not name:
            raise row.error("is missing for the value", "observable")
        if row["fit"]:
            require_same_fit(row["fit"], fit, f"{row.file}:{row.line}: fit")
        yield _written(row, known[name], size)
    elif row["picture"]:
        yield from _seen(row, size, fit, known, outlines)


def _profiled(row: Row, size: ValueLimits, fit: str, known: Mapping[str, Observable]) -> Iterator[Reading]:
    """Read the heights of the replicate's profile from the row's file of profiles."""
    heights = PROFILES.get(size.profile, ("",))
    if heights[0] not in known:
        rule = "needs a drum, a compression, a shear test, a penetration, or outline = true in [measurement]"
        raise row.error(rule, "profile")
    if row["observable"] not in ("", size.profile) or row["value"] or row["picture"]:
        raise row.error(f"must be alone, or with the observable {size.profile}", "profile")
    path = row.file.parent / row["profile"]
    found = read_profiles(path, fit, size)
    name = row["replicate"]
    if name not in found.names:
        rule = f"has no profile in the file {path}, {nearest_name(name, found.names)}"
        raise row.error(rule, "replicate")
    own = map(float, found.heights[found.names.index(name)])
    for station, value in zip(found.stations, own, strict=True):
        observable = known[heights[station]]
        yield Reading(row, observable.name, value, doubt=_doubt(row, observable, value, size))


def _written(row: Row, observable: Observable, size: ValueLimits) -> Reading:
    quantity = _quantity(row)
    if not quantity.unit and not row["unit"] and observable.unit != "1":
        quantity = replace(quantity, unit=observable.unit)
    try:
        value = quantity.to_base(DIMENSIONS[observable.unit])
    except ValueError as error:
        raise InputError(_place(row), f"{observable.name} {error}", str(quantity)) from None
    return Reading(row, observable.name, value, doubt=_doubt(row, observable, value, size))


def _quantity(row: Row) -> Quantity:
    unit = "" if row["unit"] == "1" else row["unit"]
    try:
        return Quantity.parse(f"{row['value']} {unit}")
    except ValueError as error:
        raise row.error(str(error), "value") from None


def _seen(
    row: Row, size: ValueLimits, fit: str, known: Mapping[str, Observable], outlines: Outlines
) -> Iterator[Reading]:
    """Measure a row's observable, or all observables, on its picture."""
    path, name = row.file.parent / row["picture"], row["observable"]
    if size.radius is not None:
        yield from _seen_in_drum(row, size, size.radius, known)
        return
    if name and not known[name].by_photograph:
        raise row.error(NOT_SHOWN, "observable")
    if not any(each.by_photograph for each in known.values()):
        raise row.error("this test leaves no heap to photograph: write the values", "picture")
    _require_file(row, path)
    pixel = read_pixel(row) if row["pixel"] else None
    if name and pixel is None and known[name].unit == "m":
        raise row.error(PIXEL_RULE, "pixel")
    # a file of numbers needs no pictures
    from imaging import PictureError, measure

    angle = measure(outlines.find(path, pixel), fit, str(path))
    if angle.doubts:
        raise PictureError(str(path), f"the picture is doubtful: {'; '.join(map(str, angle.doubts))}")
    views = [View.of(angle)]
    for observable in dict.fromkeys(known.values()):
        wanted = observable is known[name] if name else observable.unit != "m" or pixel
        if wanted and observable.by_photograph:
            value = observable.in_pictures(views)
            yield Reading(row, observable.name, value, row["picture"], _doubt(row, observable, value, size))


def _seen_in_drum(
    row: Row, size: ValueLimits, radius: float, known: Mapping[str, Observable]
) -> Iterator[Reading]:
    """Read a row's observable, or all observables, of a drum of a radius [m] on its picture."""
    # a file of numbers needs no pictures
    from experiments.measurement.drum_pictures import PICTURED, sure_observed

    path, name = row.file.parent / row["picture"], row["observable"]
    if name and name not in PICTURED:
        raise row.error(NOT_SHOWN, "observable")
    _require_file(row, path)
    seen = sure_observed(path, radius, None, row.place("picture"))
    for each in (name,) if name else PICTURED:
        if each in seen and each in known:
            yield Reading(row, each, seen[each], row["picture"], _doubt(row, known[each], seen[each], size))


def _require_file(row: Row, path: Path) -> None:
    if not os.path.isfile(path):  # unlike Path.is_file, it accepts names that are too long
        raise row.error(f"no such file: {path}", "picture")


def _doubt(row: Row, observable: Observable, value: float, size: ValueLimits) -> Problem | None:
    """Return the problem of a value that is impossible in this test."""
    low, high = size.limits(observable)
    if low <= value <= high:
        return None
    unit = "" if observable.unit == "1" else f" {observable.unit}"
    hint = f"Check the unit (default:{unit})." if unit and not row["unit"] else "Check the unit."
    problem = f"{observable.name} must be between {low:.3g} and {high:.3g}{unit} in this test"
    return Problem(_place(row), problem, f"{value:.6g}{unit}", hint)


def _place(row: Row) -> str:
    return row.place(next((key for key in ("value", "picture") if row[key]), "profile"))
