"""Cases of two scenes whose responses are functions of the settings, with noise from the case's seed."""

from collections.abc import Mapping

import numpy as np
import pandas as pd

from doe import Factor
from experiments.studyfile.campaign import Response

FACTORS = (Factor("A", 0.1, 0.3), Factor("E", 0.3, 0.6), Factor("F", 0.2, 0.6), Factor("G", 0.02, 0.08))

ANGLE = Response("angle", "angle", "deg")
DENSITY = Response("density", "solid_fraction")
LEFT = Response("left", "mass_left", "kg", "bin")

NOISE = {"angle": 0.3, "solid_fraction": 0.001, "mass_left": 0.0005}
"""Standard deviation of one case."""

TRUTH = {"E": 0.47, "F": 0.42}


def coded(row: Mapping[str, float], name: str) -> float:
    return float(next(f for f in FACTORS if f.name == name).to_coded(row[name]))


def angle(row: Mapping[str, float]) -> float:
    return 25.0 + 3.0 * coded(row, "E") + 5.0 * coded(row, "F")


def solid_fraction(row: Mapping[str, float]) -> float:
    return 0.55 - 0.02 * coded(row, "E") + 0.005 * coded(row, "F")


def mass_left(row: Mapping[str, float]) -> float:
    return 0.02 + 0.006 * coded(row, "E") + 0.001 * coded(row, "F")


MEASURED = {"target": {"angle": angle, "solid_fraction": solid_fraction}, "bin": {"mass_left": mass_left}}
"""Observables of every scene."""


class Cases:
    """A runner: every scene measures functions of the settings, plus noise from the case's seed."""

    def __init__(self, fails=lambda row: False, **functions) -> None:
        self.fails, self.functions = fails, functions
        self.tables: list[pd.DataFrame] = []

    def __call__(self, table: pd.DataFrame) -> pd.DataFrame:
        self.tables.append(table)
        rows = [self.case(row) for row in table.to_dict("records")]
        return table.assign(angle=np.nan, angle_se=0.1, grain_count=100.0).assign(
            **pd.DataFrame(rows, index=table.index)
        )

    def case(self, row: Mapping[str, float]) -> dict:
        if self.fails(row):
            return {"status": "failed", "reason": "the outlet is clogged"}
        rng, found = np.random.default_rng(int(row["seed"])), {}
        for name, function in MEASURED[row["scene"]].items():
            found[name] = self.functions.get(name, function)(row) + NOISE[name] * rng.standard_normal()
        return {"status": "finished", "reason": "", "simulated_time": 2.0} | found
