"""Slips in measured data, on the shipped bank: found before anything else, named, and left out."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from emulated import EmulatedSimulator, emulated_heaps

from doe.discrepancy import Emulator, Measured, Verdict, drive, fit_emulator
from doe.discrepancy.contest.slips import find_slips
from experiments.discover.search import Search
from experiments.measurement.measured_file import read_measured
from experiments.studyfile import load_study
from experiments.studyfile.observables import OBSERVABLES

TRIAL = Path(__file__).parents[3] / "experiments" / "studies" / "trial" / "study.toml"
STUDY = load_study(TRIAL, "bench")
SEARCH = Search.of(STUDY)
BANK = SEARCH.read_bank(TRIAL.with_name("bank-bench.npz"))
LENGTHS = tuple(one.name for one in OBSERVABLES if one.unit == "m")
TIMES = tuple(one.name for one in OBSERVABLES if one.unit == "s")


@cache
def known() -> Emulator:
    """Return the emulator of the bank."""
    return fit_emulator(BANK)


def heaps(seed: int, **sizes: float) -> Measured:
    theta = SEARCH.space.natural_theta(np.array([0.3, -0.2, 0.1]))
    natural = {name: SEARCH.space.natural_size(name, size) for name, size in sizes.items()}
    measured = emulated_heaps(EmulatedSimulator(known()), tuple(theta), natural, 8, seed)
    return replace(measured, kinds=(LENGTHS, TIMES))


def times(measured: Measured, names: tuple[str, ...], factor: float) -> Measured:
    wrong = np.where(np.isin(measured.observables, names), factor, 1.0)
    return replace(measured, values={name: rows * wrong for name, rows in measured.values.items()})


def exchanged(measured: Measured, first: str, second: str) -> Measured:
    values = {**measured.values, first: measured.values[second], second: measured.values[first]}
    return replace(measured, values=values)


def test_a_slip_shows_with_an_effect_and_observables_that_the_bank_lacks() -> None:
    seen = heaps(5, rolling_torque=1.0)
    measured = replace(
        seen,
        observables=(*seen.observables, "outline_1"),
        values={name: np.hstack([rows, rows[:, :1]]) for name, rows in seen.values.items()},
        kinds=((*LENGTHS, "outline_1"), TIMES, ("outline_1", "outline_2")),
    )
    wrong = times(measured, (*LENGTHS, "outline_1"), 0.001)
    [slip] = find_slips(wrong, known(), SEARCH.settings)
    assert set(slip.observables) == {*LENGTHS, "outline_1"}
    assert slip.factor == pytest.approx(0.001)
    assert slip.q_without < slip.q_with / 1.5


def test_two_slips_are_found_one_after_the_other() -> None:
    measured = exchanged(times(heaps(5), LENGTHS, 10.0), "fast", "wide")
    # with one mechanism, as each that a slip might pass for is fitted after every value left out
    first, second = find_slips(measured, known().without(*SEARCH.space.names[1:]), SEARCH.settings)
    assert (set(first.observables), first.factor) == (set(LENGTHS), 10.0)
    assert second.exchanged
    assert set(second.conditions) == {"fast", "wide"}


def test_a_heap_of_another_scale_is_one_slip() -> None:
    measured = heaps(3)
    measured.values["wide"][2] *= 2.5
    [slip] = find_slips(measured, known(), SEARCH.settings)
    assert (slip.conditions, slip.replicate) == (("wide",), 3)
    assert set(slip.observables) == set(measured.observables)


def test_one_value_typed_times_three_is_named_and_left_out() -> None:
    measured = heaps(3)
    measured.values["rough"][4, measured.observables.index("height")] *= 3.0
    found = drive(SEARCH.analysis(measured, BANK, seed=1), EmulatedSimulator(known()))
    [slip] = found.slips
    assert (slip.observables, slip.conditions, slip.replicate) == (("height",), ("rough",), 5)
    assert slip.factor == pytest.approx(3.0)
    assert found.without_slips is not None
    assert found.without_slips.verdict is Verdict.NONE


def test_exchanged_columns_are_one_slip() -> None:
    seen = heaps(3)
    first, second = (seen.observables.index(name) for name in ("r90", "t55"))
    for rows in seen.values.values():
        rows[:, [first, second]] = rows[:, [second, first]]
    [slip] = find_slips(seen, known(), SEARCH.settings)
    assert (slip.observables, slip.exchanged, slip.is_open) == (("r90", "t55"), True, False)


@pytest.mark.parametrize(("factor", "is_open"), [(10.0, False), (-1.0, False), (2.0, True), (5.0, True)])
def test_an_observable_that_is_off_everywhere_is_open_unless_a_usual_factor_says_why(
    factor: float, is_open: bool
) -> None:
    # an effect that acts on the fill alone may well double it; no effect turns its sign
    [slip] = find_slips(times(heaps(3), ("fill_height",), factor), known(), SEARCH.settings)
    assert (slip.observables, slip.is_open) == (("fill_height",), is_open)


def test_an_effect_near_a_usual_factor_is_open_where_it_differs_between_conditions() -> None:
    measured = heaps(3)
    for rows, factor in zip(measured.values.values(), (6.0, 14.0, 10.0, 8.0, 12.0), strict=True):
        rows[:, measured.observables.index("fill_height")] *= factor
    [slip] = find_slips(measured, known(), SEARCH.settings)
    assert (slip.factor, slip.is_open) == (None, True)


def test_effects_are_no_slips() -> None:
    # Sizes at the end of their range: Q of the base is hundreds.
    at_end = [heaps(4, **{name: 1.0}) for name in SEARCH.space.names]
    both = heaps(6, plate_tilt=1.0, vibration=1.0)
    measured = read_measured(TRIAL.with_name("tilted-bench.csv"), STUDY)
    assert all(find_slips(each, known(), SEARCH.settings) == () for each in (*at_end, both, measured))


def test_valid_data_have_no_slips() -> None:
    # An outlier of eight standard deviations in 480 values: never.
    assert all(find_slips(heaps(seed), known(), SEARCH.settings) == () for seed in range(4))


def test_an_observable_that_is_zero_in_all_heaps_is_no_factor_of_another() -> None:
    measured = heaps(3)
    for rows in measured.values.values():
        rows[:, measured.observables.index("height")] = 0.0
    # no warning of a division (pytest makes it an error), and no factor that 0 could be typed by
    found = find_slips(measured, known(), SEARCH.settings)
    assert all(slip.factor is None for slip in found if "height" in slip.observables)
