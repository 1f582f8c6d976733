"""Twins with slips, or with an effect on one observable, are what they say, and get the right headline."""

import numpy as np
import pytest

from experiments.evidence.trials import slip_trials
from experiments.evidence.trials.baselines.emulated_world import true_world
from experiments.evidence.trials.slip_trials import KINDS, answer, twin


@pytest.mark.parametrize("kind", KINDS)
def test_only_what_is_said_to_be_wrong_is_wrong(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    measured, names = twin(kind, 5)
    monkeypatch.setattr(slip_trials, "distortion", lambda *_: (list(range(12)), np.ones((5, 12)), []))
    right, _ = twin(kind, 5)
    for condition in right.conditions:
        wrong = (measured.values[condition] != right.values[condition]).all(axis=0)
        assert {name for name, off in zip(right.observables, wrong, strict=True) if off} == set(names)


@pytest.mark.parametrize(
    ("kind", "number", "said"),
    [("unit", 0, "slip"), ("exchanged columns", 0, "slip"), ("effect on one", 1, "slip or effect")],
)
def test_a_unit_and_exchanged_columns_are_slips_and_an_effect_may_be_one(
    kind: str, number: int, said: str
) -> None:
    truth, settings = true_world()
    assert answer(*twin(kind, number), truth.emulator, settings) == said
