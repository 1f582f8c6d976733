"""Fresh cases that an analysis asks for, before any of them has run."""

from __future__ import annotations

import numpy as np

from doe.discrepancy import Bank, Measured, Settings, fit_emulator
from doe.discrepancy.analysis import LEAST_FREEDOM
from doe.discrepancy.contest.slips import find_slips
from experiments.discover.search import Search

_LIKELY_RIVALS = 2


def search_cases(settings: Settings, conditions: int) -> tuple[int, int]:
    """Cases that an analysis with a gap asks for: likely, and at the most.

    The base runs once around its optimum, its rivals in rounds that halve and in the finish, and so do
    pairs; at the end the base and the chosen model run side by side.
    """
    one_model = settings.refinement_points * settings.refinement_repeats * conditions
    rounds = [max(1, settings.shortlist >> number) for number in range(settings.refinement_rounds)]
    finish = settings.shortlist * settings.finish_points * settings.refinement_repeats * conditions
    most_rounds = (1 + 2 * sum(rounds)) * one_model + 2 * finish
    end = 2 * settings.direct_runs * conditions
    return (_LIKELY_RIVALS + 1) * one_model + end, most_rounds + end


def cases_for(search: Search, measured: Measured, bank: Bank | None, seed: int) -> tuple[int, int]:
    """Cases that an analysis of measured data asks for: likely, and at the most.

    Too few measured means need no case. A bank is searched for a gap first: without a gap no case is needed,
    and where a value may be a slip the data are analysed twice.
    """
    fitted = [condition.name for condition in search.study.conditions if not condition.held_out]
    rows = [measured.values[name] for name in measured.conditions if name in fitted]
    means = sum(int(np.isfinite(each).any(axis=0).sum()) for each in rows)
    if means - len(search.study.factors) < LEAST_FREEDOM:
        return 0, 0
    likely, most = search_cases(search.settings, len(search.study.conditions))
    if bank is None:
        return likely, most
    if next(search.analysis(measured, bank, seed), None) is None:
        return 0, 0
    passes = 2 if find_slips(measured, fit_emulator(bank), search.settings) else 1
    return passes * likely, passes * most
