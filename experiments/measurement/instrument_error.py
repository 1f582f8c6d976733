"""Errors of instruments that are the same in every condition.

A file of measured heaps may state them in rows with the condition ``calibration`` and the replicate
``offset`` or ``scale``. The value is a standard deviation, in the observable's unit or as a share of the
value (``0.002`` or ``0.2 %``). The replicate ``none`` means that the instruments have no error. The default
is the usual error of the instrument. The observables of one instrument have a common error of the scale, and
an error of the offset each.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from doe.discrepancy import Calibration
from experiments.io.rows import Row
from experiments.io.texts import nearest_name
from experiments.io.units import Quantity
from experiments.studyfile.observables import DIMENSIONS, Instrument, Observable

CALIBRATION = "calibration"
"""Condition of rows that state an instrument's error."""
NONE = "none"
"""Replicate of the row for instruments without errors."""
KINDS = ("offset", "scale", NONE)

FRAME = 1.0 / 60.0
"""Time between two frames of a usual film [s]; start and end of a time are each read to half of it."""
MILLIMETRE = 1.0e-3
"""Division of a ruler [m], read to half of it."""
PIXEL = 1.0e-4
"""Size of a pixel at the heap [m]; an edge is read to half of it."""
CAMERA_SCALE = 0.002
"""Relative error of the scale of pictures: a millimetre on half a metre."""
ROLL = math.radians(0.3)
"""Roll of a levelled camera [rad]; it gives a flank of 30 degrees a lean of this times tan 30."""
BALANCE_SCALE = 0.005
"""Relative error of a weight: a gram of 200."""

_EVEN = 1.0 / math.sqrt(12.0)
"""Standard deviation of an even distribution of width one."""

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


def usual_error(observable: Observable) -> Calibration:
    """Return the usual error of an observable's instrument."""
    if observable.directed:
        return _LEAN
    if observable.instrument is None:
        return Calibration()
    usual = _USUAL.get((observable.instrument, observable.unit), Calibration())
    return replace(usual, instrument=_with_one_scale(observable))


def _with_one_scale(observable: Observable) -> str:
    """Name of the instrument whose scale affects an observable; empty for an angle or a share."""
    has_scale = observable.instrument is not None and observable.unit not in ("deg", "1")
    return str(observable.instrument) if has_scale else ""


def stated_calibration(
    rows: Sequence[Row], known: Mapping[str, Observable], measured: Sequence[str]
) -> dict[str, Calibration]:
    """Return the instrument errors of ``measured`` observables: stated by rows, or else the usual ones.

    ``known`` has the observables of the test by name and by alias.
    """
    found = {name: usual_error(known[name]) for name in measured}
    if any(_kind(row) == NONE for row in rows):
        found = {name: Calibration(instrument=_with_one_scale(known[name])) for name in measured}
    for row in rows:
        if (kind := _kind(row)) != NONE and (observable := _observable(row, known)).name in found:
            value = _value(row, observable.unit if kind == "offset" else "1")
            known_so_far = found[observable.name]
            stated = {"offset": known_so_far.offset, "scale": known_so_far.scale, kind: value}
            found[observable.name] = replace(known_so_far, offset=stated["offset"], scale=stated["scale"])
    return found


def _kind(row: Row) -> str:
    if row["replicate"] not in KINDS:
        raise row.error(f"with the condition {CALIBRATION}, must be one of {', '.join(KINDS)}", "replicate")
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
        raise row.error(str(error), "value") from None
    if not (value >= 0.0 and math.isfinite(value)) or (share and unit != "1"):
        raise row.error("must be a standard deviation, 0 or more, in the unit of the observable", "value")
    return value
