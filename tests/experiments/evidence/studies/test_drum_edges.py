"""The upper edge of a bed in a drum: drawn truth first, then a drum that turns."""

import pickle

import numpy as np
import pytest

from dem_warp import Case, ClumpShape, Drum, GrainPopulation, Interaction, Material, simulate
from dem_warp.checkpoint import case_name
from experiments.evidence.studies.cellulose import drum_edges

RADIUS = 0.025
PLACES = np.linspace(-0.024, 0.024, 97)


def test_the_edge_of_a_sphere_is_its_outline():
    center, r = np.array([[0.003, 0.0, -0.004]]), np.array([0.005])
    edge = drum_edges.upper_edge(center, r, PLACES, RADIUS)
    over = np.abs(PLACES - 0.003) < 0.005
    outline = -0.004 + np.sqrt(np.maximum(0.005**2 - (PLACES - 0.003) ** 2, 0.0))
    assert edge[over] == pytest.approx(outline[over], abs=1e-12)
    assert edge[~over] == pytest.approx(-np.sqrt(RADIUS**2 - PLACES[~over] ** 2), abs=1e-12)


@pytest.mark.parametrize("tilt", [0.0, 0.6])
def test_the_edge_of_a_plane_bed_lies_on_its_plane(tilt):
    rng, r = np.random.default_rng(1), 3e-4
    x, y = rng.uniform(-0.02, 0.02, (2, 200_000))
    depth = rng.uniform(0.0, 0.002, 200_000)
    centers = np.column_stack([x, y, -tilt * x - depth])
    inside = np.abs(PLACES) < 0.015
    edge = drum_edges.upper_edge(centers, np.full(len(x), r), PLACES, RADIUS)
    # tops of a dense bed lie a radius above the plane of the highest centres, along its normal
    plane = -tilt * PLACES + r * np.hypot(1.0, tilt)
    assert edge[inside] == pytest.approx(plane[inside], abs=0.1 * r)


def test_half_dark_is_the_middle_of_the_looks():
    heights = np.array([[1.0], [2.0], [3.0], [4.0], [5.0]])
    edges = drum_edges.Edges(np.zeros(1), heights)
    assert edges.level(0.5) == 3.0
    # the picture is darker below
    assert edges.level(0.2) > edges.level(0.5) > edges.level(0.8)


def test_areas_count_inside_the_middle_of_the_drum():
    flat = np.zeros_like(PLACES)
    assert drum_edges.area_of_disagreement(PLACES, flat, flat, RADIUS) == 0.0
    strip = drum_edges.area_of_disagreement(PLACES, flat, flat + 1e-3, RADIUS)
    assert strip == pytest.approx(2 * np.sqrt(0.6) * RADIUS * 1e-3, rel=0.01)
    # the whole half of the disc, however far apart the edges are
    half = drum_edges.area_of_disagreement(PLACES, flat, flat + 1.0, RADIUS)
    assert half == pytest.approx(0.5 * np.pi * 0.6 * RADIUS**2, rel=0.01)


def test_a_turning_drum_is_watched(tmp_path):
    steel = Material(7800.0, 7e10, 0.3)
    scene = Drum(
        diameter=2 * RADIUS, length=0.012, wall_material=steel, rotation_rate=1.0, grain_count=60,
        start_up=0.05, revolutions=0.2, rest_speed=0.05,
    )  # fmt: skip
    grains = GrainPopulation(ClumpShape.sphere(2e-3), Material(1500.0, 1e6, 0.3))
    case = Case(scene, grains, Interaction(0.3, 0.5, 0.05), Interaction(0.3, 0.5, 0.05), seed=1)
    watch = drum_edges.EdgeWatch(tmp_path, PLACES)
    result = simulate([case], "cpu", on_advance=pickle.loads(pickle.dumps(watch)))[0]
    assert result.status == "finished", result.reason
    edges = drum_edges.read_edges(tmp_path, case_name(case))
    # the looks of the controller come in steps of a power of two: half as often, or half as often again
    assert 0.2 / (1.5 * drum_edges.EVERY) <= len(edges.heights) <= 1.5 * 0.2 / drum_edges.EVERY + 1
    # the surface is high at the left, as a drum that turns clockwise has it
    middle = edges.level(0.5)
    assert middle[PLACES < -0.005].mean() > middle[PLACES > 0.005].mean()
    with pytest.raises(FileNotFoundError):
        drum_edges.read_edges(tmp_path, "another")
