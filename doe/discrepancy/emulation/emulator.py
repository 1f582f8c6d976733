"""The emulator: the bank's runs as smooth surfaces, to which a model is fitted quickly."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from doe.discrepancy.emulation.bank import Bank
from doe.discrepancy.emulation.condition_surfaces import (
    Addition,
    Surfaces,
    symmetric_addition,
    symmetric_base,
)
from doe.discrepancy.emulation.kriged_parts import BASE, KrigedParts
from doe.discrepancy.emulation.run_noise import fit_noises
from doe.discrepancy.emulation.surface_fits import AddedRuns, BaseRuns, fit_additions, fit_bases, repeats_of
from doe.discrepancy.problem.space import SearchSpace
from doe.errors import RuleError
from doe.numerics.one_thread import in_one_thread

LEAST_RUNS = 10
"""Least number of runs of a mechanism in every condition."""
RESOLUTION = 1e-3
"""Least standard deviation of an observable, as a share of its range over the whole bank."""


@dataclass(frozen=True, eq=False)
class Emulator:
    """Surfaces of all conditions."""

    space: SearchSpace
    observables: tuple[str, ...]
    """Columns of every prediction; those that never vary in the bank are left out."""
    surfaces: Mapping[str, Surfaces]
    """Surfaces by condition."""
    columns: tuple[int, ...]
    """Columns of the observables in the outcomes of the simulator."""
    cases: int
    """Number of cases of the bank."""
    notes: tuple[str, ...] = ()
    """Remarks on parts of the bank that were left out, with reasons."""
    kriged: KrigedParts | None = None
    """Covariances of its kriged parts, also of those that symmetry took out; None without a bank."""

    def without(self, *mechanisms: str) -> Emulator:
        """Return the same emulator with some mechanisms withheld from the library."""
        return replace(self, space=self.space.without(*mechanisms))


def fitted(bank: Bank) -> Bank:
    """Return the same bank with the kriged parts of its fit, which take longest to find.

    Raises
    ------
    RuleError
        It cannot be fitted (`fit_emulator`).
    """
    return replace(bank, kriged=fit_emulator(bank).kriged)


@in_one_thread
def fit_emulator(bank: Bank) -> Emulator:
    """Fit every surface to a bank; its known kriged parts are not searched again.

    Raises
    ------
    RuleError
        A condition has too few finished runs.
    """
    finished = bank.values[bank.finished]
    if not len(finished):
        raise RuleError("bank", "must have finished cases", "no finished case")
    spread = np.ptp(finished, axis=0)
    columns = np.flatnonzero(spread > 0.0)
    notes = [
        f"{bank.observables[i]} never varies in the bank: left out" for i in np.flatnonzero(spread == 0.0)
    ]
    failed = int((~bank.finished).sum())
    if failed:
        notes.append(f"{failed} of {len(bank.reasons)} cases of the bank failed")
    thin = _too_few(bank)
    notes += [f"{name} has too few finished cases in the bank: left out of the library" for name in thin]
    odd = np.array([bank.observables[column] in bank.space.odd for column in columns])
    known = bank.known_parts
    found = _bases(bank, columns, RESOLUTION * spread[columns], known)
    kriging = {(number, BASE): base.base.kriging for number, base in enumerate(found)}
    bases = [symmetric_base(base, odd) for base in found]
    additions: list[dict[str, Addition]] = [{} for _ in bases]
    for index, name in enumerate(bank.space.names):
        if name in thin:
            continue
        runs = []
        for number, base in enumerate(bases):
            rows = bank.rows(number, index)
            values = bank.values[np.ix_(rows, columns)]
            parts = None if known is None else known.of_surface(number, index)
            runs.append(AddedRuns(base, bank.theta[rows], bank.coded_size[rows], values, parts))
        silent = odd & (not bank.space.mechanism(name).directed)
        for number, addition in enumerate(fit_additions(runs)):
            kriging[number, index] = addition.polynomial.kriging
            additions[number][name] = symmetric_addition(addition, odd, silent)
    surfaces = {
        condition: replace(base, additions=own)
        for condition, base, own in zip(bank.space.conditions, bases, additions, strict=True)
    }
    names = tuple(bank.observables[column] for column in columns)
    return Emulator(
        bank.space.without(*thin),
        names,
        surfaces,
        tuple(int(column) for column in columns),
        len(bank.reasons),
        tuple(notes),
        KrigedParts.of(bank.runs_sha256, kriging),
    )


def _bases(bank: Bank, columns: np.ndarray, floor: np.ndarray, known: KrigedParts | None) -> list[Surfaces]:
    """Return the surfaces of every condition without mechanisms."""
    data = []
    for number, condition in enumerate(bank.space.conditions):
        rows = bank.rows(number, -1)
        theta, values = bank.theta[rows], bank.values[np.ix_(rows, columns)]
        try:
            data.append((theta, values, repeats_of(theta, values)))
        except RuleError as error:
            raise RuleError(f"condition {condition} of the bank", error.problem, error.value) from error
    noises = fit_noises([repeats for _, _, repeats in data], floor)
    parts = [None if known is None else known.of_surface(number, BASE) for number in range(len(data))]
    runs = [
        BaseRuns.of(theta, values, noise, kriged)
        for (theta, values, _), noise, kriged in zip(data, noises, parts, strict=True)
    ]
    return fit_bases(runs)


def _too_few(bank: Bank) -> list[str]:
    """Return mechanisms with too few runs in some condition."""
    conditions = range(len(bank.space.conditions))
    return [
        name
        for index, name in enumerate(bank.space.names)
        if min(len(bank.rows(condition, index)) for condition in conditions) < LEAST_RUNS
    ]
