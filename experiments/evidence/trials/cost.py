"""Cost of the trials, before they run."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from doe.discrepancy import Bank
from experiments.discover.fresh_cases import search_cases
from experiments.evidence.trials.declaration import Declaration
from experiments.evidence.trials.truth import Sealed

PER_CASE = 0.0105
"""Seconds of an H200 that the steps of a case of 400 grains of three spheres take, with 512 at once."""


def planned_cases(sealed: Sequence[Sealed], declared: Declaration, bank: Bank) -> pd.DataFrame:
    """Cases of the bank, of the trials' heaps, and of their analyses, and the GPU seconds of these.

    They depend on what is found: "at most" has the most that there can be. An analysis without a gap asks for
    no case; one with a gap is taken to run the base and two rivals once, and at the most the whole shortlist
    in every round, of singles and of pairs.
    """
    conditions, cases = len(bank.space.conditions), len(bank.reasons)
    rows = [("bank", 0, cases, cases)]
    likely, most = search_cases(declared.settings, conditions)
    for part in dict.fromkeys(trial.part for trial in sealed):
        count = sum(trial.part == part for trial in sealed)
        heaps = count * declared.plan.replicates * conditions
        with_gap = count - (declared.plan.nulls if part == "alone" else 0)
        rows.append((f"heaps, {part}", count, heaps, heaps))
        rows.append((f"analyses, {part}", count, with_gap * likely, with_gap * most))
    table = pd.DataFrame(rows, columns=["what", "trials", "cases", "at most"])
    return table.assign(seconds=table["cases"] * PER_CASE, **{"seconds at most": table["at most"] * PER_CASE})
