"""Mechanisms in study files."""

import math
from collections.abc import Callable
from pathlib import Path

from dem_warp.laws import capillary, elastic_plastic_rolling, jkr, rate_weakening, wall_adhesion
from experiments.studyfile import load_study

WriteStudy = Callable[..., Path]

SPRING = "[mechanism.elastic_plastic_rolling]\nrolling_stiffness = 2.25\n"


def test_mechanisms_are_those_of_the_library(write_study: WriteStudy) -> None:
    study = load_study(
        write_study(add=f'\n{SPRING}between = "grains"\n[mechanism.jkr]\nwork_of_adhesion = 0.1\n')
    )
    assert study.case({}, seed=1).mechanisms == (
        jkr.JKR(work_of_adhesion=0.1),
        elastic_plastic_rolling.ElasticPlasticRolling(rolling_stiffness=2.25, between="grains"),
    )
    assert load_study().case({}, seed=1).mechanisms == ()


def test_a_mechanism_can_be_a_factor(write_study: WriteStudy) -> None:
    varied = (
        'parameter = "contact.grain-grain.static_friction"',
        'parameter = "mechanism.elastic_plastic_rolling.rolling_stiffness"',
    )
    friction = ("restitution = 0.2", "restitution = 0.2\nstatic_friction = 0.3")
    study = load_study(write_study(varied, friction))
    assert study.case({"E": 0.5}, seed=1).mechanisms == (
        elastic_plastic_rolling.ElasticPlasticRolling(rolling_stiffness=0.5),
    )


def test_parameters_of_mechanisms_have_units_and_plain_numbers_are_si(write_study: WriteStudy) -> None:
    bridge = """
[mechanism.capillary_bridge]
surface_tension = "72 mN/m"
bridge_volume = "20 ul"
contact_angle = "30 deg"
[mechanism.rate_weakening]
weakening = 0.3
weakening_speed = "10 cm/s"
[mechanism.wall_adhesion]
wall_adhesion_energy_density = 50.0
"""
    wall, water, weakening = load_study(write_study(add=bridge)).case({}, seed=1).mechanisms
    assert wall == wall_adhesion.WallAdhesion(wall_adhesion_energy_density=50.0)
    assert water == capillary.CapillaryBridge(
        surface_tension=0.072, bridge_volume=2e-8, contact_angle=math.radians(30.0)
    )
    assert weakening == rate_weakening.RateWeakening(weakening=0.3, weakening_speed=0.1)


def test_mechanisms_that_exclude_each_other_may_act_in_different_contacts(write_study: WriteStudy) -> None:
    apart = '[mechanism.jkr]\nwork_of_adhesion = 0.1\nbetween = "grains"\n[mechanism.hysteretic_spring]\n'
    study = load_study(write_study(add=f'\n{apart}plasticity = 0.3\nbetween = "walls"\n'))
    case = study.case({}, seed=1)
    grains, walls = case.contacts(case.scene.wall_material)
    assert [one.name for one in grains.mechanisms] == ["jkr"]
    assert [one.name for one in walls.mechanisms] == ["hysteretic_spring"]
