"""Sizes in natural and in coded units, and what saturates."""

import math

import numpy as np
import pytest
from synthetic_world import SATURATION, saturating_bank

from doe.discrepancy import MechanismRange, fit_emulator


@pytest.mark.parametrize("saturation", [None, 0.5, 0.05])
@pytest.mark.parametrize(("null", "maximum"), [(0.0, 0.6), (3.0, 1.0)])
def test_sizes_come_back_from_coded_units(null: float, maximum: float, saturation: float | None) -> None:
    mechanism = MechanismRange("m", null, maximum, saturation=saturation)
    assert [mechanism.coded(null), mechanism.coded(maximum)] == pytest.approx([0.0, 1.0])
    for coded in (0.0, 0.2, 0.9, 1.0):
        # a saturation of a twelfth of the range leaves a double 10 of its 16 digits at the far end
        assert mechanism.coded(mechanism.natural(coded)) == pytest.approx(coded, abs=1e-9)


def test_over_one_saturation_the_effect_of_a_step_falls_to_1_over_e() -> None:
    mechanism = MechanismRange("m", 0.0, 2.0, saturation=SATURATION)
    steps = [mechanism.coded(at + 1e-6) - mechanism.coded(at) for at in (0.0, SATURATION, 2.0 * SATURATION)]
    assert steps[0] / steps[1] == pytest.approx(math.e, rel=1e-4)
    assert steps[1] / steps[2] == pytest.approx(math.e, rel=1e-4)


def test_a_bank_keeps_its_sizes_under_another_saturation() -> None:
    _, bank = saturating_bank()
    saturating = bank.saturating({"alpha": SATURATION, "beta": 1.0})
    sizes = [one.natural(size) for size in saturating.coded_size for one in saturating.space.mechanisms]
    assert sizes == pytest.approx(2.0 * bank.coded_size, abs=1e-9)
    assert saturating.saturating({"alpha": None}).coded_size == pytest.approx(bank.coded_size, abs=1e-9)


def test_an_emulator_that_knows_the_saturation_is_right_where_the_other_is_not() -> None:
    world, bank = saturating_bank()
    saturating = bank.saturating({"alpha": SATURATION})
    misses = []
    for known in (bank, saturating):
        emulator, errors = fit_emulator(known), []
        for natural in np.linspace(0.1, 2.0, 20):
            x = np.array([[0.0, 0.0, 0.0, emulator.space.coded_size("alpha", natural)]])
            seen = 2.0 * MechanismRange("alpha", 0.0, 2.0, saturation=SATURATION).coded(natural)
            truth = world.mean(emulator.space.natural_theta(x[0, :3]), {"alpha": seen}, "base")
            surfaces = emulator.surfaces["base"]
            deviations = np.sqrt(surfaces.noise.variance(np.zeros((1, 3)))[0])
            errors.append((surfaces.predict(x, ("alpha",))[0] - truth) / deviations)
        misses.append(np.sqrt(np.mean(np.square(errors))))
    # .48 to .66 over ten banks
    assert misses[1] < 0.75 * misses[0]
