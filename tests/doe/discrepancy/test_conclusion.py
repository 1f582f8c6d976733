"""Rules by which two models count as distinct."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from synthetic_world import emulator, measure

from doe.discrepancy import BeforeAfter, Interval, Verdict
from doe.discrepancy.contest.rivals import certain, is_open, lag, needed, parting, settling
from doe.discrepancy.fitting.fitted_model import Model, Stack
from doe.discrepancy.fitting.measured_means import gather
from doe.discrepancy.fitting.model_fit import fit, whiten
from doe.discrepancy.problem.settings import Settings
from doe.discrepancy.verdict.conclusion import Conclusion, closest_first, open_pairs, withdrawn

MARGIN = 6.0
DRAWS = 100_000


def test_models_that_look_the_same_are_told_apart_by_chance_in_one_case_of_twenty() -> None:
    rng = np.random.default_rng(1)
    # Twelve means with unit noise about the true model; the other lies as far off as still looks the same.
    data = rng.standard_normal((DRAWS, 12))
    other = np.full(12, np.sqrt(MARGIN / 12.0))
    behind = ((data - other) ** 2).sum(axis=1) - (data**2).sum(axis=1)
    apart = np.mean([not is_open(value, 0.999 * MARGIN, MARGIN) for value in behind])
    # The share's standard error is sqrt(0.05 * 0.95 / 1e5) = 0.0007; four of them.
    assert apart == pytest.approx(0.05, abs=0.0028)


def test_models_that_do_not_look_the_same_are_open_within_the_margin() -> None:
    assert is_open(MARGIN - 1e-9, MARGIN, MARGIN)
    assert not is_open(MARGIN, MARGIN, MARGIN)
    assert not is_open(MARGIN, np.inf, MARGIN, 100.0)


def test_a_model_is_not_behind_for_predicting_uncertainly_alone() -> None:
    assert lag(5.0, 40.0, MARGIN) == 5.0
    assert lag(90.0, 20.0, MARGIN) == 20.0 + MARGIN / 2.0
    assert is_open(lag(90.0, -10.0, MARGIN), np.inf, MARGIN)


@pytest.mark.parametrize("apart", [0.0, MARGIN, 4.0 * MARGIN])
def test_of_models_known_badly_the_right_one_is_dismissed_in_one_case_of_twenty_at_most(apart: float) -> None:
    rng = np.random.default_rng(3)
    # 50 means: the data err by one, each of the two emulators by another, and each Q is weighed by both. The
    # wrong model is so far off, weighed so.
    data, errors = rng.standard_normal((20_000, 50)), rng.standard_normal((2, 20_000, 50))
    off = np.full(50, np.sqrt(2.0 * apart / 50.0))
    right = ((data + errors[0]) ** 2).sum(axis=1) / 2.0
    wrong = ((data + errors[1] - off) ** 2).sum(axis=1) / 2.0
    # of each Q the variance is 100; what the data bring to both is half of their residuals
    between = np.sqrt(2.0 * 100.0 - 4.0 * 50.0 / 4.0)
    lost = np.mean([not is_open(behind, apart, MARGIN, between) for behind in right - wrong])
    # Four standard errors, and the tail of chi2 is a little longer than the normal one's.
    assert lost < 0.05 + 4.0 * (0.05 * 0.95 / 20_000) ** 0.5 + 0.003
    if apart == 0.0:
        # without what is open of the predictions it is dismissed in one case of four
        assert np.mean([not is_open(behind, np.inf, MARGIN) for behind in right - wrong]) > 0.25


def test_qs_of_two_models_part_by_what_is_open_of_their_predictions() -> None:
    model = Model(emulator().without("twin"), ("delta",), 0.2)
    fitted = fit(Stack(model, gather(measure({"delta": 0.6}, 3), model.emulator).training))
    rng, left = np.random.default_rng(4), fitted.stack.open_error(fitted.x)
    shared = np.linalg.inv(whiten(fitted.covariance - left)) @ rng.standard_normal((len(left), 4000))
    own = [np.linalg.inv(whiten(left)) @ rng.standard_normal((len(left), 4000)) for _ in range(2)]
    slopes = fitted.sensitivities
    project = np.eye(len(left)) - slopes @ np.linalg.pinv(slopes)
    qs = [((project @ fitted.whitening @ (shared + error)) ** 2).sum(axis=0) for error in own]
    # of a standard deviation from n draws the standard error is 1 / sqrt(2 n) of it; four of them
    assert parting(fitted, fitted) == pytest.approx(np.std(qs[0] - qs[1]), rel=4.0 / 8000**0.5)


def test_a_model_gains_nothing_by_what_is_open_of_it_nor_by_scatter_that_nobody_saw() -> None:
    model = Model(emulator().without("twin"), ("delta",), 0.2)
    fitted = fit(Stack(model, gather(measure({"delta": 0.6}, 3), model.emulator).training))
    # the same residuals with four times the noise: Q falls to a quarter, and the determinant takes it back
    open_ = fitted.stack.open_error(fitted.x)
    wide = 4.0 * (fitted.covariance - open_) + open_
    wider = replace(fitted, covariance=wide, whitening=whiten(wide))
    assert np.sum(wider.residuals**2) < np.sum(fitted.residuals**2)
    assert certain(wider) > certain(fitted) + np.linalg.slogdet(4.0 * np.eye(len(wide)))[1] - fitted.q


@pytest.mark.parametrize(("behind", "gain"), [(0.0, 30.0), (6.0, 12.0), (9.0, 0.0)])
def test_further_data_settle_which_model_is_right_as_often_as_forecast(behind: float, gain: float) -> None:
    rng, limit = np.random.default_rng(2), needed(0.0, MARGIN)
    # the lag of the wrong one in ten further means with unit noise; and the errors of new runs
    means, own = np.full(10, (gain / 10.0) ** 0.5), 3.0
    right = rng.random(DRAWS) < 1.0 / (1.0 + np.exp(-behind / 2.0))
    noise = rng.standard_normal((DRAWS, 10))
    ahead = ((noise + means) ** 2 - noise**2).sum(axis=1) + own * rng.standard_normal(DRAWS)
    settled = np.mean(np.where(right, behind, -behind) + ahead >= limit)
    # four standard errors of a share, at most
    assert settled == pytest.approx(settling(behind, gain, limit, own), abs=4.0 * 0.5 / DRAWS**0.5)


def test_fresh_runs_withdraw_the_right_name_by_chance_in_one_case_of_forty() -> None:
    rng, means, heaps = np.random.default_rng(5), 13, 8
    # a mechanism that does nothing in the held-out conditions: measured means and those of two sets of runs
    measured, *runs = rng.standard_normal((3, DRAWS, means)) / heaps**0.5
    base, named = ((measured - one) / (2.0 / heaps) ** 0.5 for one in runs)
    rises = (named**2).sum(axis=1) - (base**2).sum(axis=1)
    # the standard error from n draws is sqrt((k - 1) / (4 n)) of it, with the kurtosis k = 3.5; four of them
    assert rises.std() == pytest.approx((3.0 * means) ** 0.5, rel=4.0 * (2.5 / 4.0 / DRAWS) ** 0.5)
    name, lost = Conclusion(Verdict.NAMED, ("alpha",), "", 0), 0
    for rise in rises[:4000]:
        before, after = Interval(0.0, 50.0, 99.0), Interval(0.0, 50.0 + rise, 99.0)
        one = BeforeAfter(True, means, before, after, Interval(-1.0, 0.0, 1.0), heaps)
        lost += withdrawn(name, [one]).verdict is Verdict.UNKNOWN
    # 2.3 % beyond two standard deviations if normal, 2.5 % with these tails; four standard errors
    assert lost / 4000 == pytest.approx(0.025, abs=4.0 * (0.025 * 0.975 / 4000) ** 0.5)


def test_what_comes_closest_was_run_and_a_second_effect_brings_more_than_a_little() -> None:
    one = SimpleNamespace(mechanisms=("alpha",), simulated=True, score=20.0)
    far = SimpleNamespace(mechanisms=("alpha", "beta"), simulated=False, score=0.0)
    for score, first in ((20.0 - 0.9 * MARGIN, one), (20.0 - 1.1 * MARGIN, None)):
        pair = SimpleNamespace(mechanisms=("beta", "delta"), simulated=True, score=score)
        ordered = closest_first([one, far, pair], Settings(tie_margin=MARGIN))  # type: ignore[list-item]
        assert ordered[0] is (first or pair)
        assert ordered[-1] is far


def test_open_pairs_say_what_is_in_all_of_them() -> None:
    of = [("beta", "gamma"), ("beta", "delta_two"), ("alpha", "delta_two")]
    pairs: list[Any] = [SimpleNamespace(mechanisms=names) for names in of]
    stands = "no one pair stands out"
    assert open_pairs(pairs[:2]) == f"{stands}: beta with gamma, beta with delta two; beta is in all of them"
    assert open_pairs(pairs[::2]) == f"{stands}: beta with gamma, alpha with delta two"
