"""Slips: gross errors in one replicate, one kind of observable or one condition, which no effect makes.

They are searched first, each left out in turn. A slip is only named where neither the base nor the base with
one mechanism of the library takes most of the misfit up, and where one of them agrees with the rest: so a
slip is found even where an effect is present.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from doe.discrepancy.emulation.emulator import Emulator
from doe.discrepancy.fitting.fitted_model import Model, Stack
from doe.discrepancy.fitting.measured_means import gather
from doe.discrepancy.fitting.model_fit import Fitted, fit, quick_q
from doe.discrepancy.problem.replicates import Measured
from doe.discrepancy.problem.settings import Settings

GROSS = 3.0
"""Q over its degrees of freedom from which slips are searched."""
FITS = 2.0
"""Q over its degrees of freedom up to which a model may be right."""
HOPELESS = 4.0
"""Q of a quick fit over that of a model that fits, above which no full fit follows: full fits reached 0.4 of
it."""
OUTLYING = 8.0
"""Standard deviations from which one value is an outlier that scatter never makes."""
MANY = 3
"""Outliers of one replicate from which on the replicate is the outlier."""
STRANGE = 4.0
"""Standard deviations by which half of the values of an outlying replicate deviate."""
LEAST = 4
"""Least number of replicates that are compared with one another."""
MOST = 3
"""Largest number of slips that are searched one after the other."""
HELPS = 0.75
"""Largest share of Q over its degrees of freedom that a partial slip may leave."""
FACTORS = (1000.0, 100.0, 60.0, 25.4, 10.0, 3.0, 2.0, -1.0)
"""Usual factors: of units, of an inch, of a digit, of a sign; their inverses as well."""
NEAR = 0.15
"""Relative distance up to which a factor is recognised."""
SCATTERS = 6.0
"""Ratio of a measured to a modelled variance up to which columns may be exchanged: it varies with factors."""


@dataclass(frozen=True)
class Slip:
    """A likely slip."""

    observables: tuple[str, ...]
    conditions: tuple[str, ...]
    """Place of the slip: all observables of a condition or replicate, or one kind of observable in all
    conditions."""
    replicate: int | None
    """Number of the replicate, from 1; None for all."""
    factor: float | None
    """Factor by which the values seem multiplied; None where no usual factor fits."""
    exchanged: bool
    """True if the two conditions, or the two observables, seem exchanged."""
    q_with: float
    q_without: float
    """Least Q of the base and the base with one mechanism, with these values and without them; for an outlier
    its squared distance from the others in standard deviations, and 0."""

    @property
    def is_open(self) -> bool:
        """True if an effect that acts on these observables alone would look the same."""
        plain = self.factor is None or 0.25 < self.factor < 4.0  # an effect may well double an observable
        return self.replicate is None and len(self.conditions) > 1 and plain and not self.exchanged


@dataclass(frozen=True, eq=False)
class _Tried:
    """A tried slip, with the best fit to the rest."""

    slip: Slip
    rest: Fitted
    cost: int
    """Number of values that would be wrong; an exchange counts as one."""

    @property
    def ratio(self) -> float:
        """Q over its degrees of freedom."""
        return self.rest.q / max(self.rest.freedom, 1)


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
    """Find slips: single values and replicates first, then one kind of observable, or conditions.

    Where no single slip leaves a rest that fits, two kinds are tried together; then the slip of a usual
    factor that helps most is set aside and the search continues. Slips are named if at last one fits.
    """
    outliers = _outliers(measured, emulator)
    rest, found = without(measured, outliers), outliers
    for _ in range(MOST):
        whole = _closest(rest, emulator, settings)
        if whole is None or whole.q < GROSS * whole.freedom:
            return tuple(found)  # a mechanism may explain it
        ways = _exchanges, _swaps, _left_out
        tried = [one for way in ways for one in way(rest, emulator, settings, whole)]
        if fitting := [one for one in tried if one.ratio < FITS]:
            best = min(fitting, key=lambda one: (one.cost, one.ratio))
            return _joined(found, [_confirmed(best.slip, rest, emulator, settings)])
        if both := _two_kinds(rest, emulator, settings, whole):
            return _joined(found, both)
        least = HELPS * whole.q / whole.freedom
        helps = [one for one in tried if one.slip.factor is not None and one.ratio < least]
        if not helps:
            break
        found = [*found, min(helps, key=lambda one: one.ratio).slip]
        rest = without(rest, found[-1:])
    return tuple(outliers)


def _joined(found: Sequence[Slip], more: Sequence[Slip]) -> tuple[Slip, ...]:
    """Join slips, without those whose values are all among those of a later one."""
    fields = ("observables", "conditions")
    held = [
        one
        for one in found
        if any(all(set(getattr(one, of)) <= set(getattr(by, of)) for of in fields) for by in more)
    ]
    return (*(one for one in found if one not in held), *more)


def _closest(measured: Measured, emulator: Emulator, settings: Settings) -> Fitted | None:
    """Fit the base and, if that fails, the base with each mechanism; None without degrees of freedom."""
    evidence = gather(measured, emulator)
    blocks = (*evidence.training, *evidence.held_out)
    names = ((), *((name,) for name in emulator.space.names))
    base, *singles = (
        Stack(Model(emulator, one, settings.systematic, views=measured.views), blocks) for one in names
    )
    if not blocks or len(base.target) <= len(base.model.lower):
        return None
    best = fit(base, count=2)
    for stack in singles:
        limit = FITS * max(len(stack.target) - len(stack.model.lower), 0)
        if best.q < FITS * best.freedom:
            break
        if quick_q(stack, best.x[: len(base.model.lower)]) < HOPELESS * limit:
            best = min(best, fit(stack, count=2), key=lambda one: one.q)
    return best


def _outliers(measured: Measured, emulator: Emulator) -> list[Slip]:
    """Find single values, and replicates, far from the others of their condition."""
    found = []
    for condition in (name for name in measured.conditions if name in emulator.surfaces):
        ratios, away = _from_the_others(measured, emulator, condition)
        for row in np.flatnonzero(np.isfinite(away).any(axis=1)):
            seen = np.flatnonzero(np.isfinite(away[row]))
            far = seen[away[row][seen] > OUTLYING]
            if len(far) >= MANY or np.median(away[row][seen]) > STRANGE:
                groups = [(seen, far if len(far) else seen)]
            else:
                groups = [(far[[one]], far[[one]]) for one in range(len(far))]
            for columns, telling in groups:
                names = tuple(measured.observables[column] for column in columns)
                factor = _usual(float(np.median(ratios[row][telling])))
                square = float(np.mean(away[row][columns] ** 2))
                found.append(Slip(names, (condition,), int(row) + 1, factor, False, square, 0.0))
    return found


def _from_the_others(measured: Measured, emulator: Emulator, condition: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the ratio of each value to the mean of the others, and its distance from it; NaN where unknown.

    A distance is in standard deviations, by the scatter of the others or of the model.
    """
    rows = measured.values[condition]
    ratios, away = np.full(rows.shape, np.nan), np.full(rows.shape, np.nan)
    variance = emulator.surfaces[condition].noise.variance(np.zeros(len(emulator.space.factors)))
    for column, name in enumerate(measured.observables):
        present = np.flatnonzero(np.isfinite(rows[:, column]))
        if name not in emulator.observables or len(present) < LEAST:
            continue
        own = variance[emulator.observables.index(name)]
        for row in present:
            others = rows[present[present != row], column]
            sd = np.sqrt(max(own, others.var(ddof=1)) * (1.0 + 1.0 / len(others)))
            mean, value = others.mean(), rows[row, column]
            ratios[row, column] = value / mean if mean else np.nan
            # values that never vary: an equal one is at no distance, another at any
            away[row, column] = abs(value - mean) / sd if sd else (0.0 if value == mean else np.inf)
    return ratios, away


