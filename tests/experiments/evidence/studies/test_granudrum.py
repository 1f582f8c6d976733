"""Probabilities of listed settings, on curves whose truth is known."""

import numpy as np
import pytest

from doe.curves.curve_emulator import CurveEmulator
from experiments.evidence.studies.granudrum.candidates import Candidates


def drawn(points: np.ndarray, seed: int) -> np.ndarray:
    """Draw a line at each point, whose noise grows e-fold from the middle of the setting to its end."""
    noise = 0.3 * np.exp(points) * np.random.default_rng(seed).normal(size=(len(points), 1))
    return (np.sin(2.0 * points) + noise) * np.ones(5)


def test_candidates_are_as_probable_as_they_are_often_true():
    points = np.random.default_rng(7).uniform(-1.0, 1.0, (300, 1))
    emulators = {
        name: CurveEmulator.of(points, drawn(points, seed), varying=True)
        for name, seed in (("a", 8), ("b", 9))
    }
    found = Candidates(emulators, np.linspace(-0.95, 0.95, 20)[:, None])
    truths = np.random.default_rng(10).integers(20, size=400)
    made = {name: drawn(found.settings[truths], seed) for name, seed in (("a", 11), ("b", 12))}
    runs = [{name: curves[run] for name, curves in made.items()} for run in range(400)]
    weights = np.array([found.weights(run) for run in runs])
    assert weights.sum(axis=1) == pytest.approx(1.0)
    # of 400 draws a share of .05 is .011 off, and the mean probability of the truth .02
    rejected = np.mean([found.p_values(run)[true] < 0.05 for run, true in zip(runs, truths, strict=True)])
    assert rejected == pytest.approx(0.05, abs=0.035)
    assert weights[np.arange(400), truths].mean() == pytest.approx((weights**2).sum(axis=1).mean(), abs=0.04)
