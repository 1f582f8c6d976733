"""Heaps as people make them: pedestal and lip, funnel, ledge, tilting box, and the rate of filling."""

import math
from dataclasses import replace

import numpy as np
import pytest
from worlds import (
    GRAIN,
    GRAVITY,
    STEEL,
    assert_measured_as_declared,
    assert_same_result,
    ball_case,
    run_batch,
)

from dem_warp import Case, CaseResult, Hopper, Ledge, LiftedCylinder, PouredHeap, TiltingBox
from dem_warp.scenes.ledge import front
from dem_warp.scenes.plates import glued
from dem_warp.scenes.tilting_box import in_box

BALL_DIAMETER = 4e-3
PEDESTAL = LiftedCylinder(0.02, 0.024, STEEL, lift_speed=0.1, plate_diameter=0.02)
LIPPED = replace(PEDESTAL, plate_diameter=0.05, lip=4e-3)
FUNNEL = PouredHeap(
    diameter=0.04,
    fill_depth=0.035,
    outlet=0.026,
    wall_material=STEEL,
    drop=0.04,
    plate_diameter=0.06,
    lip=4e-3,
    plate="grains",
)
FED = replace(FUNNEL, mass=0.004, mass_rate=0.02, drop=0.03)
LEDGE = Ledge(width=0.03, depth=0.012, fill_depth=0.03, wall_material=STEEL, rest_speed=3e-3)
TILT = TiltingBox(
    width=0.05, depth=0.02, fill_depth=0.016, wall_material=STEEL, rotation_rate=10 / 360, rest_speed=3e-3
)
SLAB_FRICTION = 0.3


def cases() -> dict[str, Case]:
    return {
        "pedestal": ball_case(PEDESTAL, friction=0.5, rolling=0.2),
        "lip": ball_case(LIPPED, friction=0.5, rolling=0.2),
        "funnel": ball_case(FUNNEL, friction=0.4, rolling=0.2),
        "fed": ball_case(FED, friction=0.4, rolling=0.2),
        "jam": ball_case(replace(FUNNEL, outlet=0.006), friction=0.4, rolling=0.2),
        "ledge": ball_case(LEDGE, friction=0.4, rolling=0.1),
        "high": ball_case(replace(LEDGE, pour_height=0.1), friction=0.4, rolling=0.1),
        "hinge": ball_case(replace(LEDGE, apron=0.0, door="hinge"), friction=0.4, rolling=0.1),
        "tilt": ball_case(replace(TILT, rotation_rate=20 / 360), friction=0.2),
        "slab": ball_case(replace(TILT, grain_count=1), friction=SLAB_FRICTION, rolling=1.0),
    }


@pytest.fixture(scope="module")
def runs() -> dict[str, CaseResult]:
    return {name: run_batch([case])[0] for name, case in cases().items()}


@pytest.mark.parametrize("name", [name for name in cases() if name != "jam"])
def test_a_test_ends_with_what_its_scene_declares(runs, name):
    free = {"discharge_time", "flow_rate", "flow_rate_se", "clogged"}
    absent = {
        "fed": free | {"fill_height", "solid_fraction"},
        "slab": {"stop_angle"},
    }
    run = runs[name]
    assert (run.status, run.reason) == ("finished", "")
    assert_measured_as_declared(cases()[name], run, frozenset(absent.get(name, ())))


def test_a_pedestal_as_wide_as_its_tube_keeps_a_cone_and_loses_the_rest(runs):
    run = runs["pedestal"]
    from_axis = np.hypot(*run.positions.T[:2])
    # A ball that others hold leans out over the rim by little.
    assert 10 < len(run.positions) == run.observables["grain_count"] - run.observables["grains_lost"]
    assert run.observables["grains_lost"] > 0
    assert from_axis.max() < PEDESTAL.diameter / 2 + BALL_DIAMETER / 8


def test_a_lip_keeps_a_layer_below_the_heap(runs):
    # Between glued balls of their size others lie lower, by less than a radius.
    for name, scene, deeper in (("lip", LIPPED, 0.0), ("funnel", FUNNEL, BALL_DIAMETER / 2)):
        run = runs[name]
        low = run.positions[:, 2] < 0.0
        assert np.count_nonzero(low) > 20
        # The layer lies on the plate, inside the lip; a ball sinks in by less than a tenth of its radius.
        size = 0.9 * run.sphere_radii
        assert (run.positions[:, 2] - size > -scene.lip - deeper).all()
        assert (np.hypot(*run.positions[low].T[:2]) + size[low] < scene.plate_diameter / 2).all()
        masses = run.sizes**3 / (run.sizes**3).sum()
        center = masses @ run.positions[:, 2] + scene.lip
        assert run.observables["centre_height"] == pytest.approx(center, rel=1e-6)