def _usual(ratio: float) -> float | None:
    """Return the usual factor that a ratio is near."""
    known = [one for factor in FACTORS for one in (factor, 1.0 / factor)]
    best = min(known, key=lambda factor: abs(ratio / factor - 1.0))
    return best if abs(ratio / best - 1.0) < NEAR else None


def _exchanges(measured: Measured, emulator: Emulator, settings: Settings, whole: Fitted) -> Iterator[_Tried]:
    """Try pairs of conditions, each exchanged."""
    for first, second in combinations([c for c in measured.conditions if c in emulator.surfaces], 2):
        swapped = dict(measured.values) | {first: measured.values[second], second: measured.values[first]}
        reasons = dict(measured.reasons) | {first: measured.reasons[second], second: measured.reasons[first]}
        fitted = _closest(replace(measured, values=swapped, reasons=reasons), emulator, settings)
        if fitted is not None:
            slip = Slip(measured.observables, (first, second), None, None, True, whole.q, fitted.q)
            yield _Tried(slip, fitted, 1)


def _swaps(measured: Measured, emulator: Emulator, settings: Settings, whole: Fitted) -> Iterator[_Tried]:
    """Try the pair of observables that promises most, exchanged in all conditions."""
    scouted = []
    base = Model(emulator, (), settings.systematic, views=measured.views)
    for pair in combinations([name for name in measured.observables if name in emulator.observables], 2):
        swap = dict(zip(pair, pair[::-1], strict=True))
        columns = [measured.observables.index(swap.get(name, name)) for name in measured.observables]
        values = {name: rows[:, columns] for name, rows in measured.values.items()}
        swapped = replace(measured, values=values)
        if all(_scatters_so(swapped, emulator, name) for name in pair):
            evidence = gather(swapped, emulator)
            stack = Stack(base, (*evidence.training, *evidence.held_out))
            scouted.append((quick_q(stack, whole.x[: len(base.lower)]), pair, swapped))
    for _, best, swapped in sorted(scouted, key=lambda one: one[0])[:1]:
        if fitted := _closest(swapped, emulator, settings):
            yield _Tried(Slip(best, measured.conditions, None, None, True, whole.q, fitted.q), fitted, 1)


