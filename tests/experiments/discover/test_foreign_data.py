"""Heaps that did not come out of our own engine, on the shipped bank: their scatter, their optimum.

The truth is the emulator of the bank, so that nothing is simulated; what an emulator misses is no part of it.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from shutil import copy

import numpy as np
import pytest
from emulated import EmulatedSimulator, emulated_heaps
from scipy import stats

from doe import discrepancy
from doe.discrepancy.contest.gap import OF_THE_BASE, find_gap
from doe.discrepancy.contest.held_out import forecast
from doe.discrepancy.contest.signatures import signatures
from doe.discrepancy.emulation.bank import sobol_points
from doe.discrepancy.fitting.fitted_model import Model, Stack
from doe.discrepancy.fitting.measured_means import gather
from doe.discrepancy.fitting.model_fit import Fitted, fit, weigh
from doe.discrepancy.fitting.size_interval import coded_size_interval
from doe.discrepancy.verdict.records import calibration_uses
from experiments.discover.search import Search
from experiments.measurement.instrument_error import usual_error
from experiments.measurement.measured_file import read_measured
from experiments.studyfile import load_study
from experiments.studyfile.observables import BY_NAME

TRIAL = Path(__file__).parents[3] / "experiments" / "studies" / "trial" / "study.toml"
SYSTEMATIC = 0.2
"""Systematic error of the trial study at this scale."""
REPLICATES = 8


@cache
def search() -> Search:
    return Search.of(load_study(TRIAL, "bench"))


@cache
def bank() -> discrepancy.Bank:
    return search().read_bank(TRIAL.with_name("bank-bench.npz"))


@cache
def known() -> discrepancy.Emulator:
    return discrepancy.fit_emulator(bank())


def theta(seed: int) -> np.ndarray:
    return np.random.default_rng([seed, 7]).uniform(-0.9, 0.9, len(known().space.factors))


def heaps(coded: Mapping[str, float], seed: int) -> discrepancy.Measured:
    space = known().space
    sizes = {name: space.natural_size(name, size) for name, size in coded.items()}
    simulator = EmulatedSimulator(known())
    return emulated_heaps(simulator, tuple(space.natural_theta(theta(seed))), sizes, REPLICATES, seed)


def with_reading_errors(measured: discrepancy.Measured, deviations: float, seed: int) -> discrepancy.Measured:
    """Add a number of standard deviations of one run to each value."""
    rng = np.random.default_rng([seed, 8])
    values = {}
    for condition, rows in measured.values.items():
        sd = np.sqrt(known().surfaces[condition].noise.variance(theta(seed)))
        values[condition] = rows + deviations * sd * rng.standard_normal(rows.shape)
    return discrepancy.Measured(measured.conditions, measured.observables, values)


def fitted(measured: discrepancy.Measured, *mechanisms: str) -> Fitted:
    """Fit the base with these mechanisms to the training conditions."""
    evidence = gather(measured, known())
    model = Model(known(), mechanisms, SYSTEMATIC, views=evidence.views)
    return fit(Stack(model, evidence.training))


def base_p(measured: discrepancy.Measured) -> float:
    """Return the p value of the gap of the calibrated base, with which an analysis begins."""
    evidence = gather(measured, known())
    base = fit(Stack(Model(known(), (), SYSTEMATIC), evidence.training))
    whole = weigh(Stack(base.model, (*evidence.training, *evidence.held_out)), base.x)
    return find_gap(whole, signatures(whole), 0.025, 1000, 1, OF_THE_BASE).p


def test_errors_of_reading_raise_no_alarm() -> None:
    data = [with_reading_errors(heaps({}, seed), 2.0, seed) for seed in range(12)]
    alarms = sum(base_p(measured) < 0.025 for measured in data)
    # All that a rate of 2.5 % gives but for a probability of 1 in 1000.
    assert alarms <= stats.binom.isf(1e-3, len(data), 0.025)


def test_scatter_of_heaps_is_separated_from_errors_of_reading() -> None:
    found = []
    for seed in range(6):
        quiet = heaps({}, seed)
        centred = {name: rows - quiet.mean(name) for name, rows in quiet.values.items()}
        wide = {name: quiet.mean(name) + 2.0 * rows for name, rows in centred.items()}
        for measured, errors in (
            (discrepancy.Measured(quiet.conditions, quiet.observables, wide), 0.0),
            (quiet, 2.0),
        ):
            evidence = gather(with_reading_errors(measured, errors, seed), known())
            model = Model(known(), (), SYSTEMATIC)
            excess = model.excess(theta(seed), evidence.training[0].scatter)
            found.append((excess.runs, float(excess.reading.mean())))
    spread, read = np.mean(found[0::2], axis=0), np.mean(found[1::2], axis=0)
    # A variance of 6 x 35 deviations has a relative error of sqrt(2 / 210) = 0.1, its parts some more: three.
    assert spread[0] == pytest.approx(4.0, rel=0.3)
    assert spread[1] == pytest.approx(0.0, abs=0.3 * 4.0)
    assert read[0] == pytest.approx(1.0, abs=0.3 * 2.0)
    assert read[1] == pytest.approx(4.0, rel=0.3)


def test_scatter_that_an_effect_widens_is_charged_once() -> None:
    # Under the largest rolling torque the angle scatters nearly twice as much.
    charged = []
    for seed in range(6):
        evidence = gather(heaps({"rolling_torque": 1.0}, seed), known())
        x = np.append(theta(seed), 1.0)
        model = Model(known(), ("rolling_torque",), SYSTEMATIC)
        for block in evidence.training:
            surfaces = known().surfaces[block.condition]
            true = np.diag(surfaces.noise_covariance(x, model.mechanisms))[block.columns] / REPLICATES
            bias = surfaces.noise.inverse_bias(len(block.columns))
            charged.append(np.diag(model.noise(x, block)) / bias / true)
    # Of what 35 replicates scatter by chance, what is above the model's counts: some 0.1 of a variance.
    assert np.mean(charged) == pytest.approx(1.0, abs=0.2)


def test_a_fit_ends_no_higher_than_the_truth_or_any_other_place() -> None:
    hidden = {"plate_tilt": 0.39, "rolling_torque": 0.77}
    names = tuple(sorted(hidden))
    evidence = gather(heaps(hidden, 0), known())
    for mechanisms in (names, names[:1]):
        stack = Stack(Model(known(), mechanisms, SYSTEMATIC), evidence.training)
        low, high = stack.model.lower, stack.model.upper
        places = list(low + sobol_points(64, len(low), 3) * (high - low))
        places.append(np.append(theta(0), [hidden[name] for name in mechanisms]))
        # The descent ends where a step brings 0.01 or less.
        assert fit(stack).score <= min(weigh(stack, x).score for x in places) + 0.01


def test_a_tilt_is_found_where_the_middle_of_the_ranges_leads_to_none() -> None:
    hidden = {"plate_tilt": 0.5, "vibration": 0.9}
    # Two optima: down the score from the middle the tilt ends at 0, some 7 above the least.
    found = fitted(heaps(hidden, 2), *sorted(hidden))
    tilt = found.mechanisms.index("plate_tilt")
    assert abs(found.coded_sizes[tilt] - hidden["plate_tilt"]) < 3.0 * found.coded_size_errors[tilt]
    assert found.coded_sizes[tilt] > 0.3


def test_an_interval_holds_its_size_even_where_nothing_fits() -> None:
    # The score of a gross misfit asks for large sizes, whose predictions are uncertain; q for small ones.
    measured = shifted(heaps({"rolling_torque": 1.0}, 1), "height", 0.01)
    for name in known().space.names:
        found = fitted(measured, name)
        low, high = coded_size_interval(found, 0)
        assert low <= found.coded_sizes[0] <= high


def shifted(measured: discrepancy.Measured, observable: str, offset: float) -> discrepancy.Measured:
    """Move all values of an observable alike."""
    moved = offset * (np.array(measured.observables) == observable)
    return replace(measured, values={name: rows + moved for name, rows in measured.values.items()})


def test_a_common_error_is_allowed_where_the_file_states_it() -> None:
    late = 0.03  # a clock; 3 to 5 standard deviations of one run, which the factors take up in part
    alarms = {False: 0, True: 0}
    for seed in range(6):
        measured = shifted(heaps({}, seed), "t55", late)
        for stated in alarms:
            calibration = {"t55": discrepancy.Calibration(late)} if stated else {}
            alarms[stated] += base_p(replace(measured, calibration=calibration)) < 0.025
    assert alarms[True] <= stats.binom.isf(1e-3, 6, 0.025)
    assert alarms[False] >= 4


def test_a_calibration_error_hides_no_effect_that_looks_otherwise() -> None:
    calibration = {name: usual_error(BY_NAME[name]) for name in known().observables}
    seen = [base_p(replace(heaps({"plate_tilt": 0.8}, seed), calibration=calibration)) for seed in range(4)]
    # a tilt of five degrees leans by several standard deviations of the mean in every condition
    assert max(seen) < 0.025


def test_the_record_says_how_much_of_an_allowance_a_model_uses() -> None:
    late = 0.02
    measured = replace(shifted(heaps({}, 1), "t55", late), calibration={"t55": discrepancy.Calibration(late)})
    [used] = calibration_uses(fitted(measured), gather(measured, known()))
    assert (used.observable, used.offset, used.scale) == ("t55", late, 0.0)
    # Its error is that of five means of eight, of 11 ms a run, and what the prior draws: some 2 ms and 1.
    assert used.used_offset == pytest.approx(late, abs=3 * 0.003)
    assert used.deviations == pytest.approx(abs(used.used_offset) / late)


def test_lengths_of_one_instrument_are_off_by_one_scale() -> None:
    # Pictures whose scale is off by 4 %, and one length alone that is: the first is what a scale does.
    share, whole = 0.04, heaps({}, 1)
    lengths = [
        name for name in whole.observables if BY_NAME[name].by_photograph and BY_NAME[name].unit == "m"
    ]
    assert len(lengths) > 2
    used = {}
    for several, moved in ((True, lengths), (False, lengths[-1:])):
        values = {
            name: rows * np.where(np.isin(whole.observables, moved), 1.0 + share, 1.0)
            for name, rows in whole.values.items()
        }
        for instrument in ("pictures", ""):
            scale = discrepancy.Calibration(scale=share, instrument=instrument)
            measured = replace(whole, values=values, calibration=dict.fromkeys(lengths, scale))
            uses = calibration_uses(fitted(measured), gather(measured, known()))
            used[several, instrument] = [one.used_scale for one in uses]
    of_all, of_one = used[True, "pictures"], used[False, "pictures"]
    assert of_all == pytest.approx([of_all[0]] * len(lengths))
    # the factors take up a part of it
    assert share / 2.0 < of_all[0] < 1.5 * share
    # other lengths of the pictures say that their scale is right; each with a scale of its own could not
    assert abs(of_one[-1]) < share / 4.0
    assert used[False, ""][-1] > share / 2.0


def test_a_forecast_takes_over_what_the_fit_shows_to_be_off() -> None:
    measured = shifted(heaps({}, 2), "t55", 0.03)
    missed = []
    for calibration in ({}, {"t55": discrepancy.Calibration(0.03)}):
        stated = replace(measured, calibration=calibration)
        held_out = gather(stated, known()).held_out
        found = forecast(fitted(stated), held_out)
        column = list(held_out[0].columns).index(known().observables.index("t55"))
        missed.append(abs(found.measured - found.predicted)[column])
    assert missed[1] < 0.01 < missed[0]


def test_without_a_tilt_every_lean_is_noise() -> None:
    emulator, lean = known(), known().observables.index("asymmetry")
    rng = np.random.default_rng(2)
    for name in (None, *emulator.space.names):
        names = () if name is None else (name,)
        x = rng.uniform(0.0, 1.0, (20, 3 + len(names)))
        for surfaces in emulator.surfaces.values():
            leans = surfaces.predict(x, names)[:, lean]
            error = surfaces.error(x[0], names)[lean]
            if name == "plate_tilt":
                assert np.all(leans > 0.0)
                assert error[lean] > 0.0
            else:
                np.testing.assert_array_equal(leans, 0.0)
                np.testing.assert_array_equal(error, 0.0)
                correlation = surfaces.correlation(x[0], names)[lean]
                np.testing.assert_array_equal(np.delete(correlation, lean), 0.0)


def seen_from(measured: discrepancy.Measured, cosine: float) -> discrepancy.Measured:
    """Return heaps seen by a camera elsewhere: their mean leans by the cosine of the azimuth."""
    lean = measured.observables.index("asymmetry")
    values = {name: rows.copy() for name, rows in measured.values.items()}
    for name, rows in values.items():
        mean = measured.mean(name)[lean]
        rows[:, lean] = cosine * mean + (1.0 if cosine >= 0.0 else -1.0) * (rows[:, lean] - mean)
    return replace(measured, values=values)


def test_a_tilt_is_fitted_alike_from_behind() -> None:
    found = fitted(seen_from(heaps({"plate_tilt": 0.7}, 0), -1.0), "plate_tilt")
    assert found.model.heading == 180.0
    # 90 % of intervals: within 3.5 standard errors but for one in 2000 cases.
    assert abs(found.coded_sizes[0] - 0.7) < 3.5 * found.coded_size_errors[0]


def test_a_tilt_along_the_line_of_sight_is_fitted_though_nothing_leans() -> None:
    found = fitted(seen_from(heaps({"plate_tilt": 1.0}, 1), 0.0), "plate_tilt")
    # Azimuths are tried in steps of 30 degrees.
    assert abs(np.cos(np.radians(found.model.heading))) < 0.51
    assert found.ratios[0] > 3.0


def test_conditions_seen_from_different_sides_are_one_tilt() -> None:
    whole = heaps({"plate_tilt": 0.7}, 2)
    behind = seen_from(whole, -1.0)
    mixed = replace(whole, values={**whole.values, "fast": behind.values["fast"]}, views={"fast": 180.0})
    scores = [fitted(measured, "plate_tilt").score for measured in (whole, mixed)]
    # The same numbers with other signs: two descents end within a last step of each other.
    assert scores[1] == pytest.approx(scores[0], abs=0.01)


def test_a_camera_of_the_study_mirrors_the_lean_of_its_condition(tmp_path: Path) -> None:
    text = TRIAL.read_text(encoding="utf-8")
    turned = text.replace("[condition.wide]", '[condition.wide]\ncamera = "180 deg"')
    study_file = tmp_path / "study.toml"
    study_file.write_text(turned, encoding="utf-8")
    copy(TRIAL.with_name("clump.txt"), tmp_path)
    tilted = TRIAL.with_name("tilted-bench.csv")
    leans = []
    for path in (TRIAL, study_file):
        measured = read_measured(tilted, load_study(path, "bench"))
        model = Model(known(), ("plate_tilt",), SYSTEMATIC, views=gather(measured, known()).views)
        x, lean = np.array([[0.0, 0.0, 0.0, 0.8]]), known().observables.index("asymmetry")
        leans.append([model.predict(x, name)[0, lean] for name in known().space.conditions])
    seen = np.where(np.array(known().space.conditions) == "wide", -1.0, 1.0)
    np.testing.assert_allclose(leans[1], seen * leans[0], rtol=1e-12)
    assert min(leans[0]) > 0.0


def test_the_same_heaps_from_behind_are_named_with_their_direction() -> None:
    found = discrepancy.drive(
        search().analysis(seen_from(heaps({"plate_tilt": 0.8}, 4), -1.0), bank(), seed=1),
        EmulatedSimulator(known()),
    )
    assert found.named == ("plate_tilt",)
    assert found.chosen is not None
    assert found.chosen.heading == 180.0
