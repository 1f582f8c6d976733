"""Conformance tests of the plugin's law and scene, for an environment in which it is installed."""

import pytest
from grain_magnets.jar import Jar
from grain_magnets.magnetism import Magnetism
from grain_magnets.table import Table

from dem_warp import Case, ClumpShape, GrainPopulation, Interaction, Material, Numerics
from dem_warp.testing import LAW_CHECKS, SCENE_CHECKS

GRAIN, SURFACE = Material(1000.0, 10e6, 0.25), Interaction(0.5, 0.4, 0.05)
STEEL = Material(7800.0, 70e9, 0.3)
SCENES = (Jar(diameter=0.012, height=0.02, wall_material=STEEL, grain_count=8), Table(STEEL, grain_count=5))
BALLS = GrainPopulation(ClumpShape.sphere(2e-3), GRAIN)


@pytest.mark.parametrize("check", LAW_CHECKS, ids=lambda check: check.__name__)
def test_law(check):
    check(Magnetism(magnetic_force=1e-3))


@pytest.mark.parametrize("check", SCENE_CHECKS, ids=lambda check: check.__name__)
@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: scene.name)
def test_scene(scene, check):
    check(Case(scene, BALLS, SURFACE, SURFACE, numerics=Numerics(modulus_scale=100.0)))
