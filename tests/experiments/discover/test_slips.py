"""Slips in measured data, on the shipped bank: found before anything else, named, and left out."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from emulated import EmulatedSimulator, emulated_heaps

from doe.discrepancy import Measured, Verdict, drive, fit_emulator
from doe.discrepancy.contest.slips import find_slips
from experiments.discover.search import Search
from experiments.measurement.measured_file import read_measured
from experiments.studyfile import load_study
from experiments.studyfile.observables import OBSERVABLES

TRIAL = Path(__file__).parents[3] / "experiments" / "studies" / "trial" / "study.toml"
STUDY = load_study(TRIAL, "bench")
SEARCH = Search.of(STUDY)
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


def exchanged(measured: Measured, first: str, second: str) -> Measured:
    values = {**measured.values, first: measured.values[second], second: measured.values[first]}
    return replace(measured, values=values)


TILTED = read_measured(TRIAL.with_name("tilted-bench.csv"), STUDY)


@pytest.mark.parametrize(("names", "factor"), [(LENGTHS, 10.0), (("t55",), 0.001)])
def test_a_slip_of_units_is_named_with_its_factor(names: tuple[str, ...], factor: float) -> None:
    [slip] = find_slips(times(heaps(1), names, factor), KNOWN, SEARCH.settings)
    assert set(slip.observables) == set(names)
    assert slip.factor == pytest.approx(factor)
    assert slip.q_without < slip.q_with / 1.5


def test_a_slip_is_found_beside_observables_that_the_bank_lacks() -> None:
    known = heaps(1)
    outlines = {name: np.hstack([rows, rows[:, :1]]) for name, rows in known.values.items()}
    measured = replace(
        known,
        observables=(*known.observables, "outline_1"),
        values=outlines,
        kinds=((*LENGTHS, "outline_1"), TIMES, ("outline_1", "outline_2")),
    )
    [slip] = find_slips(times(measured, (*LENGTHS, "outline_1"), 10.0), KNOWN, SEARCH.settings)
    assert set(slip.observables) == {*LENGTHS, "outline_1"}
    assert slip.factor == pytest.approx(10.0)


def test_two_conditions_exchanged_are_named() -> None:
    measured = heaps(2)
    [slip] = find_slips(exchanged(measured, "fast", "wide"), KNOWN, SEARCH.settings)
    assert slip.exchanged
    assert set(slip.conditions) == {"fast", "wide"}


@pytest.mark.parametrize("measured", [heaps(5, rolling_torque=1.0), TILTED])
def test_slips_show_beside_an_effect(measured: Measured) -> None:
    assert find_slips(measured, KNOWN, SEARCH.settings) == ()
    for wrong, names, factor in (
        (times(measured, LENGTHS, 10.0), LENGTHS, 10.0),
        (times(measured, TIMES, 0.001), TIMES, 0.001),
        (exchanged(measured, "fast", "wide"), measured.observables, None),
    ):
        [slip] = find_slips(wrong, KNOWN, SEARCH.settings)
        assert set(slip.observables) == set(names) & set(measured.observables)
        assert slip.factor == factor
        assert slip.exchanged is (factor is None)


def test_two_slips_are_found_one_after_the_other() -> None:
    wrong = times(times(heaps(5, plate_tilt=0.8), LENGTHS, 10.0), TIMES, 1000.0)
    found = find_slips(wrong, KNOWN, SEARCH.settings)
    assert [(set(slip.observables), slip.factor) for slip in found] == [
        (set(LENGTHS), 10.0),
        (set(TIMES), 1000.0),
    ]
    measured = exchanged(times(heaps(5), LENGTHS, 10.0), "fast", "wide")
    first, second = find_slips(measured, KNOWN, SEARCH.settings)
    assert (set(first.observables), first.factor) == (set(LENGTHS), 10.0)
    assert second.exchanged


def test_a_heap_of_another_scale_is_one_slip() -> None:
    measured = heaps(3)
    measured.values["wide"][2] *= 2.5
    [slip] = find_slips(measured, KNOWN, SEARCH.settings)
    assert (slip.conditions, slip.replicate) == (("wide",), 3)
    assert set(slip.observables) == set(measured.observables)


def test_two_effects_at_once_are_no_slips() -> None:
    for pair in (("plate_tilt", "vibration"), ("rolling_torque", "size_spread")):
        assert find_slips(heaps(6, **dict.fromkeys(pair, 1.0)), KNOWN, SEARCH.settings) == ()


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
