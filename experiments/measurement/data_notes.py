"""Notes about measured data: missing, scarce, constant, copied or contradictory values.

The notes change no value, and say nothing about the model.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from doe.discrepancy import Measured

ENOUGH = 5
"""Fewest heaps of a condition that show small effects."""

SUSPICION = 0.01
"""Probability that valid normal data give a note on an outlier, over all values; and on a scatter."""


def data_notes(measured: Measured, held_out: Mapping[str, bool]) -> tuple[str, ...]:
    """Check measured data; ``held_out`` has every condition of the study."""
    checks = (_scarce, _constant, _copied, _contradictory)
    return (*_missing(measured, held_out), *(note for check in checks for note in check(measured)))


def _missing(measured: Measured, held_out: Mapping[str, bool]) -> Iterator[str]:
    yield from (f"condition {name} was not measured" for name in held_out if name not in measured.conditions)
    if not any(held_out.get(name) for name in measured.conditions):
        yield "no held-out condition was measured: the verdict is not tested on data outside its fit"
    if sum(not held_out.get(name, False) for name in measured.conditions) == 1:
        yield "only one condition is fitted: few mechanisms differ from other friction values"
    for condition in measured.conditions:
        counts = measured.counts(condition)
        lacking = [name for name, count in zip(measured.observables, counts, strict=True) if count == 0]
        if lacking and measured.finished_count(condition):
            yield f"{condition}: without {', '.join(lacking)}, which another condition has"


def _scarce(measured: Measured) -> Iterator[str]:
    for condition in measured.conditions:
        total, formed = len(measured.values[condition]), measured.finished_count(condition)
        if formed < total:
            yield f"{condition}: {total - formed} of {total} replicates left no heap: a separate outcome"
        if formed == 0:
            continue
        fewest = int(measured.counts(condition)[measured.counts(condition) > 0].min(initial=formed))
        if fewest == 1:
            yield f"{condition}: an observable was measured on only one heap, which shows no scatter"
        elif fewest < ENOUGH:
            yield f"{condition}: an observable was measured on only {fewest} heaps, fewer than {ENOUGH}"


def _constant(measured: Measured) -> Iterator[str]:
    for condition, name, values in _columns(measured):
        if len(values) >= 2 and np.ptp(values) == 0.0:
            yield (
                f"{condition}: {name} is {values[0]:g} in all {len(values)} heaps, without any scatter: "
                "read too coarsely, or copied?"
            )


def _copied(measured: Measured) -> Iterator[str]:
    """Find heaps that agree in every digit of several values."""
    for condition in measured.conditions:
        rows = measured.values[condition]
        for later in range(len(rows)):
            for earlier in range(later):
                both = np.isfinite(rows[[earlier, later]]).all(axis=0)
                if both.sum() >= 2 and (rows[earlier] == rows[later])[both].all():
                    yield f"{condition}: heaps {earlier + 1} and {later + 1} agree in every value: a copy?"


def _contradictory(measured: Measured) -> Iterator[str]:
    """Find values and conditions that differ from the rest of the same observable."""
    level = SUSPICION / sum(len(values) for _, _, values in _columns(measured))
    for name in measured.observables:
        columns = {condition: values for condition, column, values in _columns(measured) if column == name}
        groups = {condition: values for condition, values in columns.items() if len(values) >= 2}
        odd = list(_outliers(groups, level))
        for condition, value in odd:
            rest = (groups[condition].sum() - value) / (len(groups[condition]) - 1)
            yield (
                f"{condition}: {name} of one heap, {value:.4g}, is far from the mean of the others, "
                f"{rest:.4g}: an error?"
            )
        calm = {condition: v for condition, v in groups.items() if condition not in dict(odd)}
        for condition, own, rest in _scattered(calm, level):
            yield (
                f"{condition}: {name} scatters by {own:.3g} from heap to heap, by {rest:.3g} in the other "
                "conditions: the replicates contradict one another"
            )


def _outliers(groups: Mapping[str, np.ndarray], level: float) -> Iterator[tuple[str, float]]:
    """Find values far from the rest of their group, relative to the scatter of all groups.

    The externally studentized residual of the one-way layout follows Student's t with N - k - 1 degrees of
    freedom (Cook and Weisberg 1982, section 2.2.2).
    """
    dof = sum(len(values) - 1 for values in groups.values()) - 1
    if dof < 1:
        return
    from scipy import stats  # loads slowly, and an invalid file does not need it

    limit = stats.t.isf(level / 2.0, dof)
    residuals = {condition: values - values.mean() for condition, values in groups.items()}
    square = sum(float(residual @ residual) for residual in residuals.values())
    for condition, residual in residuals.items():
        room = 1.0 - 1.0 / len(residual)
        rest = np.maximum(square - residual**2 / room, 0.0) / dof
        yield from (
            (condition, v) for v in groups[condition][np.abs(residual) > limit * np.sqrt(rest * room)]
        )


def _scattered(groups: Mapping[str, np.ndarray], level: float) -> Iterator[tuple[str, float, float]]:
    """Find a group with too large a variance; yield its standard deviation, and that of the others.

    The test is F of the group of largest variance against all others, with Bonferroni's correction; for
    groups of one size this is Cochran's test (ISO 5725-2, section 7.3.3).
    """
    if len(groups) < 2:
        return
    from scipy import stats

    worst = max(groups, key=lambda condition: groups[condition].var(ddof=1))
    others = [values for condition, values in groups.items() if condition != worst]
    dof = sum(len(values) - 1 for values in others)
    rest = sum(float(((values - values.mean()) ** 2).sum()) for values in others) / dof
    own = float(groups[worst].var(ddof=1))
    if rest > 0.0 and own / rest > stats.f.isf(level, len(groups[worst]) - 1, dof):
        yield worst, own**0.5, rest**0.5


def _columns(measured: Measured) -> Iterator[tuple[str, str, np.ndarray]]:
    """Yield condition, observable and the values measured there."""
    for condition in measured.conditions:
        for name, column in zip(measured.observables, measured.values[condition].T, strict=True):
            values = column[np.isfinite(column)]
            if len(values):
                yield condition, name, values
