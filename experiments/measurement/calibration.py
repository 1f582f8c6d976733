"""Errors of calibration: what an instrument may be off by in every condition alike.

A file of measured heaps states them in rows of their own: ``calibration`` stands for the condition,
``offset`` or ``scale`` for the replicate, and the value is a standard deviation, in the observable's unit or
as a share of the value (``0.002`` or ``0.2 %``). A row with ``none`` for the replicate says that nothing is
off. What is not stated is as usual for the instrument. Lengths, times and weights of one instrument are off
by one scale, and by an offset each.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from doe.discrepancy import Calibration
from experiments.io.errors import InputError
from experiments.io.rows import Row
from experiments.io.texts import nearest_name
from experiments.io.units import Quantity
from experiments.studyfile.observables import DIMENSIONS, Instrument, Observable

CALIBRATION = "calibration"
"""Stands for a condition in rows that state an error of calibration."""
NONE = "none"
"""Stands for a replicate in the row that says that nothing is off."""
KINDS = ("offset", "scale", NONE)

FRAME = 1.0 / 60.0
"""Time between two frames of a usual film [s]; begin and end of a time are each read to half of it."""
MILLIMETRE = 1.0e-3
"""Division of a ruler [m], read to half of it."""
PIXEL = 1.0e-4
"""Size of a pixel at the heap [m]; an edge is read to half of it."""
CAMERA_SCALE = 0.002
"""Relative error of the scale of pictures: a millimetre on half a metre."""
ROLL = math.radians(0.3)
"""Roll of a levelled camera [rad]; it turns a flank of 30 degrees into a lean of this times tan 30."""
BALANCE_SCALE = 0.005
"""Relative error of a share of a weight: a gram of 200."""

_EVEN = 1.0 / math.sqrt(12.0)
"""Standard deviation of what lies evenly within a width of one."""

_USUAL: dict[tuple[Instrument, str], Calibration] = {
    (Instrument.PHOTOGRAPH, "m"): Calibration(PIXEL / 2.0, CAMERA_SCALE),
    (Instrument.PHOTOGRAPH, "deg"): Calibration(0.1),
    (Instrument.PHOTOGRAPH, "1"): Calibration(0.002),
    (Instrument.SCAN, "m"): Calibration(PIXEL / 2.0, CAMERA_SCALE),
    (Instrument.RULER, "m"): Calibration(MILLIMETRE * _EVEN),
    (Instrument.FILM, "s"): Calibration(math.sqrt(2.0) * FRAME * _EVEN),
    (Instrument.BALANCE, "1"): Calibration(BALANCE_SCALE, BALANCE_SCALE),
    (Instrument.BALANCE, "kg"): Calibration(0.0, BALANCE_SCALE),
    (Instrument.BALANCE, "kg/s"): Calibration(0.0, BALANCE_SCALE),
}
_LEAN = Calibration(ROLL * math.tan(math.radians(30.0)))


def usual_calibration(observable: Observable) -> Calibration:
    """Error of calibration that is usual for the instrument of an observable."""
    if observable.directed:
        return _LEAN
    if observable.instrument is None:
        return Calibration()
    usual = _USUAL.get((observable.instrument, observable.unit), Calibration())
    return replace(usual, instrument=_with_one_scale(observable))


def _with_one_scale(observable: Observable) -> str:
    """Name of the instrument whose scale is in an observable; empty for an angle or a share."""
    has_scale = observable.instrument is not None and observable.unit not in ("deg", "1")
    return str(observable.instrument) if has_scale else ""


def stated_calibration(
    rows: Sequence[Row], known: Mapping[str, Observable], measured: Sequence[str]
) -> dict[str, Calibration]:
    """Errors of calibration of measured observables, as rows state them and else as usual.

    Parameters
    ----------
    rows : sequence of Row
        The rows whose condition is `CALIBRATION`.
    known : mapping
        Observables of the test by name and by alias.
    measured : sequence of str
        Names of those that were measured.

    Raises
    ------
    InputError
        When a row breaks a rule.
    """
    found = {name: usual_calibration(known[name]) for name in measured}
    if any(_kind(row) == NONE for row in rows):
        found = {name: Calibration(instrument=_with_one_scale(known[name])) for name in measured}
    for row in rows:
        if (kind := _kind(row)) != NONE:
            observable = _observable(row, known)
            if observable.name in found:
                known_so_far = found[observable.name]
                if kind == "offset":
                    stated = replace(known_so_far, offset=_value(row, observable.unit))
                else:
                    stated = replace(known_so_far, scale=_value(row, "1"))
                found[observable.name] = stated
    return found


def _kind(row: Row) -> str:
    if row["replicate"] not in KINDS:
        raise row.error(f"of a {CALIBRATION} is one of {', '.join(KINDS)}", "replicate")
    return row["replicate"]


def _observable(row: Row, known: Mapping[str, Observable]) -> Observable:
    if row["observable"] not in known:
        raise row.error(
            f"must be an observable, {nearest_name(row['observable'], list(known))}", "observable"
        )
    return known[row["observable"]]


def _value(row: Row, unit: str) -> float:
    """Read a standard deviation in a unit."""
    share = row["unit"] == "%"
    written = "" if share or row["unit"] == "1" else row["unit"]
    try:
        quantity = Quantity.parse(f"{row['value']} {written}")
        if not quantity.unit and unit != "1":
            quantity = replace(quantity, unit=unit)
        value = quantity.to_base(DIMENSIONS[unit]) / (100.0 if share else 1.0)
    except ValueError as error:
        raise InputError(f"{row.file}:{row.line}: value", str(error), row["value"] or "nothing") from None
    if not (value >= 0.0 and math.isfinite(value)) or (share and unit != "1"):
        raise row.error("is a standard deviation, 0 or more, in the unit of the observable", "value")
    return value
