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
from experiments.measurement.pictures import require_same_fit
from experiments.measurement.plausible import SizeOfTest
from experiments.measurement.profile_files import read_drum_profiles, read_heap_profiles
from experiments.studyfile.observables import (
    DIMENSIONS,
    OUTLINE_PROFILE,
    PROFILES,
    SURFACE_PROFILE,
    Observable,
    View,
)

if TYPE_CHECKING:
    from imaging import Outline, PictureError

CLOGGED = "the tube clogged"
"""Reason of a replicate that left no heap because the grains stayed in the tube."""
CLOGGED_ROW = "clogged"
"""Stands for an observable where the tube held its grains."""


@dataclass(frozen=True)
class Reading:
    """One value of one heap."""

    row: Row
    """Place in the file."""
    observable: str
    """Its name, or `CLOGGED_ROW`."""
    value: float
    """Value in the unit of the observable; NaN without a heap."""
    picture: str = ""
    """The picture that it was measured on, empty if none."""
    doubt: Problem | None = None
    """Reason that it cannot be right: its unit, most often, or the size of the picture's pixels."""


class Outlines:
    """Outlines of the pictures of one file: each picture is looked at once, however many rows name it."""

    def __init__(self) -> None:
        self._found: dict[tuple[Path, float | None], Outline | PictureError] = {}

    def find(self, path: Path, pixel: float | None) -> Outline:
        """Find the outline in a picture with pixels of a size [m].

        Raises
        ------
        imaging.PictureError
            When the picture shows no heap.
        """
        # a file of numbers needs no pictures
        from imaging import PictureError, find_outline, read_picture

        if (path, pixel) not in self._found:
            try:
                found = find_outline(read_picture(path), meters_per_pixel=pixel, place=str(path))
            except PictureError as error:
                self._found[path, pixel] = error
            else:
                self._found[path, pixel] = found
        known = self._found[path, pixel]
        if isinstance(known, PictureError):
            raise known
        return known


def readings_of(
    row: Row, size: SizeOfTest, fit: str, known: Mapping[str, Observable], outlines: Outlines
) -> Iterator[Reading]:
    """Read everything that a row says of its heap, in a test of a size; pictures by a fit of the flanks.

    What the test yields is ``known`` by name and by alias. ``outlines`` are those of the file.

    Raises
    ------
    InputError
        When a cell breaks a rule.
    imaging.PictureError
        When the picture shows no heap that can be measured.
    """
    name = row["observable"]
    if row["profile"]:
        yield from _profiled(row, size, fit, known)
    elif name == CLOGGED_ROW:
        if row["value"] or row["picture"]:
            raise row.error("stands without a value and a picture: there is no heap", "observable")
        yield Reading(row, CLOGGED_ROW, np.nan)
    elif name and name not in known:
        rule = f"must be an observable or {CLOGGED_ROW!r}, {nearest_name(name, [*known, CLOGGED_ROW])}"
        raise row.error(rule, "observable")
    elif row["value"]:
        if not name:
            raise row.error("must say what the value is of", "observable")
        if row["fit"]:
            require_same_fit(row["fit"], fit, f"{row.file}:{row.line}: fit")
        yield _written(row, known[name], size)
    elif row["picture"]:
        yield from _seen(row, size, fit, known, outlines)


def _profiled(row: Row, size: SizeOfTest, fit: str, known: Mapping[str, Observable]) -> Iterator[Reading]:
    """Heights of the profile that a row's file has of its replicate."""
    profile = SURFACE_PROFILE if size.radius is not None else OUTLINE_PROFILE
    heights = PROFILES[profile]
    if row["observable"] not in ("", profile) or row["value"] or row["picture"]:
        raise row.error(f"stands alone, or with the observable {profile}", "profile")
    if heights[0] not in known:
        rule = "needs a drum, or outlines that the study asks for (outline = true in [measurement])"
        raise row.error(rule, "profile")
    path = row.file.parent / row["profile"]
    if size.radius is not None:
        found = read_drum_profiles(path, size.radius)
    else:
        found = read_heap_profiles(path, fit, size)
    name = row["replicate"]
    if name not in found.names:
        rule = f"expected the file {path} has a profile of each replicate, {nearest_name(name, found.names)}"
        raise row.error(rule, "replicate")
    own = map(float, found.heights[found.names.index(name)])
    for station, value in zip(found.stations, own, strict=True):
        observable = known[heights[station]]
        yield Reading(row, observable.name, value, doubt=_doubt(row, observable, value, size))


