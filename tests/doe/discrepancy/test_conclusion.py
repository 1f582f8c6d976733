"""When two models count as told apart."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from doe.discrepancy.verdict.conclusion import is_open, lag, telling_apart

MARGIN = 6.0
DRAWS = 100_000


def test_models_that_look_the_same_are_told_apart_by_chance_in_one_case_of_twenty() -> None:
    rng = np.random.default_rng(1)
    # Twelve means with unit noise about the true model; the other lies as far off as still looks the same.
    data = rng.standard_normal((DRAWS, 12))
    other = np.full(12, np.sqrt(MARGIN / 12.0))
    behind = ((data - other) ** 2).sum(axis=1) - (data**2).sum(axis=1)
    apart = np.mean([not is_open(value, True, MARGIN) for value in behind])
    # The share's standard error is sqrt(0.05 * 0.95 / 1e5) = 0.0007; four of them.
    assert apart == pytest.approx(0.05, abs=0.0028)


def test_models_that_do_not_look_the_same_are_open_within_the_margin() -> None:
    assert is_open(MARGIN - 1e-9, False, MARGIN)
    assert not is_open(MARGIN, False, MARGIN)


def _candidate(score: float, q: float, simulated: bool = True) -> Any:
    return SimpleNamespace(score=score, gap=SimpleNamespace(q=q), simulated=simulated)


def test_a_model_is_not_behind_for_predicting_uncertainly_alone() -> None:
    best = _candidate(0.0, 50.0)
    assert lag(_candidate(5.0, 90.0), best, MARGIN) == 5.0
    assert lag(_candidate(90.0, 70.0), best, MARGIN) == 20.0 + MARGIN / 2.0
    fits_better = _candidate(90.0, 40.0)
    assert is_open(lag(fits_better, best, MARGIN), False, MARGIN)
    # The emulator alone predicts everything uncertainly.
    assert lag(_candidate(90.0, 40.0, simulated=False), best, MARGIN) == 90.0


def test_models_that_far_apart_are_told_apart_with_the_power() -> None:
    rng = np.random.default_rng(2)
    distance = telling_apart(MARGIN, 0.8) ** 0.5
    # the wrong one is behind by the squared distance and twice the distance times a normal number
    behind = distance**2 + 2.0 * distance * rng.standard_normal(DRAWS)
    apart = np.mean([not is_open(value, True, MARGIN) for value in behind])
    assert apart == pytest.approx(0.8, abs=4.0 * (0.8 * 0.2 / DRAWS) ** 0.5)
