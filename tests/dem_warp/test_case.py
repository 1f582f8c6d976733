"""Cases: what they refuse, and what of them determines a result."""

import json
from dataclasses import fields, is_dataclass, replace

import pytest
from worlds import BALL, BOOT, GRAIN, PYRAMID, STEEL, small_case

import dem_warp
from dem_warp import (
    RELATIVE,
    GrainPopulation,
    Interaction,
    LiftedCylinder,
    Numerics,
    ShapeMixture,
    SizeClasses,
    WallPart,
)
from dem_warp.laws.linear_cohesion import LinearCohesion


def test_the_time_step_is_a_fraction_of_the_smallest_rayleigh_time():
    population = GrainPopulation(PYRAMID, GRAIN, size_mean=1.1, size_sd=0.1)
    case = replace(small_case(), grains=population, numerics=Numerics(0.2, modulus_scale=4.0))
    soft = replace(GRAIN, shear_modulus=GRAIN.shear_modulus / 4.0)
    assert case.time_step == pytest.approx(0.2 * dem_warp.rayleigh_time(0.6e-3 * 0.8, soft), rel=1e-12)


def leaves(value, place=()):
    """Yield every plain value in nested frozen dataclasses, with the names that lead to it."""
    for field in fields(value):
        inner = getattr(value, field.name)
        if is_dataclass(inner) and not hasattr(inner, "to_dict"):
            yield from leaves(inner, (*place, field.name))
        else:
            yield (*place, field.name), inner


def changed(value, place, new):
    """Return the same nested dataclasses with another value at a place."""
    name, *rest = place
    inner = changed(getattr(value, name), rest, new) if rest else new
    return replace(value, **{name: inner})


OTHER = {
    "shape": BOOT,
    "grain_count": 40,
    "duration": 2.0,
    "skin": 1e-3,
    "precision": "double",
    "laws": RELATIVE,
    "plate_diameter": 0.1,
    "plate_friction": 0.5,
    "plate_friction_excess": 0.1,
    "tilt": 0.1,
    "vibration_amplitude": 1e-4,
    "air_drag": 1.0,
    "rain_rate": 3e3,
    "lip": 1e-3,
    "seed": 2,
    "modulus_scale": 200.0,
    "classes": SizeClasses((0.95, 1.05), (0.5, 0.5)),
    "wall_parts": (WallPart("tube", STEEL, Interaction(0.5, 0.1, 0.0)),),
    "mechanisms": (LinearCohesion(cohesion_energy_density=1e4),),
}
"""Another valid value, where it is not 0.9 of the present one."""


def test_every_parameter_but_the_skin_is_part_of_a_case_s_identity():
    scene = LiftedCylinder(0.016, 0.016, STEEL, plate_diameter=0.05)
    case = small_case(scene=scene)
    known = json.dumps(case.to_dict(), sort_keys=True)
    assert json.dumps(small_case(scene=scene).to_dict(), sort_keys=True) == known
    places = dict(leaves(case))
    assert len(places) > 25
    for place, value in places.items():
        new = OTHER[place[-1]] if place[-1] in OTHER else 0.9 * value
        other = json.dumps(changed(case, place, new).to_dict(), sort_keys=True)
        assert (other == known) == (place == ("numerics", "skin")), place


def test_cases_of_different_mixtures_have_different_identities():
    mixtures = [
        ShapeMixture(shapes, fractions)
        for shapes in ((PYRAMID, BOOT), (BOOT, PYRAMID), (PYRAMID, BALL))
        for fractions in ((0.5, 0.5), (0.4, 0.6))
    ]
    cases = [replace(small_case(), grains=GrainPopulation(mixture, GRAIN)) for mixture in mixtures]
    assert len({json.dumps(case.to_dict(), sort_keys=True) for case in cases}) == len(cases)
