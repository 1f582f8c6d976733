"""Fresh runs around the optimum of an emulator that is off."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from synthetic_world import CONDITIONS, OBSERVABLES, SETTINGS, SyntheticSimulator, emulator, measure, space

from doe.discrepancy import bank_points, fit_emulator, make_bank
from doe.discrepancy.emulation.condition_surfaces import all_terms
from doe.discrepancy.emulation.correction import Prior, condition_on
from doe.discrepancy.fitting.fitted_model import Model, Shift, Stack
from doe.discrepancy.fitting.measured_means import Block, gather
from doe.discrepancy.fitting.misses import Runs, likeliest_shift, misses
from doe.discrepancy.fitting.model_fit import fit, weigh
from doe.discrepancy.fitting.refinement import correct
from doe.discrepancy.fitting.size_interval import coded_size_interval

OFF = np.array([0.1, -0.05, 0.08, -0.06])
"""The world is the emulator at parameters that are larger by this."""
CENTRE = np.array([0.2, -0.1, 0.1, 0.5])


def model() -> Model:
    return Model(emulator().without("twin"), ("delta",), 0.0)


def runs_of_a_world_that_is_off(seed: int) -> Runs:
    """Two runs of sixteen points around the centre in every condition."""
    rng = np.random.default_rng(seed)
    x = np.repeat(CENTRE + 0.1 * rng.standard_normal((16, 4)), 2, axis=0)
    values = []
    for condition in CONDITIONS:
        noise = model().emulator.surfaces[condition].noise_covariance(CENTRE, ("delta",))
        scatter = rng.multivariate_normal(np.zeros(len(noise)), noise, len(x))
        values.append(model().predict(x + OFF, condition) + scatter)
    return Runs(np.tile(x, (len(CONDITIONS), 1)), np.repeat(CONDITIONS, len(x)), np.concatenate(values))


def test_a_shift_of_the_parameters_is_found_within_its_error() -> None:
    squares = []
    for seed in range(20):
        runs = runs_of_a_world_that_is_off(seed)
        shift = likeliest_shift(model(), runs, CENTRE, np.ones(runs.values.shape[1]))
        missed = shift.value - OFF
        squares.append(missed @ np.linalg.solve(shift.spread, missed))
    # 20 sums of squares of four normal numbers; the prior is far wider than the error.
    assert stats.chi2.ppf(1e-3, 80) < np.sum(squares) < stats.chi2.isf(1e-3, 80)


def test_a_corrected_model_predicts_the_world_that_is_off() -> None:
    corrected = correct(model(), runs_of_a_world_that_is_off(1), CENTRE)
    for condition in CONDITIONS:
        sd = np.sqrt(np.diag(model().emulator.surfaces[condition].noise_covariance(CENTRE, ("delta",))))
        truth = model().predict(CENTRE[None] + OFF, condition)
        before, after = (
            np.abs(one.predict(CENTRE[None], condition) - truth) / sd for one in (model(), corrected)
        )
        # 32 runs leave 0.18 standard deviations of each mean, and less where observables share a shift.
        assert after.max() < 0.5
        assert after.mean() < 0.5 * before.mean()


def test_the_error_of_the_shift_widens_what_is_said_of_a_size() -> None:
    evidence = gather(measure({"delta": 0.6}, 3), model().emulator)
    plain = fit(Stack(model(), evidence.training))
    spread = 3.0 * plain.whole_spread
    shifted = weigh(Stack(replace(model(), shift=Shift(np.zeros(4), spread)), evidence.training), plain.x)
    # But for the ranges, known of the parameters, not of the shift: squared, 1e-3 of what is open.
    np.testing.assert_allclose(shifted.errors, 2.0 * plain.errors, rtol=1e-3)
    widths = [np.diff(coded_size_interval(one, 0))[0] for one in (plain, shifted)]
    # Twice as wide where the profile is a parabola.
    assert 1.8 < widths[1] / widths[0] < 2.2


def corrected_by_runs(shift: np.ndarray, runs: Runs) -> Model:
    """Model whose shift is given, corrected by what runs show it to miss besides."""
    shifted = replace(model(), shift=Shift(shift, 0.02 * np.eye(4)))
    ones = np.ones(len(OBSERVABLES))
    seen = {name: misses(shifted, runs, CENTRE, ones, name) for name in CONDITIONS}
    corrections = {
        name: condition_on(one.prior(1.0), one.x, one.missed, one.noise, one.correlation, ones)
        for name, one in seen.items()
    }
    return replace(shifted, corrections=corrections)


def test_corrections_take_back_what_another_shift_does_to_the_emulated() -> None:
    runs = runs_of_a_world_that_is_off(2)
    known = corrected_by_runs(OFF, runs)
    for condition in CONDITIONS:
        slopes = known.shift_slopes(CENTRE, Block.of_runs(condition, np.arange(len(OBSERVABLES)), 8))
        for step, slope in zip(0.02 * np.eye(4), slopes.T, strict=True):
            sides = [corrected_by_runs(OFF + side * step, runs) for side in (1.0, -1.0)]
            ahead, behind = (one.predict(CENTRE[None], condition)[0] for one in sides)
            # The same differences, of which the corrections are linear.
            np.testing.assert_allclose((ahead - behind) / 0.04, slope, atol=1e-6 * np.abs(slopes).max())


def test_what_noise_in_the_slopes_opens_does_not_reach_the_null() -> None:
    fitted = fit(Stack(model(), gather(measure({"delta": 1.0}, 2), model().emulator).training))
    value, none, whole = fitted.x[-1], fitted.null_size_errors[0], 0.45 * fitted.x[-1]
    fitted.__dict__["whole_spread"] = fitted.spread * (whole / none) ** 2
    low, high = coded_size_interval(fitted, 0)
    # Fieller's lower end, where the profile is a parabola; an error of 0.45 of the size, the same for every
    # size, would leave 0.26 of it. The upper end is open.
    chi2 = stats.chi2.ppf(0.9, 1)
    slope = (whole**2 - none**2) / value**2
    ends = np.roots([1.0 - chi2 * slope, -2.0 * value, value**2 - chi2 * none**2])
    assert low == pytest.approx(min(ends), rel=0.05)
    assert low > 0.4 * value
    assert high == 1.0


def test_the_promise_of_a_model_is_its_score_but_for_what_is_uncertain_of_its_predictions() -> None:
    fitted = fit(Stack(model(), gather(measure({"delta": 1.0}, 2), model().emulator).training))
    noise = fitted.stack.noise(fitted.x)
    assert fitted.promise < fitted.score
    assert fitted.promise == pytest.approx(fitted.q + np.linalg.slogdet(noise)[1])


def test_information_is_larger_than_it_is_by_what_noise_in_the_slopes_feigns() -> None:
    # Banks of a world that scatters ten times as much: slopes are as much noise as slopes. Two banks share no
    # noise, so that slopes of the one times those of the other are as large as expected ones squared.
    noisy, known = SyntheticSimulator(space(("delta",)), 10.0), space(("delta",))
    evidence = gather(measure({"delta": 1.0}, 1), emulator()).training
    slopes, feigned = [], []
    precision = np.linalg.inv(Stack(model(), evidence).noise(CENTRE))
    for seed in range(8):
        points = bank_points(known, SETTINGS, seed)
        of_bank = fit_emulator(make_bank(known, OBSERVABLES, points, noisy(points)))
        stack = Stack(Model(of_bank, ("delta",), 0.0), evidence)
        slopes.append(stack.jacobian(CENTRE[None])[0])
        feigned.append(np.diag(stack.feigned_information(CENTRE, precision)))
    seeming = np.einsum("bip,ij,cjp->bcp", slopes, precision, slopes)
    own, count = np.einsum("bbp->bp", seeming), len(slopes)
    too_much = own - (seeming.sum(axis=1) - own) / (count - 1)
    error = too_much.std(axis=0, ddof=1) / count**0.5
    # Student's t of 7 degrees of freedom passes 5.4 in one case of a thousand.
    assert (np.abs(too_much.mean(axis=0) - np.mean(feigned, axis=0)) < 5.4 * error).all()
    assert (too_much.mean(axis=0)[:3] > 5.4 * error[:3]).any()


def test_noise_of_bank_and_fresh_runs_moves_a_corrected_prediction_as_much_as_is_said() -> None:
    rng = np.random.default_rng(8)
    points, at = rng.uniform(-0.5, 0.5, (6, 2)), rng.uniform(-0.5, 0.5, (2, 2))
    terms, noise = all_terms(points, 1), np.full((6, 1), 0.3)
    of_bank = np.linalg.inv(10.0 * np.eye(terms.shape[1]) + 1.0)
    prior = Prior(1, 1.5 * of_bank[None], of_bank[None], np.array([0.2]), np.array([0.7, 0.35]))
    moved = []
    for _ in range(2000):
        bank_error = rng.multivariate_normal(np.zeros(len(of_bank)), of_bank)
        missed = rng.normal(0.0, noise**0.5) - (terms @ bank_error)[:, None]
        learnt = condition_on(prior, points, missed, noise, np.eye(1), np.ones(1))
        moved.append(all_terms(at, 1) @ bank_error + learnt.mean(at)[:, 0])
    # A variance of 2000 has an error of 3.2 %; 5 of them.
    np.testing.assert_allclose(np.diag(np.cov(np.transpose(moved))), np.diag(learnt.chance(at)[0]), rtol=0.16)
