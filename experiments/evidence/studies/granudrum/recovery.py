"""Recovery of held-out settings from their pictures, and the settings that the real drum agrees with."""

from __future__ import annotations

import numpy as np
import pandas as pd

from experiments.evidence.studies.granudrum.drum_bank import (
    COHESION,
    COHESION_NAME,
    COUNTS,
    GRID,
    HEIGHTS,
    LEVELS,
    SPEEDS,
    DrumBank,
)

LEVEL, SIGNIFICANT = 0.9, 0.05
"""Probability of intervals, and p value below which a setting is not compatible."""


def recovered(bank: DrumBank, seed: int = 2) -> pd.DataFrame:
    """Compare each held-out setting with what its three pictures say of it.

    Levels are few, so that an interval of exactly 90 % must be drawn: a level at its end belongs to it with
    the probability that is left (C. Czado, T. Gneiting and L. Held, Biometrics 65 (2009) 1254-1261).
    """
    rng, rows = np.random.default_rng(seed), []
    for row in np.flatnonzero(bank.held_out).tolist():
        weights = bank.candidates.weights(bank.surfaces_of(row))
        for column, (name, level) in enumerate(zip(LEVELS, bank.levels[row], strict=True)):
            shares = np.bincount(GRID[:, column], weights, COUNTS[column])
            place = shares[:level].sum() + rng.uniform() * shares[level]
            within = abs(place - 0.5) < 0.5 * LEVEL
            cohesion = bank.levels[row, COHESION]
            rows.append(
                {"setting": name, COHESION_NAME: cohesion, "within": within, "share": shares[level],
                 "likeliest": shares.argmax() == level, "next": abs(shares.argmax() - level) <= 1}
            )  # fmt: skip
    return pd.DataFrame(rows)


def forecasts(bank: DrumBank) -> pd.DataFrame:
    """Differences of held-out surfaces from those that the other two speeds predict [mm], root mean square.

    `known`: from the surface emulated at the true setting, so the noise of the picture and of the emulator.
    """
    rows, here = [], np.ravel_multi_index(tuple(bank.levels.T), tuple(COUNTS))  # numbers in `GRID`
    for row in np.flatnonzero(bank.held_out).tolist():
        for rpm in SPEEDS:
            weights = bank.candidates.weights(bank.surfaces_of(row, without=rpm))
            true = np.eye(1, len(GRID), here[row])[0]
            apart = [
                bank.candidates.curve(str(rpm), each) - bank.surfaces[rpm][row] for each in (weights, true)
            ]
            miss, known = (float(np.sqrt(np.mean(each**2))) for each in apart)
            rows.append({"rpm": rpm, COHESION_NAME: bank.levels[row, COHESION], "miss": miss, "known": known})
    return pd.DataFrame(rows)


def compatible(bank: DrumBank, surface: np.ndarray) -> pd.DataFrame:
    """All settings with their p values against a surface at 50 turns a minute, the likeliest first.

    `noise` is the standard deviation of a height in one run there [mm], `higher` the surface's height above
    the emulated one.
    """
    found, emulator = bank.candidates, bank.candidates.emulators["50"]
    table = pd.DataFrame(
        {name: np.array(levels)[GRID[:, column]] for column, (name, levels) in enumerate(LEVELS.items())}
    )
    table["p"] = found.p_values({"50": surface})
    table["weight"] = found.weights({"50": surface})
    table["noise"] = np.sqrt(found.expected["50"][1].sum(axis=1) / len(HEIGHTS))
    table["higher"] = (surface - emulator.mean - found.expected["50"][0] @ emulator.components).mean(axis=1)
    return table.sort_values("weight", ascending=False)
