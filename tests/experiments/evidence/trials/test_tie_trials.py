"""A repeated condition has more heaps, the published criterion is a mean over pairs, a table counts right."""

import numpy as np
import pandas as pd
import pytest

from experiments.evidence.trials.baselines.emulated_world import REPLICATES, true_world
from experiments.evidence.trials.tie_trials import (
    CHOICES,
    compared,
    contrast,
    heaps_of,
    searched,
)


def test_only_the_repeated_condition_has_more_heaps_and_a_model_differs_from_itself_nowhere() -> None:
    heaps, hidden, _ = heaps_of(0)
    problem, _ = searched(heaps, 0, true_world()[1], heaps.conditions[1], 8)
    seen, drawn = problem.measured.values, heaps.values  # noqa: PD011
    counts = [len(seen[name]) for name in heaps.conditions]
    assert counts == [REPLICATES, 2 * REPLICATES, *[REPLICATES] * (len(counts) - 2)]
    for name, rows in seen.items():
        np.testing.assert_array_equal(rows, drawn[name][: len(rows)])
    one, other = problem.fitted((hidden,)), problem.fitted()
    assert contrast([one, one], "base") == 0.0
    # two of three pairs differ
    three = contrast([one, one, other], "base")
    assert three == pytest.approx(2.0 / 3.0 * contrast([one, other], "base"), rel=1e-9)


def test_hindsight_takes_the_best_answer_of_each_tie() -> None:
    rows = [
        dict.fromkeys(CHOICES, "a") | {"chance": 0.5, "a": "a tie", "b": "the truth"},
        dict.fromkeys(CHOICES, "b") | {"chance": 0.5, "a": "a wrong name", "b": "unknown"},
    ]
    order = ["chance", *CHOICES, "a", "b"]
    found = compared(pd.DataFrame(rows)[order]).set_index("condition")
    assert found.loc["the search", "a tie"] == found.loc["the search", "unknown"] == "1"
    assert found.loc["best in hindsight", "only the search : only it"].startswith("0 : 1 of 2")
    assert found.loc["always a", "a wrong name"] == "1"
