"""Slips: a gross misfit of one value, one kind of observable or one condition, which no effect makes.

They are looked for before anything else, each left out in turn. A slip is only named where no mechanism of
the library takes most of the misfit up, and where leaving out or repairing does.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from doe.discrepancy.emulation.emulator import Emulator
from doe.discrepancy.fitting.evidence import gather
from doe.discrepancy.fitting.fit import Fitted, fit
from doe.discrepancy.fitting.model import Model, Stack
from doe.discrepancy.problem.measured import Measured
from doe.discrepancy.problem.settings import Settings

GROSS = 3.0
"""Q over its degrees of freedom that is looked into."""
FITS = 2.0
"""Q over its degrees of freedom up to which a model may be right, as little as an emulator knows."""
OUTLYING = 8.0
"""Standard deviations by which one value is an outlier that scatter never makes."""
FACTORS = (1000.0, 100.0, 60.0, 25.4, 10.0, 3.0, 2.0, -1.0)
"""Factors of slips: of units, of an inch, of a digit, of a sign; their inverses as well."""
NEAR = 0.15
"""Relative distance from such a factor that is still it."""


@dataclass(frozen=True)
class Slip:
    """A likely slip."""

    observables: tuple[str, ...]
    conditions: tuple[str, ...]
    """Its place; of a condition all observables, of a kind of observable all conditions."""
    replicate: int | None
    """Number of the one measurement, from 1; None where it is all."""
    factor: float | None
    """The values look as if multiplied by this; None where no usual factor does."""
    exchanged: bool
    """The two conditions look as if exchanged."""
    q_with: float
    q_without: float
    """Q of the base with these values, and without them."""


def without(measured: Measured, slips: Sequence[Slip]) -> Measured:
    """Leave out the values of slips."""
    values = {name: rows.copy() for name, rows in measured.values.items()}
    for slip in slips:
        columns = [measured.observables.index(name) for name in slip.observables]
        for condition in slip.conditions:
            rows = slice(None) if slip.replicate is None else slice(slip.replicate - 1, slip.replicate)
            values[condition][rows, columns] = np.nan
    return replace(measured, values=values)


def find_slips(measured: Measured, emulator: Emulator, settings: Settings) -> tuple[Slip, ...]:
    """Look for slips: of single values first, then of one kind of observable, or of one or two conditions."""
    found = list(_outliers(measured, emulator))
    rest = without(measured, found)
    whole = _fitted(rest, emulator, settings)
    if whole is None or whole.q < GROSS * whole.freedom:
        return tuple(found)
    singles = (_fitted(rest, emulator, settings, (name,)) for name in emulator.space.names)
    if any(one is not None and one.q < FITS * one.freedom for one in singles):
        return tuple(found)  # a mechanism may explain it
    others = [*_exchanges(rest, emulator, settings, whole), *_left_out(rest, emulator, settings, whole)]
    return (*found, *sorted(others, key=_cost)[:1])


def _cost(slip: Slip) -> tuple[int, float]:
    """Sort slips by what they ask to be wrong: an exchange is one error, then the fewest observables."""
    return 0 if slip.exchanged else len(slip.observables) * len(slip.conditions), slip.q_without


def _fitted(
    measured: Measured, emulator: Emulator, settings: Settings, mechanisms: tuple[str, ...] = ()
) -> Fitted | None:
    """Fit a model to all conditions; None without degrees of freedom."""
    evidence = gather(measured, emulator)
    blocks = (*evidence.training, *evidence.held_out)
    model = Model(emulator, mechanisms, settings.systematic, views=measured.views)
    if not blocks or sum(len(block.mean) for block in blocks) <= len(model.lower):
        return None
    return fit(Stack(model, blocks), count=2)


def _outliers(measured: Measured, emulator: Emulator) -> Iterator[Slip]:
    """Yield single values far from the others of their condition, by the scatter of these or the model."""
    middle = np.zeros(len(emulator.space.factors))
    for condition in (name for name in measured.conditions if name in emulator.surfaces):
        variance = emulator.surfaces[condition].noise.variance(middle)
        for column, name in enumerate(measured.observables):
            values = measured.values[condition][:, column]
            rows = np.flatnonzero(np.isfinite(values))
            if name not in emulator.observables or len(rows) < 4:
                continue
            own = variance[emulator.observables.index(name)]
            for row in rows:
                others = values[rows[rows != row]]
                sd = np.sqrt(max(own, others.var(ddof=1)) * (1.0 + 1.0 / len(others)))
                away = abs(values[row] - others.mean())
                if away > OUTLYING * sd:
                    factor = _usual(values[row] / others.mean())
                    square = float((away / sd) ** 2)
                    yield Slip((name,), (condition,), int(row) + 1, factor, False, square, 0.0)


def _usual(ratio: float) -> float | None:
    """Find the usual factor that a ratio is near."""
    known = [one for factor in FACTORS for one in (factor, 1.0 / factor)]
    best = min(known, key=lambda factor: abs(ratio / factor - 1.0))
    return best if abs(ratio / best - 1.0) < NEAR else None


def _exchanges(measured: Measured, emulator: Emulator, settings: Settings, whole: Fitted) -> Iterator[Slip]:
    """Yield pairs of conditions that agree with the base once they are exchanged."""
    for first, second in combinations([c for c in measured.conditions if c in emulator.surfaces], 2):
        swapped = dict(measured.values) | {first: measured.values[second], second: measured.values[first]}
        reasons = dict(measured.reasons) | {first: measured.reasons[second], second: measured.reasons[first]}
        fitted = _fitted(replace(measured, values=swapped, reasons=reasons), emulator, settings)
        if fitted is not None and fitted.q < FITS * fitted.freedom:
            yield Slip(measured.observables, (first, second), None, None, True, whole.q, fitted.q)


def _left_out(measured: Measured, emulator: Emulator, settings: Settings, whole: Fitted) -> Iterator[Slip]:
    """Yield observables, kinds of them and conditions without which the rest agrees with the base."""
    known = [name for name in measured.observables if name in emulator.observables]
    everywhere = measured.conditions
    groups: list[tuple[tuple[str, ...], tuple[str, ...]]] = [((name,), everywhere) for name in known]
    groups += [(kind, measured.conditions) for kind in measured.kinds if len(kind) > 1]
    groups += [(tuple(known), (condition,)) for condition in measured.conditions]
    for observables, conditions in groups:
        slip = Slip(observables, conditions, None, None, False, whole.q, 0.0)
        fitted = _fitted(without(measured, [slip]), emulator, settings)
        if fitted is not None and fitted.q < FITS * fitted.freedom:
            factor = _factor(measured, fitted, slip)
            yield replace(slip, factor=factor, q_without=fitted.q)


def _factor(measured: Measured, fitted: Fitted, slip: Slip) -> float | None:
    """Find the usual factor between what was measured and what a fit to the rest predicts."""
    emulator, ratios = fitted.model.emulator, []
    for condition in (name for name in slip.conditions if name in emulator.surfaces):
        predicted = fitted.model.predict(fitted.x[None], condition)[0]
        for name in slip.observables:
            value = measured.mean(condition)[measured.observables.index(name)]
            if np.isfinite(value) and predicted[emulator.observables.index(name)]:
                ratios.append(value / predicted[emulator.observables.index(name)])
    return _usual(float(np.median(ratios))) if ratios else None
