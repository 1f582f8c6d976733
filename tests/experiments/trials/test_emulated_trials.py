"""The decision rules on banks drawn from an emulator: a confusion matrix in seconds."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from scipy import stats
from synthetic import OBSERVABLES, SETTINGS, emulator, space

from experiments.trials.declaration import declared_effects
from experiments.trials.drawing import STRONG
from experiments.trials.emulated import REPLICATES, World, draw_truths, run_trial, summary
from experiments.trials.emulated_simulator import EmulatedSimulator, emulated_heaps

KNOWN = emulator().without("twin")


@pytest.fixture(scope="module")
def table() -> pd.DataFrame:
    # Every emulator of the analyses is that of a bank with its own noise.
    worlds = [World.of(EmulatedSimulator(KNOWN), SETTINGS, seed) for seed in (2, 3)]
    rows = []
    for number, world in enumerate(worlds):
        for truth in draw_truths(world.known, world.effects, 1, seed=100 * number):
            if truth.kind == "one" or (truth.kind == "none" and number == 0):
                rows.append(run_trial(world, OBSERVABLES, truth))
    return pd.DataFrame(rows)


def test_a_complete_model_is_not_accused(table: pd.DataFrame) -> None:
    nulls = table[table["kind"] == "none"]
    assert nulls["right"].sum() >= len(nulls) - stats.binom.isf(1e-3, len(nulls), 0.025)


def test_what_is_above_one_and_a_half_gamma80_is_named(table: pd.DataFrame) -> None:
    singles = table[table["kind"] == "one"]
    assert len(singles) == 12
    # The aim is 80 %.
    assert singles["right"].sum() >= stats.binom.ppf(1e-3, len(singles), 0.8)
    assert not singles["wrong"].any()


def test_intervals_of_sizes_cover_though_the_bank_has_noise(table: pd.DataFrame) -> None:
    named = table[table["z"].notna()]
    z = named["z"].astype(float)
    assert len(named) >= 6
    assert named["covered"].sum() >= stats.binom.ppf(1e-3, len(named), 0.9)
    assert np.sum(z**2) < stats.chi2.isf(1e-3, len(z))


def test_the_summary_counts_every_trial(table: pd.DataFrame) -> None:
    counted = summary(table)
    assert counted[
        [name for name in counted.columns if name in set(table["verdict"])]
    ].to_numpy().sum() == len(table)


def test_sizes_drawn_are_strong_and_inside_their_range() -> None:
    effects = {effect.name: effect for effect in declared_effects(KNOWN, SETTINGS, REPLICATES)}
    for truth in draw_truths(KNOWN, tuple(effects.values()), 3, seed=1):
        for name, size in truth.sizes:
            assert STRONG * effects[name].detectable * (1.0 - 1e-9) <= size <= effects[name].maximum


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
