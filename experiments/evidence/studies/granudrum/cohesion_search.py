"""The search for what a model lacks, on the bank: cohesion withheld from the library, and in it."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd

from doe.discrepancy import (
    Emulator,
    Measured,
    MechanismRange,
    Outcomes,
    Point,
    SearchSpace,
    Settings,
    analyse,
    drive,
    fit_emulator,
    make_bank,
)
from experiments.evidence.studies.granudrum.drum_bank import (
    COHESION,
    COHESION_NAME,
    COUNTS,
    HEIGHTS,
    LEVELS,
    SPEEDS,
    DrumBank,
)
from experiments.evidence.trials.baselines.methods.search_method import no_runs

STRONG = 4
"""Level from which on cohesion is strong: 40 kJ/m3."""
FORECAST = 30
"""Speed that takes no part in a fit, as the search names nothing without one [1/min]."""
MECHANISM = MechanismRange("cohesion", 0.0, float(LEVELS[COHESION_NAME][-1]))
FACTORS = slice(1, COHESION)
"""Columns of the settings that every calibration adjusts: the size of a grain is known."""


def emulator_of(bank: DrumBank, size: int) -> Emulator:
    """Emulator of the settings of one size that are not held out; cohesion is a mechanism."""
    space = SearchSpace(
        tuple(LEVELS)[FACTORS],
        (0.0,) * 3,
        tuple((COUNTS[FACTORS] - 1.0).tolist()),
        tuple(map(str, SPEEDS)),
        tuple(rpm == FORECAST for rpm in SPEEDS),
        (MECHANISM,),
    )
    rows = np.flatnonzero(~bank.held_out & (bank.levels[:, 0] == size))
    points, values = [], []
    for rpm, row in product(SPEEDS, rows):
        level = bank.levels[row]
        sizes = ((MECHANISM.name, float(LEVELS[COHESION_NAME][level[COHESION]])),) * bool(level[COHESION])
        points.append(Point(tuple(level[FACTORS].astype(float)), sizes, str(rpm), 0))
        values.append(bank.surfaces[rpm][row])
    return fit_emulator(make_bank(space, HEIGHTS, points, Outcomes(np.array(values), ("",) * len(values))))


def ask(job: tuple[int, bool], bank: DrumBank, emulators: Sequence[Emulator]) -> dict[str, object]:
    """Analyse one setting as measured data: a picture at each speed, with cohesion withheld or not."""
    row, withheld = job
    level, surfaces = bank.levels[row], bank.surfaces_of(row)
    emulator = emulators[level[0]]
    measured = Measured(
        tuple(surfaces), tuple(HEIGHTS), {rpm: surface[None] for rpm, surface in surfaces.items()}
    )
    known = emulator.without(MECHANISM.name) if withheld else emulator
    started = time.perf_counter()
    found = drive(analyse(measured, known, Settings(), row), no_runs(len(HEIGHTS)))
    return {
        **dict(zip(LEVELS, level, strict=True)),
        "withheld": withheld,
        "verdict": str(found.verdict),
        "p": math.nan if found.base is None else found.base.p_value,
        "reason": found.reason,
        "seconds": time.perf_counter() - started,
    }


def search(bank: DrumBank, kept: Path, every: int, workers: int) -> pd.DataFrame:
    """Ask about all held-out settings without cohesion and with a strong one, or return what was kept.

    Cohesion is in the library for those without it, and for one in `every` of the strong ones.
    """
    if kept.is_file():
        return pd.read_csv(kept)
    emulators = [emulator_of(bank, size) for size in range(COUNTS[0])]
    levels = bank.levels[:, COHESION]
    without, strong = (np.flatnonzero(bank.held_out & kind) for kind in (levels == 0, levels >= STRONG))
    jobs = [(row, True) for row in (*without, *strong)] + [
        (row, False) for row in (*without, *strong[::every])
    ]
    with ProcessPoolExecutor(workers) as pool:
        rows = list(pool.map(partial(ask, bank=bank, emulators=emulators), jobs))
    pd.DataFrame(rows).to_csv(kept, index=False, float_format="%.4g")
    return pd.read_csv(kept)