def test_a_wide_lip_is_refused_without_a_plate():
    with pytest.raises(ValueError, match=r"LiftedCylinder.lip: needs a plate_diameter above"):
        replace(PEDESTAL, lip=1e-3)
    with pytest.raises(ValueError, match=r"plate_diameter: must be at least the tube's"):
        replace(PEDESTAL, plate_diameter=0.015)
    with pytest.raises(ValueError, match=r"PouredHeap.lip: must be below"):
        replace(FUNNEL, lip=0.04)


def test_a_funnel_keeps_its_mass_and_leaves_none_of_it_in_the_heap(runs):
    seen, run = runs["funnel"].observables, runs["funnel"]
    # Masses are kept in single precision: 6e-8 of each, and of the sum of some hundred.
    assert seen["fallen_mass"] + seen["mass_left"] == pytest.approx(seen["filled_mass"], rel=1e-6)
    balls = GRAIN.density * np.pi / 6.0 * (BALL_DIAMETER * run.sizes) ** 3
    assert seen["mass_on_plate"] == pytest.approx(balls.sum(), rel=1e-6)
    assert len(balls) + seen["grains_lost"] <= seen["grain_count"]
    assert run.positions[:, 2].max() < FUNNEL.floor


def test_a_funnel_with_a_narrow_outlet_jams_and_leaves_no_heap(runs):
    run = runs["jam"]
    assert run.status == "failed"
    assert run.reason.startswith("the outlet is clogged: 0.0")
    assert run.observables["clogged"] == 1.0
    assert (run.positions[:, 2] < FUNNEL.floor).all()


def test_a_small_heap_has_the_same_numbers_in_a_batch_with_a_large_one(runs):
    small = run_batch([cases()["fed"], cases()["jam"]])[0]
    assert_same_result(small, runs["fed"])


def test_glued_grains_have_no_material_of_a_wall():
    with pytest.raises(ValueError, match=r"PouredHeap.plate: must be smooth if the plate has its own"):
        FUNNEL.check_parts(["plate"])
    FUNNEL.check_parts(["funnel"])


def test_a_funnel_has_the_volume_of_its_cone_and_its_tube():
    # A cone of half angle 45 degrees from 20 to 40 mm: 10 mm high, frustum pi/12 h (d^2 + d D + D^2).
    bin_ = Hopper(0.04, 0.03, 0.02, STEEL, half_angle=math.pi / 4)
    assert bin_.cone_height == pytest.approx(0.01, rel=1e-12)
    frustum = math.pi / 12 * 0.01 * (0.02**2 + 0.02 * 0.04 + 0.04**2)
    assert bin_.volume == pytest.approx(frustum + math.pi / 4 * 0.04**2 * 0.02, rel=1e-12)
    assert replace(bin_, half_angle=math.pi / 2).volume == math.pi / 4 * 0.04**2 * 0.03
    with pytest.raises(ValueError, match=r"Hopper.fill_depth: must be above the cone's height 0.01"):
        replace(bin_, fill_depth=0.01)


def test_grains_are_fed_at_the_rate_of_mass(runs):
    seen, case = runs["fed"].observables, cases()["fed"]
    fed = FED.mass / FED.mass_rate
    filling = runs["fed"].phases[0]["time"]
    # The last ball also falls, and the heap rests for 0.05 s, looked at every few milliseconds.
    assert fed * 0.95 < filling < fed + 0.6
    assert seen["filled_mass"] == pytest.approx(FED.mass, rel=0.02)
    assert case.scene.grains_per_second(case) * FED.mass / FED.mass_rate == pytest.approx(118, abs=1)


