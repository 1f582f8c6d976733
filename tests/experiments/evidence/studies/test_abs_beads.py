"""The bands of the study of ABS beads, on a made-up model that is linear in the parameters."""

import numpy as np
import pandas as pd
import pytest
from scipy.stats import norm

from experiments.evidence.studies.abs_beads.__main__ import (
    QUANTITIES,
    READINGS,
    bands,
    errors,
    parameter_sets,
)

SLOPES = np.array([40.0, 10.0, 100.0, 50.0, 5.0, 0.0])
NOISE = 0.8


def test_a_band_holds_the_errors_of_readings_model_and_seed() -> None:
    """Its half width is z sqrt(sum (slope error)^2 + noise^2) but for the surface, which 33 degrees know."""
    rng, means = np.random.default_rng(3), np.array([mean for mean, *_ in READINGS.values()])
    tables = []
    for scene, observable, _ in QUANTITIES.values():
        table = pd.DataFrame(parameter_sets(), columns=list(READINGS)).assign(scene=scene)
        exact = 25.0 + (parameter_sets() - means) @ SLOPES
        tables.append(table.assign(**{observable: exact + rng.normal(0.0, NOISE, len(table))}))
    found = bands(pd.concat(tables))
    for model, rows in found.groupby("model_error"):
        expected = norm.ppf(0.95) * np.hypot(np.linalg.norm(SLOPES * errors(float(model))), NOISE)
        # the variance of the rest varies by a quarter (33 degrees of freedom); the mean of six by a tenth
        assert 0.5 * (rows["high"] - rows["low"]).mean() == pytest.approx(expected, rel=0.2)
        assert rows["middle"].mean() == pytest.approx(
            25.0, abs=3.0 * NOISE / np.sqrt(6 * len(parameter_sets()))
        )
