"""Plan of the study: seven data on one grain, and the tests that are simulated for them."""

import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import qmc

from experiments.studyfile import Study, load_study

HERE = Path(__file__).parent

SHELLS = ("soil", "steel", "PLA", "acrylic")
"""Materials of shell and back; the cover is of the last one."""

GRAIN = ("mu", "mu_r")
"""Factors that all data share."""

SETTINGS = (*GRAIN, *(f"mu_{name}" for name in (*SHELLS, "tube")))
"""Settings of all tests: the grain, and the friction of each wall."""

LEVEL, HEAP, DENSITY = "level", "heap", "density"
"""Data next to the inclined drums, which are named by their shells."""

RESPONSES = {"target": "dynamic_angle", "inclined": "dynamic_angle", "heap": "angle", "bed": "bulk_density"}
"""Number of each scene of the study."""

POINTS = {
    "h200": {"target": 22, "inclined": 22, "heap": 44, "bed": 44},
    "bench": {"target": 12, "inclined": 12, "heap": 24, "bed": 16},
}
"""Cases of each scene by scale of the study."""


class Datum(NamedTuple):
    """A measured mean."""

    mean: float
    error: float
    """Its standard error."""


def study_at(scale: str) -> Study:
    """Load the study at a scale."""
    return load_study(HERE / "study.toml", scale)


def data() -> dict[str, Datum]:
    """Return all data by their names [deg, kg/m3]; README.md has their sources and what is assumed."""
    angles = np.genfromtxt(
        HERE / "angles.csv", delimiter=",", dtype=None, names=True, skip_header=2, encoding="utf-8"
    )
    inclined = {
        name: Datum(float(found.mean()), 2.92 / math.sqrt(len(found)))
        for name in SHELLS
        for found in [angles["angle_deg"][angles["shell"] == name]]
    }
    level = Datum(36.17, 3.12 / math.sqrt(20))
    heap = Datum(31.7, 2.0 / math.sqrt(10))  # the spread of one heap is not published: 2 degrees
    # next to the published error, 2 % for the density of the kernels, which are of another laboratory
    density = Datum(711.7, math.hypot(5.7, 0.02 * 711.7))
    return {LEVEL: level, **inclined, HEAP: heap, DENSITY: density}


def planned_cases(study: Study, scale: str) -> list[dict[str, Any]]:
    """Lay out the cases: a Latin hypercube over the factors for each scene."""
    rows = []
    for number, (scene, count) in enumerate(POINTS[scale].items()):
        cube = qmc.LatinHypercube(len(study.factors), optimization="random-cd", rng=31 + number)
        for point, place in enumerate(2.0 * cube.random(count) - 1.0):
            row = {
                f.name: f.center + f.half_range * float(x) for f, x in zip(study.factors, place, strict=True)
            }
            rows.append({"scene": scene, "seed": 5000 + 100 * number + point} | row)
    return rows
