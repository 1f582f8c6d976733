"""A factor as a response of its own: values, joint fits with it, and what is refused."""

import numpy as np
import pytest
from scipy import stats

from doe import (
    DesignError,
    Factor,
    FactorSurface,
    Goal,
    Sample,
    StatedValue,
    central_composite,
    fit_surface,
    joint_fit,
)

DESIGN = central_composite((Factor("E", 0.3, 0.5), Factor("F", 0.2, 0.6)), center=5)
TRUTH = {"E": 0.44, "F": 0.36}


def plane(point: dict[str, float]) -> float:
    return 30.0 + 20.0 * (point["E"] - 0.4) + 15.0 * (point["F"] - 0.4)


def angle(noise: float | np.ndarray = 0.0) -> Goal:
    """Fit a plane whose target is that of the truth."""
    rows = [plane(row) for row in DESIGN.natural.to_dict("records")]
    rng = np.random.default_rng(3)
    shaken = np.array(rows) + (0.1 * rng.standard_normal(len(rows)) if np.isscalar(noise) else noise)
    return Goal(fit_surface(DESIGN, shaken, "first-order"), Sample(plane(TRUTH), 0.2, 5))


def test_its_value_is_the_factors_and_its_error_is_known() -> None:
    surface = FactorSurface(DESIGN, "F", 0.01)
    coded = np.array([[0.3, -1.0], [1.0, 0.5]])
    mean, se = surface.evaluate(coded)
    assert mean == pytest.approx([0.2, 0.5])
    assert se == pytest.approx([0.01, 0.01])
    assert surface.quadratic_form.value(coded) == pytest.approx(mean)
    assert surface.residual_df == np.inf


def test_alone_it_accepts_what_the_reading_does() -> None:
    # A stated value without an error of the model: the normal interval.
    reading = StatedValue(0.4, 0.02)
    region = joint_fit({"F": Goal(FactorSurface(DESIGN, "F"), reading)}, resolution=400).region()
    reach = stats.norm.isf(0.025) * 0.02
    cell = 0.4 * np.sqrt(2.0) / 400  # to one cell
    assert region.ranges.loc["F"].tolist() == pytest.approx([0.4 - reach, 0.4 + reach], abs=1.01 * cell)


def test_errors_of_readings_and_model_add_up() -> None:
    goal = Goal(FactorSurface(DESIGN, "F", 0.03), Sample(0.4, 0.08, 4))
    found = joint_fit({"F": goal}, resolution=10).tests({"E": 0.4, "F": 0.5}).loc["F"]
    assert found["t"] == pytest.approx(0.1 / np.hypot(0.03, 0.04))
    # Welch and Satterthwaite: the model's part is known, that of the readings has three degrees of freedom.
    assert found["df"] == pytest.approx((0.03**2 + 0.04**2) ** 2 / (0.04**4 / 3.0))


def test_a_plane_and_a_reading_meet_in_a_point() -> None:
    reading = Goal(FactorSurface(DESIGN, "F", 0.001), Sample(TRUTH["F"], 0.005, 5))
    fit = joint_fit({"angle": angle(), "F": reading}, resolution=60)
    # E: the error of the angle, 0.1, over its slope of 20
    assert fit.point == pytest.approx(TRUTH, abs=0.01)
    assert fit.share() < 0.3 * fit.share("angle")


def test_the_conflict_is_the_distance_over_all_errors() -> None:
    """E and F are read, the angle is a third equation: its distance is that of three measurements of two."""
    readings = {"E": Sample(TRUTH["E"], 0.02, 9), "F": Sample(TRUTH["F"] + 0.1, 0.03, 9)}
    goals = {"angle": angle()} | {name: Goal(FactorSurface(DESIGN, name), s) for name, s in readings.items()}
    fit = joint_fit(goals, resolution=60)
    point = fit.point | {"F": TRUTH["F"]}
    error = fit.tests(point).loc["angle"]
    angle_se = np.hypot(error["fitted_se"], error["target_se"])
    slopes = goals["angle"].surface.coefficients
    gap = fit.goals["angle"].fit.predict({"E": TRUTH["E"], "F": TRUTH["F"] + 0.1})["mean"].iloc[0] - plane(
        TRUTH
    )
    total = np.sqrt(angle_se**2 + sum((slopes[name] * s.se) ** 2 for name, s in readings.items()))
    size, p = fit.conflict("F")
    # the error of the fit differs a little from point to point, and the pull to the centre
    assert size == pytest.approx(abs(gap) / total, rel=0.03)
    assert p == pytest.approx(2.0 * stats.t.sf(size, 8), rel=0.02)
    assert fit.conflict("E")[0] == pytest.approx(size, rel=1e-3)


def test_what_the_others_leave_open_cannot_disagree() -> None:
    reading = Goal(FactorSurface(DESIGN, "F"), Sample(0.5, 0.01, 5))
    size, p = joint_fit({"angle": angle(), "F": reading}, resolution=60).conflict("F")
    assert size == pytest.approx(0.0, abs=0.05)  # the pull to the centre
    assert p > 0.9


def test_joint_regions_with_readings_hold_the_truth() -> None:
    """200 drawn sets: a share of .95 is known to .0154."""
    rng, inside = np.random.default_rng(11), 0
    for _ in range(200):
        own = angle(0.1 * rng.standard_normal(len(DESIGN.coded)))
        goals = {"angle": Goal(own.surface, Sample.of(plane(TRUTH) + 0.2 * rng.standard_normal(4)))}
        readings = TRUTH["F"] + 0.01 * rng.standard_normal() + 0.03 * rng.standard_normal(4)
        goals["F"] = Goal(FactorSurface(DESIGN, "F", 0.01), Sample.of(readings))
        inside += joint_fit(goals, resolution=12).agrees(TRUTH)
    assert inside / 200 == pytest.approx(0.95, abs=3.0 * 0.0154)


def test_wrong_factors_and_values_are_refused() -> None:
    with pytest.raises(DesignError, match="no factor is named 'G'; the design has E, F"):
        FactorSurface(DESIGN, "G")
    with pytest.raises(DesignError, match="se"):
        FactorSurface(DESIGN, "E", -0.1)
    with pytest.raises(DesignError, match="n of a stated value must be 1"):
        StatedValue(0.4, 0.1, 2)
    with pytest.raises(DesignError, match="must have a spread"):
        Goal(FactorSurface(DESIGN, "E"), StatedValue(0.4, 0.0))