def test_glued_grains_are_a_layer_without_gaps_that_holds_grains():
    layer = glued(0.05, -1e-3, 2e-3)
    assert layer.vertices[:, 2].max() == pytest.approx(-1e-3, abs=1e-12)
    assert np.ptp(layer.vertices[:, 2]) == pytest.approx(2e-3, abs=1e-12)
    sides = np.sort(layer.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    _, shared = np.unique(sides, axis=0, return_counts=True)
    assert set(shared) == {1, 2}
    # Only sides of the rim belong to one triangle: some six diameters over the side of a bump.
    assert np.count_nonzero(shared == 1) < 12 * 0.05 / 2e-3
    area = np.abs(np.linalg.det(np.diff(layer.vertices[layer.faces][..., :2], axis=1))).sum() / 2
    assert area == pytest.approx(math.pi * 0.025**2, rel=0.1)


def test_a_quick_ledge_runs_out_by_its_height_and_keeps_less_without_an_apron(runs):
    seen, edge = runs["ledge"].observables, runs["hinge"].observables
    # Lube, Huppert, Sparks and Freundt, Physical Review E 72 (2005) 041301: 1.2 times the height of columns
    # as high as wide; of two hundred balls the front is known to about two.
    assert seen["run_out"] == pytest.approx(1.2 * seen["fill_height"], abs=2.5 * BALL_DIAMETER)
    assert (seen["stands"], edge["stands"], seen["grains_lost"]) == (0.0, 0.0, 0.0)
    assert edge["share_left"] < seen["share_left"] < 0.95
    assert edge["grains_lost"] == edge["grain_count"] - len(runs["hinge"].positions) > 0
    assert edge["run_out"] < 2 * BALL_DIAMETER
    for angle in (seen["ledge_angle"], edge["ledge_angle"]):
        assert 10.0 < angle < 50.0
    inside = runs["ledge"].positions[:, 0] < LEDGE.width / 2
    masses = runs["ledge"].sizes ** 3
    assert seen["share_left"] == pytest.approx(masses[inside].sum() / masses.sum(), rel=1e-6)


def test_grains_that_fall_farther_pack_denser(runs):
    high, case = runs["high"], cases()["high"]
    assert high.observables["solid_fraction"] > runs["ledge"].observables["solid_fraction"]
    # Some reach the floor at the speed of their fall, which the time of the first look allows for.
    assert case.scene.release(2e-3) == pytest.approx(0.102)
    assert case.scene.top_speed > math.sqrt(2 * GRAVITY * 0.1)


def test_the_front_is_where_grains_cover_half_of_the_depth():
    # Two rows of columns of 1 mm: three are full, one is half full, a ball lies apart.
    places = [[0.5, 0.5], [0.5, -0.5], [1.5, 0.5], [1.5, -0.5], [2.5, 0.5], [8.5, 0.5], [-3.5, 0.5]]
    positions = 1e-3 * np.insert(np.array(places), 2, 0.5, axis=1)
    assert front(positions, 0.0, 2e-3, 0.5e-3) == pytest.approx(3e-3)
    assert front(positions[-1:], 0.0, 2e-3, 0.5e-3) == 0.0


def test_a_slab_slides_at_its_friction_angle_and_a_bed_starts_above_where_it_stops(runs):
    # A ball that hardly rolls. It gains v = g w t^2 / 2 (1 + f^2)^(1/2), and is seen at 0.03 sqrt(g d).
    grain, climb = BALL_DIAMETER, GRAVITY * TILT.spin * math.hypot(1.0, SLAB_FRICTION)
    late = TILT.spin * math.sqrt(2 * 0.03 * math.sqrt(GRAVITY * grain) / climb)
    slid = math.radians(runs["slab"].observables["start_angle"]) - math.atan(SLAB_FRICTION)
    # A look is every 256 steps; a hundredth of a degree for the rest.
    assert -2e-4 < slid - late < TILT.spin * 256 * cases()["slab"].time_step + 2e-4
    seen = runs["tilt"].observables
    assert 15.0 < seen["stop_angle"] < seen["start_angle"] < 50.0


def test_places_in_a_tilted_box_are_turned_back():
    tilted = np.array([[math.cos(0.3), 1.0, -math.sin(0.3)], [math.sin(0.3), 0.0, math.cos(0.3)]])
    assert in_box(tilted, 0.3) == pytest.approx(np.array([[1.0, 1.0, 0.0], [0.0, 0.0, 1.0]]), abs=1e-15)


def test_a_rain_that_finds_its_rate_fills_a_tenth_of_its_volume():
    case = ball_case(replace(PEDESTAL, diameter=0.04, plate_diameter=0.04), friction=0.5)
    volume = math.pi / 6 * BALL_DIAMETER**3
    open_area = math.pi * (0.02 - BALL_DIAMETER / 2) ** 2
    rate = case.scene.grains_per_second(case)
    assert rate * volume / (open_area * case.scene.rain_speed) == pytest.approx(0.1, rel=1e-12)
    assert replace(case.scene, rain_rate=100.0).grains_per_second(case) == 100.0
