"""Page of the proof: for each card and code, both means and whether they are shown to be equal."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from doe import DesignError, Sample, compare_means
from experiments.benchmarks.travel.cards import CARDS, CODES, GRAIN_COUNT, SOFTENING
from experiments.benchmarks.travel.heaps import AZIMUTHS, FIT, OURS, Heap
from experiments.files import write_text
from experiments.report.kit.markdown import markdown_table

MARGIN = 1.0
"""Difference of the mean angles that does not matter [degrees]."""

PAGE, TABLE, HEAPS = "README.md", "cells.csv", "heaps.csv"

TEXT = """# A card that travels

Written by `python -m experiments.benchmarks.travel page`. Ten cards, {count} grains each with a modulus
divided by {softening:g}: here under the laws of a code, and in that code from what `dem-warp export` writes.
Angles are of the `{fit}` fit, mean of {azimuths} views. A cell is equivalent when two one-sided tests (Welch,
level .05) show the two means to differ by less than {margin:g} degree.

{verdict}

"""


def compare_cells(heaps: Sequence[Heap]) -> pd.DataFrame:
    """Compare every card in every code that has at least two heaps on either side."""
    rows = []
    for code in CODES:
        for card in CARDS:
            own = _angles(heaps, OURS, code, card)
            theirs = _angles(heaps, code, code, card)
            if min(len(own), len(theirs)) < 2:
                continue
            row = {"code": code, "card": card, "n": len(theirs), "n_own": len(own)}
            rows.append(row | _compared(own, theirs))
    return pd.DataFrame(rows)


def _compared(own: Sequence[float], theirs: Sequence[float]) -> dict[str, object]:
    try:
        found = compare_means(own, theirs, margin=MARGIN)
    except DesignError as error:
        return {"equivalent": "no", "reason": str(error)}
    mine, other = Sample.of(own), Sample.of(theirs)
    return {
        "own": mine.mean,
        "own_sd": mine.sd,
        "theirs": other.mean,
        "theirs_sd": other.sd,
        "difference": found.difference,
        "smallest_margin": found.smallest_margin,
        "equivalent": "yes" if found.equivalent else "no",
    }


def _angles(heaps: Sequence[Heap], code: str, laws: str, card: str) -> list[float]:
    return [
        heap.angle
        for heap in heaps
        if (heap.code, heap.laws, heap.card) == (code, laws, card) and heap.angle is not None
    ]


def write_page(heaps: Sequence[Heap], folder: Path) -> Path:
    """Write the page, its table and every heap's numbers into a folder."""
    cells = compare_cells(heaps)
    failed = [heap for heap in heaps if heap.angle is None]
    verdict = f"{len(heaps)} heaps, {len(failed)} without an angle; no cell can be compared yet."
    if len(cells):
        passed = int((cells["equivalent"] == "yes").sum())
        verdict = f"{passed} of {len(cells)} cells are equivalent; {len(failed)} heaps are without an angle."
    text = TEXT.format(
        count=GRAIN_COUNT, softening=SOFTENING, fit=FIT, azimuths=AZIMUTHS, margin=MARGIN, verdict=verdict
    )
    if len(cells):
        text += markdown_table(cells.round(2)) + "\n"
    text += "".join(f"\n- {heap.code} {heap.card} {heap.seed}: {heap.reason}" for heap in failed)
    write_text(folder / PAGE, text.rstrip() + "\n")
    write_text(folder / TABLE, cells.to_csv(index=False, float_format="%.4g"))
    table = pd.DataFrame([vars(heap) for heap in heaps])
    write_text(folder / HEAPS, table.to_csv(index=False, float_format="%.6g"))
    return folder / PAGE
