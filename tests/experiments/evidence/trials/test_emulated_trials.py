"""The decision rules on banks drawn from an emulator: a confusion matrix in seconds."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from scipy import stats
from synthetic import OBSERVABLES, SETTINGS, emulator, space

from experiments.evidence.trials.drawing import STRONG
from experiments.evidence.trials.emulated import World, draw_trials, judged, run_trial, size_errors
from experiments.evidence.trials.emulated_simulator import EmulatedSimulator, emulated_heaps
from experiments.evidence.trials.score import covered, share
from experiments.evidence.trials.truth import Kind

KNOWN = emulator().without("twin")


@pytest.fixture(scope="module")
def table() -> pd.DataFrame:
    # Every emulator of the analyses is that of a bank with its own noise.
    tables = []
    for number in (0, 1):
        world = World.of(EmulatedSimulator(KNOWN), SETTINGS, number + 2)
        wanted = (Kind.SINGLE,) if number else (Kind.SINGLE, Kind.NULL)
        trials = [trial for trial in draw_trials(world, 1, 100 * number) if trial[0].kind in wanted]
        tables.append(judged([run_trial(world, OBSERVABLES, trial) for trial in trials], trials))
    return pd.concat(tables, ignore_index=True)


def test_a_complete_model_is_not_accused(table: pd.DataFrame) -> None:
    nulls = table[table["kind"] == Kind.NULL]
    assert len(nulls) == 4
    assert nulls["alarm"].sum() <= stats.binom.isf(1e-3, len(nulls), 0.025)


def test_what_is_above_one_and_a_half_detectable_sizes_is_named(table: pd.DataFrame) -> None:
    singles = table[table["kind"] == Kind.SINGLE]
    assert len(singles) == 12
    assert (singles["multiple"] > STRONG).all()
    # The aim is 80 %.
    assert singles["right"].sum() >= stats.binom.ppf(1e-3, len(singles), 0.8)
    assert not singles["wrong"].any()


def test_intervals_of_sizes_cover_though_the_bank_has_noise(table: pd.DataFrame) -> None:
    z, inside = size_errors(table), share(covered(table))
    assert len(z) == inside.trials >= 6
    assert inside.count >= stats.binom.ppf(1e-3, inside.trials, 0.9)
    assert np.sum(z**2) < stats.chi2.isf(1e-3, len(z))


def test_the_emulated_simulator_answers_in_the_columns_of_the_bank() -> None:
    simulator = EmulatedSimulator(KNOWN)
    point = space().point(np.zeros(3), (), "base", 7)
    first, second = simulator([point, point]).values  # noqa: PD011
    assert len(first) == len(simulator.observables)
    np.testing.assert_array_equal(first, second)


def test_emulated_heaps_scatter_about_the_emulator_as_its_noise_says() -> None:
    theta = tuple(space().natural_theta(np.array([0.2, -0.3, 0.1])))
    heaps = emulated_heaps(EmulatedSimulator(KNOWN), theta, {"beta": 1.0}, 400, 3)
    surfaces = KNOWN.surfaces["wide"]
    x = np.array([0.2, -0.3, 0.1, 0.5])
    sd = np.sqrt(np.diag(surfaces.noise_covariance(x, ("beta",))))
    away = (heaps.mean("wide") - surfaces.predict(x[None], ("beta",))[0]) / sd * np.sqrt(400.0)
    assert np.abs(away).max() < 4.5
    # A standard deviation of 400 has a relative error of 1 / sqrt(800); four of those.
    np.testing.assert_allclose(
        np.sqrt(np.diag(heaps.covariance("wide"))) / sd, 1.0, atol=4.0 / np.sqrt(800.0)
    )


def test_a_bend_adds_its_own_variance_and_the_same_in_every_process() -> None:
    straight, bent = EmulatedSimulator(KNOWN), EmulatedSimulator(KNOWN, 0.5)
    rng = np.random.default_rng(0)
    points = [space().point(rng.uniform(-1.0, 1.0, 3), (), "base", 7) for _ in range(200)]
    bends, none = bent(points), straight(points)
    added = np.asarray(bends.values) - np.asarray(none.values)
    sd = np.sqrt(KNOWN.surfaces["base"].noise.variance(np.zeros(3)))
    # A box of 3 by 3 by 3 lengths has some 20 independent places, and there are 12 observables: 3 errors.
    assert np.mean((added / sd) ** 2) == pytest.approx(0.25, rel=3.0 * np.sqrt(2.0 / 240.0))
