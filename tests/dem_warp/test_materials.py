"""Materials: published constants of the buckwheat study, limits, and refused values."""

import math

import pytest

from dem_warp.materials import Material, damping_coefficient, effective_moduli, rayleigh_time

GRAIN = Material(density=698.0, shear_modulus=34.325e6, poisson_ratio=0.29)
STEEL = Material(density=7800.0, shear_modulus=70e9, poisson_ratio=0.30)


def test_rayleigh_time_of_a_buckwheat_sphere_of_one_millimetre():
    # The reference is given to seven digits.
    assert rayleigh_time(1e-3, GRAIN) == pytest.approx(1.533373e-5, rel=5e-7)


def test_effective_moduli_of_the_study_at_mid_levels():
    # The references are given to seven digits.
    assert effective_moduli(GRAIN, GRAIN) == pytest.approx((48.34507e6, 10.03655e6), rel=5e-7)
    assert effective_moduli(GRAIN, STEEL) == pytest.approx((96.64342e6, 20.06332e6), rel=5e-7)


def test_effective_moduli_against_a_rigid_body_are_those_of_the_soft_one():
    rigid = Material(density=1.0, shear_modulus=1e30, poisson_ratio=0.3)
    youngs, shear = effective_moduli(GRAIN, rigid)
    # The rigid body's compliance is 1e-22 of the grain's: rounding is all that is left.
    assert youngs == pytest.approx(GRAIN.youngs_modulus / (1.0 - 0.29**2), rel=1e-14)
    assert shear == pytest.approx(GRAIN.shear_modulus / (2.0 - 0.29), rel=1e-14)


def test_damping_at_the_restitution_of_a_half():
    # |beta| = ln 2 / sqrt(ln^2 2 + pi^2), divided through by ln 2.
    expected = 2.0 * math.sqrt(5.0 / 6.0) / math.hypot(1.0, math.pi / math.log(2.0))
    assert damping_coefficient(0.5) == pytest.approx(expected, rel=1e-14)


def test_damping_grows_as_restitution_falls_and_stays_below_its_limit():
    values = [damping_coefficient(e) for e in (0.9, 0.5, 0.18, 1e-3, 1e-300)]
    assert values == sorted(values)
    assert values[-1] < 2.0 * math.sqrt(5.0 / 6.0)
