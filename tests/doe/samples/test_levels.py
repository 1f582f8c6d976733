"""Stated levels, small and seeded: after a selection, of a climb, a screening, an agreement.

The long simulations are the record in experiments/evidence/accuracy/statistics.
"""

import numpy as np
import pytest

import doe
from doe import Factor, Goal, Sample, agreement, compare_means, fit_surface, plackett_burman, screen

FACTORS = [Factor("A", -1.0, 1.0), Factor("B", -1.0, 1.0)]
DESIGN = doe.central_composite(FACTORS)
POINT = {"A": 0.4, "B": -0.5}


def close(share: float, stated: float, trials: int) -> bool:
    """Tell if a share is within four binomial standard deviations of what is stated."""
    return abs(share - stated) < 4.0 * np.sqrt(stated * (1.0 - stated) / trials)


def test_intervals_and_regions_after_a_reduction_are_those_of_the_full_model() -> None:
    rng = np.random.default_rng(91)
    full = fit_surface(DESIGN, rng.standard_normal(len(DESIGN.coded)) + DESIGN.coded["A"].to_numpy())
    reduced = full.reduce(0.05)
    assert reduced.dropped
    assert reduced.unselected is full
    ends = ["se", "confidence_low", "confidence_high", "prediction_low", "prediction_high"]
    np.testing.assert_array_equal(reduced.predict(POINT)[ends], full.predict(POINT)[ends])
    target = Sample(0.3, 0.5, 4)
    np.testing.assert_array_equal(
        reduced.compatible_region(target, resolution=30).mask,
        full.compatible_region(target, resolution=30).mask,
    )
    joint, expected = (doe.joint_fit({"a": Goal(fit, target)}, resolution=30) for fit in (reduced, full))
    np.testing.assert_array_equal(joint.region().mask, expected.region().mask)
    # The mean is that of the equation which the reduced model writes.
    coded = np.array([list(POINT.values())])
    assert reduced.predict(POINT)["mean"].iloc[0] == reduced.quadratic_form.value(coded)[0]
    # Terms that are named before the data are seen leave a model of its own.
    assert full.drop("A^2").unselected.terms == full.drop("A^2").terms
    assert full.drop("A^2").reduce(0.05).unselected.terms == full.drop("A^2").terms


def test_a_reduced_surface_covers_the_true_mean() -> None:
    rng = np.random.default_rng(92)
    mean = DESIGN.points.to_numpy() @ [0.6, 0.3] + 0.3 * DESIGN.points.prod(axis=1).to_numpy()
    truth = 0.6 * 0.4 - 0.3 * 0.5 - 0.3 * 0.2
    trials = 30
    inside = 0
    for _ in range(trials):
        row = fit_surface(DESIGN, mean + rng.standard_normal(len(mean))).reduce(0.05).predict(POINT).iloc[0]
        inside += row["confidence_low"] <= truth <= row["confidence_high"]
    assert close(inside / trials, 0.95, trials)


def test_one_strong_interaction_does_not_alarm_by_default() -> None:
    rng = np.random.default_rng(94)
    design = plackett_burman([Factor(f"x{i}", -1.0, 1.0) for i in range(5)], 12)
    mean = 3.0 * design.points["x0"] * design.points["x1"]
    trials, alarms = 40, np.zeros(2)
    for _ in range(trials):
        response = mean.to_numpy()[:, None] + rng.standard_normal((12, 3))
        alarms += [bool(screen(design, response, rule).significant()) for rule in (None, "pooled")]
    assert alarms[0] / trials < 0.10
    assert alarms[1] / trials > 0.5


@pytest.mark.parametrize(("factors", "runs"), [(7, 8), (11, 12)])
def test_lenths_false_alarms_come_at_the_level(factors: int, runs: int) -> None:
    rng = np.random.default_rng(95)
    design = plackett_burman([Factor(f"x{i}", -1.0, 1.0) for i in range(factors)], runs)
    result = screen(design, rng.standard_normal(runs))
    assert result.error_rule == "lenth"
    critical, trials = result.critical_t(0.05), 2_000
    effects = rng.standard_normal((trials, factors))
    size = np.abs(effects)
    kept = np.where(size < 3.75 * np.median(size, axis=1, keepdims=True), size, np.nan)
    alarms = (size > critical * 1.5 * np.nanmedian(kept, axis=1, keepdims=True)).mean()
    assert close(alarms, 0.05, trials)
    assert (result.table["p"] < 0.05).tolist() == (result.table["t"].abs() > critical).tolist()
    assert result.anova.loc["x0", "p"] == result.table.loc["x0", "p"]


def test_welch_is_the_default_and_the_guarded_test_agrees_with_itself() -> None:
    rng = np.random.default_rng(97)
    for sizes in ((2, 6), (4, 12)):
        a, b = (rng.standard_normal(size) for size in sizes)
        plain, guarded = compare_means(a, b, 1.0), compare_means(a, b, 1.0, "guarded")
        assert plain.method == "welch"
        assert guarded.equivalence_p is not None
        low, high = guarded.interval
        # p, the interval and the smallest margin agree with one another.
        at_edge = compare_means(a - a.mean() + high - low, b - b.mean(), method="guarded", alpha=0.05)
        assert at_edge.different == (at_edge.interval[0] > 0.0)
        limit = guarded.smallest_margin
        assert compare_means(a, b, 1.001 * limit, "guarded").equivalent
        assert not compare_means(a, b, 0.999 * limit, "guarded").equivalent


@pytest.mark.parametrize("noise", [0.5, 1.0])
def test_the_misfit_without_noise_is_as_often_too_low_as_too_high(noise: float) -> None:
    rng = np.random.default_rng(98)
    truth, trials = np.linspace(10.0, 34.0, 10), 600
    below, inside, mean = 0, 0, 0.0
    for _ in range(trials):
        values = truth + 1.0 + np.sqrt(noise) * rng.standard_normal(10)
        reference = truth + np.sqrt(noise) * rng.standard_normal(10)
        found = agreement(values, reference, noise, noise).rmse_without_noise
        below, inside = below + (found.value < 1.0), inside + (found.low <= 1.0 <= found.high)
        mean += found.value / trials
    assert close(below / trials, 0.5, trials)
    # At least .95 where the misfits share a bias.
    assert inside / trials > 0.94
    # The unbiased square's root reads .93 and .85.
    assert mean > (0.97 if noise == 0.5 else 0.91)
