"""Page of the proof: for each card and code, both means and whether they are shown to be equal."""

import math
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pandas as pd
from scipy import stats

from doe import DesignError, compare_means
from experiments.evidence.accuracy.travel.cards import (
    CARDS,
    CODES,
    FRESH_SEEDS,
    GRAIN_COUNT,
    SEEDS,
    SOFTENING,
)
from experiments.evidence.accuracy.travel.travel_heaps import AZIMUTHS, FIT, HEAPS, NUMBER, OURS, Heap
from experiments.evidence.record_page import markdown_page, markdown_table
from experiments.io.files import write_text

MARGIN = 1.0
"""Difference of the mean angles that does not matter [degrees]."""

PAGE, TABLE, CAUSES = "README.md", "cells.csv", "causes.md"

EQUIVALENT, APART, FEW, NOT_RUN = "yes", "not shown", "too few heaps", "not run"
"""Verdicts on a cell."""

WAITING = {"deme": "DEM-Engine runs on a GPU alone"}
"""Codes that wait for a machine, and why."""

INTRODUCTION = """# A card that travels

Written by `python -m experiments.evidence.accuracy.travel page`. Ten cards, {count} grains each
with a modulus divided by {softening:g}: here under the laws of a code, and in that code from what
`dem-warp export` writes. Angles are of the `{fit}` fit, mean of {azimuths} views. A cell is one
card in one code, with {seeds} heaps there when it is done. It is equivalent when two one-sided
tests (guarded, level .05) show the two means to differ by less than {margin:g} degree. A cell that
its first heaps do not show is made again with {fresh} fresh seeds on both sides, and these alone
decide, at the same level: such a cell had two chances."""

BY_CODE = """## By code

Differences are dem-warp's mean less the code's, in degrees, over all cells with a heap on both sides. The
bias is their mean with its 95 % interval, each cell counting as one value."""

CELLS = """## By cell

Angles in degrees. `smallest_margin` is the smallest margin at which the cell would be equivalent."""


def compare_cells(heaps: Sequence[Heap]) -> pd.DataFrame:
    """Compare every card in every code; a cell without two heaps on either side has no test."""
    rows = [_cell(code, card, heaps) for code in CODES for card in CARDS]
    return pd.DataFrame(rows)


def _cell(code: str, card: str, heaps: Sequence[Heap]) -> dict[str, object]:
    own, theirs, which = _deciding(code, card, heaps)
    mine, other = np.mean(own or [math.nan]), np.mean(theirs or [math.nan])
    row: dict[str, object] = {"code": code, "card": card, "seeds": which, "n": len(theirs), "n_own": len(own)}
    row |= {"own": mine, "own_sd": _sd(own), "theirs": other, "theirs_sd": _sd(theirs)}
    row |= {"difference": mine - other, "smallest_margin": math.nan}
    if not theirs:
        return row | {"equivalent": NOT_RUN}
    if min(len(own), len(theirs)) < 2:
        return row | {"equivalent": FEW}
    try:
        found = compare_means(own, theirs, margin=MARGIN, method="guarded")
    except DesignError as error:
        return row | {"equivalent": f"{APART}: {error}"}
    verdict = EQUIVALENT if found.equivalent else APART
    return row | {"smallest_margin": found.smallest_margin, "equivalent": verdict}


def _deciding(code: str, card: str, heaps: Sequence[Heap]) -> tuple[list[float], list[float], str]:
    """Angles here and there that decide a cell, and which seeds they are of: fresh ones once all are made."""
    here = [heap for heap in heaps if (heap.laws, heap.card) == (code, card)]
    fresh = [heap for heap in here if heap.seed in FRESH_SEEDS]
    sides = [{heap.seed for heap in fresh if heap.code == side} for side in (OURS, code)]
    if all(len(seeds) == len(FRESH_SEEDS) for seeds in sides):
        return _angles(fresh, OURS), _angles(fresh, code), "fresh"
    first = [heap for heap in here if heap.code == OURS or heap.seed not in FRESH_SEEDS]
    return _angles(first, OURS), _angles(first, code), "first"


def _sd(angles: Sequence[float]) -> float:
    return float(np.std(angles, ddof=1)) if len(angles) > 1 else math.nan


def _angles(heaps: Sequence[Heap], code: str) -> list[float]:
    return [heap.angle for heap in heaps if heap.code == code and heap.angle is not None]


