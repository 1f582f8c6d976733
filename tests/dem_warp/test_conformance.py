"""Conformance tests of dem_warp's own laws and scenes."""

from dataclasses import replace

import pytest
from worlds import SMALL_TUBE, STEEL, ball_case, small_case

from dem_warp import testing
from dem_warp.laws.library import MECHANISMS
from dem_warp.laws.linear_cohesion import LinearCohesion
from dem_warp.scenes.compression import Compression
from dem_warp.scenes.draw_down import DrawDown
from dem_warp.scenes.drop import Drop
from dem_warp.scenes.drum import Drum
from dem_warp.scenes.hopper import Hopper
from dem_warp.scenes.incline import Incline
from dem_warp.scenes.ledge import Ledge
from dem_warp.scenes.library import SCENES
from dem_warp.scenes.penetration import Penetration
from dem_warp.scenes.poured_heap import PouredHeap
from dem_warp.scenes.roll import Roll
from dem_warp.scenes.shear import Shear
from dem_warp.scenes.tilting_box import TiltingBox

PARAMETERS = {
    "linear_cohesion": {"cohesion_energy_density": 2e4},
    "wall_adhesion": {"wall_adhesion_energy_density": 2e4},
    "jkr": {"work_of_adhesion": 0.05},
    "capillary_bridge": {"surface_tension": 0.07, "bridge_volume": 2e-11, "contact_angle": 0.3},
    "elastic_plastic_rolling": {"rolling_stiffness": 2.25, "rolling_damping": 0.3},
    "twisting": {"twisting_radius": 0.5},
    "rate_weakening": {"weakening": 0.5, "weakening_speed": 0.05},
    "kinetic_friction": {"friction_drop": 0.3},
    "hysteretic_spring": {"plasticity": 0.3},
    "micro_slip": {"micro_slip": 1.0},
}
LAWS = [kind(**PARAMETERS[name]) for name, kind in MECHANISMS.items()]
CASES = {
    "lifted-cylinder": small_case(scene=replace(SMALL_TUBE, grain_count=20)),
    "hopper": ball_case(Hopper(0.025, 0.02, 0.016, STEEL, rain_rate=3000.0), 0.3),
    "drum": ball_case(Drum(0.06, 0.012, STEEL, 2.0, filling=0.3, start_up=0.2, revolutions=0.3), 0.4, 0.05),
    "poured-heap": ball_case(
        PouredHeap(0.02, 0.02, 0.016, STEEL, drop=0.02, plate_diameter=0.05, lip=2e-3, plate="grains"),
        0.3,
        0.1,
    ),
    "ledge": ball_case(Ledge(0.02, 0.012, 0.016, STEEL, door="fall", rest_speed=3e-3), 0.4, 0.1),
    "tilting-box": ball_case(TiltingBox(0.02, 0.012, 0.01, STEEL, 20 / 360, rest_speed=3e-3), 0.2),
    "compression": ball_case(Compression(0.025, 0.012, STEEL, 2e3, taps=1, rest_speed=3e-3), 0.3, 0.1),
    "shear": ball_case(Shear(0.024, 0.016, STEEL, 1e3, speed=0.1, rest_speed=5e-3), 0.4),
    "penetration": ball_case(Penetration(0.03, 0.02, STEEL, 0.01, 0.01, rest_speed=3e-3), 0.4, 0.1),
    "draw-down": ball_case(DrawDown(0.04, 0.009, 0.015, 0.016, 0.025, STEEL, rest_speed=3e-3), 0.3, 0.1),
    "drop": ball_case(Drop(0.02, STEEL, grain_count=6, plate_angle=0.5), 0.4, 0.05),
    "incline": ball_case(Incline(STEEL, grain_count=3, sledge=3, rotation_rate=60 / 360), 0.4, 0.05),
    "roll": ball_case(Roll(0.5, 0.02, STEEL, grain_count=4, run=0.2), 0.5, 0.1),
}
names = {"ids": lambda one: getattr(one, "name", None) or one.__name__}


@pytest.mark.parametrize("law", LAWS, **names)
@pytest.mark.parametrize("check", testing.LAW_CHECKS, **names)
def test_laws(law, check):
    check(law)


# The checks of a scene follow one another, and share its run.
@pytest.mark.parametrize("check", testing.SCENE_CHECKS, **names)
@pytest.mark.parametrize("scene", SCENES)
def test_scenes(scene, check):
    check(CASES[scene])


class Misdeclared(LinearCohesion):
    strength = "cohesion"


@pytest.mark.parametrize(
    ("check", "wrong", "problem"),
    [
        (testing.law_checks_its_parameters, Misdeclared(), "strength must be the name of a parameter"),
        (testing.law_acts_only_within_its_reach, LinearCohesion(), "changes no contact"),
        (testing.scene_ends, small_case(scene=None, skin=1000.0), "must"),
    ],
)
def test_a_wrong_law_or_scene_fails(check, wrong, problem):
    with pytest.raises((AssertionError, ValueError), match=problem):
        check(wrong)
