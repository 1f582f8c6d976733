"""Plan of the study: five data on one grain, and the drums that are simulated for them."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from doe import Sample, latin_hypercube
from experiments.studyfile import Study, load_study

HERE = Path(__file__).parent

SHELLS = ("soil", "steel", "PLA", "acrylic")
"""Materials of shell and back; the cover is of the last one."""

UPRIGHT, INCLINED = "upright", "inclined"
"""Conditions of the study: the axis level, and inclined by 45 degrees."""

UPRIGHT_ANGLE = Sample(36.17, 3.12, 20)
"""Slope with the axis level, over all shells [deg]; the source prints no single ones."""

INCLINED_SD = 2.92
"""Standard deviation of one inclined test, pooled by the source [deg]."""

PUBLISHED_HEAP = 31.7
"""Angle of a heap of 30 g from a lifted tube, mean of 10 [deg]; its spread is not known here."""

GRAIN = ("mu", "mu_r")
"""Factors that all data share."""


@dataclass(frozen=True)
class Runs:
    """Numbers of cases."""

    points: int
    """Points of the design, each upright and inclined."""
    heaps: int
    """Heaps, at settings that the drums are compatible with."""


RUNS = {"h200": Runs(16, 16), "bench": Runs(9, 6)}
"""Values by scale of the study."""


def study_at(scale: str) -> Study:
    """Load the study of the drums at a scale."""
    return load_study(HERE / "study.toml", scale)


def heap_study_at(scale: str) -> Study:
    """Load the study of the heap at a scale."""
    return load_study(HERE / "heap.toml", scale)


def data() -> dict[str, Sample]:
    """Slopes by their names: upright, and inclined with each shell [deg]."""
    found = pd.read_csv(HERE / "angles.csv", comment="#").groupby("shell")["angle_deg"]
    inclined = {
        name: Sample(float(found.mean()[name]), INCLINED_SD, int(found.size()[name])) for name in SHELLS
    }
    return {UPRIGHT: UPRIGHT_ANGLE} | inclined


def planned_drums(study: Study, points: int) -> pd.DataFrame:
    """Lay out the drums: a Latin hypercube over the factors, each point under both conditions."""
    design = latin_hypercube(study.factors, points, seed=31)
    rows = [
        {"scene": scene, "point": number, "seed": 5000 + 2 * number + (scene == INCLINED)}
        | {f.name: f.center + f.half_range * float(row[f.name]) for f in study.factors}
        for number, (_, row) in enumerate(design.coded.iterrows())
        for scene in (UPRIGHT, INCLINED)
    ]
    return pd.DataFrame(rows)


def coded(study: Study, table: pd.DataFrame) -> np.ndarray:
    """Coded settings of the rows of a table, shape (rows, factors)."""
    return np.column_stack([(table[f.name] - f.center) / f.half_range for f in study.factors])
