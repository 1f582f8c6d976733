"""Plan of the study: what is measured, what is varied, and how many drums are simulated."""

import math
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd

from dem_warp import Case
from doe import Factor, latin_hypercube
from experiments.studyfile import Study, load_study

HERE = Path(__file__).parent
STUDY = HERE / "study.toml"

MEASURED, HELD_BACK = (15, 45), (10, 30)
"""Speeds whose surfaces are given, and speeds whose surfaces are predicted [1/min]."""

READING = 0.2
"""Standard deviation of reading the edge of an averaged picture [mm]: a tenth of the edge's width."""

EVERY = 10
"""Every n-th measured place takes part in the fit: nearer ones share their errors."""

FILL = Factor("fill", 0.21, 0.30)
"""Volume of the grains over that of the drum: the number of grains, at any size of theirs."""

PUBLISHED = {"mu": 0.561, "mu_r": 0.293, "mu_r_wall": 0.293, "fill": 0.2553}
"""Best trial of the source's own search: 29,185 spheres."""

PUBLISHED_AREA = {15: 46.4, 45: 17.4}
"""Its areas of disagreement [mm2]."""

TIED = np.array([[1, 0, 0], [0, 1, 0], [0, 1, 0], [0, 0, 1.0]])
"""Makes settings of three: the walls roll as the grains."""


@dataclass(frozen=True)
class Runs:
    """Numbers of drums."""

    first: int
    """Points of the first design, at the measured speeds."""
    second: int
    """Points about what the first one found, at all speeds."""
    checks: int
    """Repeats of the best point, at all speeds."""

    @property
    def drums(self) -> int:
        """Drums in all, the published point's among them."""
        return 2 * (self.first + 1) + 4 * (self.second + self.checks)


RUNS = {"h200": Runs(17, 12, 1), "bench": Runs(12, 8, 1)}
"""Values by scale of the study."""


def study_at(scale: str) -> Study:
    """Load the study at one of its scales."""
    return load_study(STUDY, scale)


def factors_of(study: Study) -> tuple[Factor, ...]:
    """Factors that are varied: those of the study file, and the number of grains."""
    return (*study.factors, FILL)


def coded(study: Study, table: pd.DataFrame) -> np.ndarray:
    """Coded settings of the rows of a table, shape (rows, factors)."""
    return np.column_stack([
        (table[f.name] - f.center) / f.half_range for f in factors_of(study)
    ])  # fmt: skip


def natural(study: Study, points: np.ndarray) -> pd.DataFrame:
    """Return the settings of coded points, a column a factor."""
    columns = zip(factors_of(study), np.atleast_2d(points).T, strict=True)
    return pd.DataFrame({f.name: f.center + f.half_range * column for f, column in columns})


def first_points(study: Study, runs: Runs) -> pd.DataFrame:
    """Points of the first design, and the published one."""
    design = latin_hypercube(factors_of(study), runs.first, seed=21)
    table = natural(study, design.coded.to_numpy(float))
    return pd.concat([table, pd.DataFrame([PUBLISHED])], ignore_index=True)


def second_points(study: Study, compatible: np.ndarray, count: int) -> pd.DataFrame:
    """Points that spread over the compatible settings (coded) and somewhat beyond."""
    center = compatible.mean(axis=0)
    around = np.clip(center + 1.5 * (compatible - center), -1.0, 1.0)
    spread = np.maximum(around.std(axis=0), 1e-6)
    chosen = [int(np.argmin((((around - center) / spread) ** 2).sum(axis=1)))]
    while len(chosen) < count:
        apart = ((around[:, None] - around[chosen]) / spread) ** 2
        chosen.append(int(np.argmax(apart.sum(axis=2).min(axis=1))))
    return natural(study, around[chosen])


def batch(points: pd.DataFrame, stage: str, speeds: tuple[int, ...], seed: int) -> pd.DataFrame:
    """Lay out the drums of points at some speeds, a row each."""
    rows = [
        {"stage": stage, "point": number, "rpm": rpm, "seed": seed + 100 * rpm + number, **point}
        for number, point in enumerate(points.to_dict("records"))
        for rpm in speeds
    ]
    return pd.DataFrame(rows)


def case_of(study: Study, row: pd.Series) -> Case:
    """Build the case of a row."""
    settings = {factor.name: float(row[factor.name]) for factor in study.factors}
    return _filled(study, float(row[FILL.name])).case(settings, int(row["seed"]), f"rpm{int(row['rpm'])}")


def grain_count(study: Study, fill: float) -> int:
    """Return the number of grains that take a part of the drum's volume."""
    case = study.case({}, 0)
    drum = math.pi / 4 * case.scene.diameter**2 * case.scene.length
    grain = case.grains.mean(lambda shape: shape.volume)
    sizes = case.grains.draw(20_000, 0).sizes
    return round(fill * drum / (grain * float(np.mean(sizes**3))))


@cache
def _filled_at(scale: str | None, fill: float) -> Study:
    study = load_study(STUDY, scale)
    return load_study(STUDY, scale, {"scene": {"drum": {"grain_count": grain_count(study, fill)}}})


def _filled(study: Study, fill: float) -> Study:
    return _filled_at(study.scale, fill)


def measured() -> pd.DataFrame:
    """Measured edges [mm]: rpm, x_mm, and the heights at which pictures are 20, 50 and 80 % dark."""
    return pd.read_csv(HERE / "data" / "profiles.csv", comment="#")


def places() -> np.ndarray:
    """Places of the measured edges, across the drum [m]."""
    return np.sort(measured()["x_mm"].unique()) * 1e-3