def _scatters_so(measured: Measured, emulator: Emulator, name: str) -> bool:
    """Return True if an observable scatters about as the model has it: more would hide any disagreement."""
    center, ratios = np.zeros(len(emulator.space.factors)), []
    for condition in (each for each in measured.conditions if each in emulator.surfaces):
        values = measured.values[condition][:, measured.observables.index(name)]
        own = emulator.surfaces[condition].noise.variance(center)[emulator.observables.index(name)]
        if np.isfinite(values).sum() >= LEAST and own:
            ratios.append(np.nanvar(values, ddof=1) / own)
    return bool(ratios) and 1.0 / SCATTERS < np.mean(ratios) < SCATTERS


def _confirmed(slip: Slip, measured: Measured, emulator: Emulator, settings: Settings) -> Slip:
    """Keep a usual factor only if the values agree once they are divided by it."""
    if slip.factor is None or len(slip.conditions) == 1:
        return slip
    wrong = np.where(np.isin(measured.observables, slip.observables), slip.factor, 1.0)
    values = {name: rows / wrong for name, rows in measured.values.items()}
    fitted = _closest(replace(measured, values=values), emulator, settings)
    agrees = fitted is not None and fitted.q < FITS * fitted.freedom
    return slip if agrees else replace(slip, factor=None)


def _left_out(measured: Measured, emulator: Emulator, settings: Settings, whole: Fitted) -> Iterator[_Tried]:
    """Try observables, kinds of them and conditions, each left out."""
    known = tuple(name for name in measured.observables if name in emulator.observables)
    everywhere = measured.conditions
    groups: list[tuple[tuple[str, ...], tuple[str, ...]]] = [((name,), everywhere) for name in known]
    groups += [(kind, everywhere) for kind in _kinds(measured, emulator)]
    groups += [(known, (condition,)) for condition in everywhere]
    count = sum(int(np.isfinite(rows).sum()) for rows in measured.values.values())
    for observables, conditions in groups:
        slip = Slip(observables, conditions, None, None, False, whole.q, 0.0)
        rest = without(measured, [slip])
        left = sum(int(np.isfinite(rows).sum()) for rows in rest.values.values())
        fitted = _closest(rest, emulator, settings) if left < count else None
        if fitted is not None:
            factor = _factor(measured, fitted, slip)
            yield _Tried(replace(slip, factor=factor, q_without=fitted.q), fitted, count - left)


def _kinds(measured: Measured, emulator: Emulator) -> list[tuple[str, ...]]:
    """Return kinds of several observables of which the emulator knows at least one."""
    return [kind for kind in measured.kinds if len(kind) > 1 and set(kind) & set(emulator.observables)]


def _two_kinds(measured: Measured, emulator: Emulator, settings: Settings, whole: Fitted) -> list[Slip]:
    """Find two kinds of observables that are both wrong by a usual factor.

    One alone does not show: the scatter of the replicates hides it.
    """
    for pair in combinations(_kinds(measured, emulator), 2):
        slips = [Slip(kind, measured.conditions, None, None, False, whole.q, 0.0) for kind in pair]
        fitted = _closest(without(measured, slips), emulator, settings)
        if fitted is not None and fitted.q < FITS * fitted.freedom:
            slips = [replace(s, factor=_factor(measured, fitted, s), q_without=fitted.q) for s in slips]
            if all(slip.factor is not None for slip in slips):
                return slips
    return []


def _factor(measured: Measured, fitted: Fitted, slip: Slip) -> float | None:
    """Find the usual factor between measured values and those predicted by a fit to the rest."""
    emulator, ratios = fitted.model.emulator, []
    for condition in (name for name in slip.conditions if name in emulator.surfaces):
        predicted = fitted.model.predict(fitted.x[None], condition)[0]
        means = measured.mean(condition)
        for name in (each for each in slip.observables if each in emulator.observables):
            value, model = (
                means[measured.observables.index(name)],
                predicted[emulator.observables.index(name)],
            )
            if np.isfinite(value) and model:
                ratios.append(value / model)
    return _usual(float(np.median(ratios))) if ratios else None
