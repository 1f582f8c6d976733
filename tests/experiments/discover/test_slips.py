"""Slips in measured data, on the shipped bank: found before anything else, named, and left out once."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from doe.discrepancy import Measured, Verdict, drive, fit_emulator
from doe.discrepancy.contest.slips import find_slips
from experiments.discover.search import Search
from experiments.measurement.observables import OBSERVABLES
from experiments.studyfile import load_study
from experiments.trials.emulated_simulator import EmulatedSimulator, emulated_heaps

TRIAL = Path(__file__).parents[3] / "experiments" / "studies" / "trial" / "study.toml"
SEARCH = Search.of(load_study(TRIAL, "bench"))
BANK = SEARCH.read_bank(TRIAL.with_name("bank-bench.npz"))
KNOWN = fit_emulator(BANK)
LENGTHS = tuple(one.name for one in OBSERVABLES if one.unit == "m")
TIMES = tuple(one.name for one in OBSERVABLES if one.unit == "s")


def heaps(seed: int, **sizes: float) -> Measured:
    theta = SEARCH.space.natural_theta(np.array([0.3, -0.2, 0.1]))
    natural = {name: SEARCH.space.natural_size(name, size) for name, size in sizes.items()}
    measured = emulated_heaps(EmulatedSimulator(KNOWN), tuple(theta), natural, 8, seed)
    return replace(measured, kinds=(LENGTHS, TIMES))


def times(measured: Measured, names: tuple[str, ...], factor: float) -> Measured:
    wrong = np.where(np.isin(measured.observables, names), factor, 1.0)
    return replace(measured, values={name: rows * wrong for name, rows in measured.values.items()})


@pytest.mark.parametrize(("names", "factor"), [(LENGTHS, 10.0), (TIMES, 1000.0), (("t55",), 0.001)])
def test_a_slip_of_units_is_named_with_its_factor(names: tuple[str, ...], factor: float) -> None:
    [slip] = find_slips(times(heaps(1), names, factor), KNOWN, SEARCH.settings)
    assert set(slip.observables) == set(names)
    assert slip.factor == pytest.approx(factor)
    assert slip.q_without < slip.q_with / 1.5


def test_two_conditions_exchanged_are_named() -> None:
    measured = heaps(2)
    values = {**measured.values, "fast": measured.values["wide"], "wide": measured.values["fast"]}
    [slip] = find_slips(replace(measured, values=values), KNOWN, SEARCH.settings)
    assert slip.exchanged
    assert set(slip.conditions) == {"fast", "wide"}


def test_one_value_typed_times_three_is_named_and_left_out() -> None:
    measured = heaps(3)
    measured.values["rough"][4, measured.observables.index("height")] *= 3.0
    found = drive(SEARCH.analysis(measured, BANK, seed=1), EmulatedSimulator(KNOWN))
    [slip] = found.slips
    assert (slip.observables, slip.conditions, slip.replicate) == (("height",), ("rough",), 5)
    assert slip.factor == pytest.approx(3.0)
    assert found.without_slips is not None
    assert found.without_slips.verdict is Verdict.NONE


def test_effects_are_no_slips() -> None:
    # Sizes at the end of their range: Q of the base is hundreds.
    for name in SEARCH.space.names:
        assert find_slips(heaps(4, **{name: 1.0}), KNOWN, SEARCH.settings) == ()


def test_sound_data_have_no_slips() -> None:
    # An outlier of eight standard deviations in 480 values: never.
    assert all(find_slips(heaps(seed), KNOWN, SEARCH.settings) == () for seed in range(4))