def _written(row: Row, observable: Observable, size: SizeOfTest) -> Reading:
    """Take the value that a row gives as a number."""
    quantity = _quantity(row)
    if not quantity.unit and not row["unit"] and observable.unit != "1":
        quantity = replace(quantity, unit=observable.unit)
    try:
        value = quantity.to_base(DIMENSIONS[observable.unit])
    except ValueError as error:
        raise InputError(_place(row), f"expected {observable.name} {error}", str(quantity)) from None
    return Reading(row, observable.name, value, doubt=_doubt(row, observable, value, size))


def _quantity(row: Row) -> Quantity:
    if "," in row["value"]:
        raise row.error("needs a decimal point, not a comma", "value")
    unit = "" if row["unit"] == "1" else row["unit"]
    try:
        return Quantity.parse(f"{row['value']} {unit}")
    except ValueError as error:
        raise row.error(str(error), "value") from None


def _seen(
    row: Row, size: SizeOfTest, fit: str, known: Mapping[str, Observable], outlines: Outlines
) -> Iterator[Reading]:
    """Values of a row's picture: the observable that it names, or all of them."""
    path, name = row.file.parent / row["picture"], row["observable"]
    if name and not known[name].by_photograph:
        raise row.error("needs a value: no photograph shows it", "observable")
    if not any(each.by_photograph for each in known.values()):
        raise row.error("must be left out of a test without a heap: write the values", "picture")
    if not os.path.isfile(path):  # a name too long is none, and raises nothing
        raise row.error(f"must name a picture file, relative to this one (looked for {path})", "picture")
    pixel = _pixel(row)
    if name and pixel is None and known[name].unit == "m":
        raise row.error("a length in a picture needs the size of its pixels, as 0.1 mm", "pixel")
    # a file of numbers needs no pictures
    from imaging import PictureError, measure

    angle = measure(outlines.find(path, pixel), fit, str(path))
    if angle.doubts:
        told = "; ".join(map(str, angle.doubts))
        raise PictureError(str(path), "expected a picture counts where nothing about it is in doubt", told)
    views = [View.of(angle)]
    for observable in dict.fromkeys(known.values()):
        wanted = observable is known[name] if name else observable.unit != "m" or pixel
        if wanted and observable.by_photograph:
            value = observable.in_pictures(views)
            yield Reading(row, observable.name, value, row["picture"], _doubt(row, observable, value, size))


def _pixel(row: Row) -> float | None:
    if not row["pixel"]:
        return None
    try:
        pixel = Quantity.parse(row["pixel"]).to_base("length")
    except ValueError as error:
        raise row.error(str(error), "pixel") from None
    if pixel <= 0.0:
        raise row.error("must be greater than 0", "pixel")
    return pixel


def _doubt(row: Row, observable: Observable, value: float, size: SizeOfTest) -> Problem | None:
    """Say why a value cannot be one of this test, if it cannot."""
    low, high = size.limits(observable)
    if low <= value <= high:
        return None
    unit = "" if observable.unit == "1" else f" {observable.unit}"
    question = f"is the unit right (none given:{unit})?" if unit and not row["unit"] else "is the unit right?"
    rule = f"expected {observable.name} lies between {low:.3g} and {high:.3g}{unit} in this test: {question}"
    return Problem(_place(row), rule, f"{value:.6g}{unit}")


def _place(row: Row) -> str:
    return row.place(next((key for key in ("value", "picture") if row[key]), "profile"))