def summarise_codes(cells: pd.DataFrame, heaps: Sequence[Heap]) -> pd.DataFrame:
    """Summarise each code: heaps, cells by verdict, bias and root mean square of the differences."""
    rows = []
    for code, group in cells.groupby("code", sort=False):
        made = [heap for heap in heaps if heap.code == code]
        apart = group["difference"].dropna().to_numpy()
        row = {
            "code": code,
            "heaps": f"{sum(heap.seed not in FRESH_SEEDS for heap in made)} of {len(CARDS) * len(SEEDS)}",
            "fresh heaps": f"{sum(heap.seed in FRESH_SEEDS for heap in made)}",
            "without an angle": f"{sum(heap.angle is None for heap in made)}",
            "cells compared": f"{len(apart)} of {len(group)}",
            "equivalent": f"{(group['equivalent'] == EQUIVALENT).sum()}",
            "bias": "",
            "root mean square": "",
            "largest": "",
        }
        if len(apart) > 1:
            low, high = stats.t.interval(0.95, len(apart) - 1, apart.mean(), stats.sem(apart))
            row["bias"] = f"{apart.mean():+.2f} ({low:+.2f}, {high:+.2f})"
            row["root mean square"] = f"{np.sqrt((apart**2).mean()):.2f}"
            row["largest"] = f"{np.abs(apart).max():.2f}"
        rows.append(row)
    return pd.DataFrame(rows)


def write_page(heaps: Sequence[Heap], folder: Path) -> Path:
    """Write the page, its table and every heap's numbers into a folder.

    The page is that of the numbers as the folder's table has them, so that they give it again to the bit.
    Causes of what is not equivalent stand in the folder's `causes.md`, if it has one.
    """
    heaps = [heap.as_recorded() for heap in heaps]
    cells, failed = compare_cells(heaps), [heap for heap in heaps if heap.angle is None]
    head = INTRODUCTION.format(
        count=GRAIN_COUNT,
        softening=SOFTENING,
        fit=FIT,
        azimuths=AZIMUTHS,
        margin=MARGIN,
        seeds=len(SEEDS),
        fresh=len(FRESH_SEEDS),
    )
    causes = folder / CAUSES
    parts = [head, _verdict(cells), BY_CODE, markdown_table(summarise_codes(cells, heaps))]
    parts += [CELLS, markdown_table(cells.round(2))]
    if failed:
        parts.append("## Heaps without an angle")
        parts.append("\n".join(f"- {_where(heap)} {heap.card} {heap.seed}: {heap.reason}" for heap in failed))
    if causes.is_file():
        parts.append(causes.read_text(encoding="utf-8"))
    write_text(folder / PAGE, markdown_page(*parts))
    write_text(folder / TABLE, cells.to_csv(index=False, float_format="%.4g"))
    table = pd.DataFrame([asdict(heap) for heap in sorted(heaps, key=lambda heap: heap.job)])
    write_text(folder / HEAPS, table.to_csv(index=False, float_format=NUMBER))
    return folder / PAGE


def _where(heap: Heap) -> str:
    return heap.code if heap.code == heap.laws else f"{heap.code}, laws of {heap.laws},"


def _verdict(cells: pd.DataFrame) -> str:
    """Count the cells by their verdicts, and name the codes that wait for a machine."""
    counts = cells["equivalent"].value_counts()
    of = {name: int(counts.get(name, 0)) for name in (EQUIVALENT, FEW, NOT_RUN)}
    tested, shown = len(cells) - of[FEW] - of[NOT_RUN], cells[cells["equivalent"] == EQUIVALENT]
    whole = int((shown["n"] >= len(SEEDS)).sum())
    lines = [
        f"**{of[EQUIVALENT]} of {len(cells)} cells are shown to be equivalent**, {whole} of them "
        f"with all {len(SEEDS)} heaps there. Tested: {tested}; too few heaps for a test: {of[FEW]}; "
        f"not run: {of[NOT_RUN]}."
    ]
    for code, why in WAITING.items():
        group = cells[cells["code"] == code]
        waiting = int((group["equivalent"] == NOT_RUN).sum())
        if waiting:
            state = f"{waiting} of its {len(group)} cells have not been run"
            lines.append(f"**{why}, and waits for one: {state}.**")
    return "\n\n".join(lines)
