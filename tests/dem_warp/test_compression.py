"""Compression: one ball and a row of balls by Hertz, walls, taps, loads and refusals."""

import math
from dataclasses import replace

import numpy as np
import pytest
import worlds
from worlds import GRAIN, GRAVITY, STEEL, assert_measured_as_declared, ball_case, run_batch

from dem_warp import Case, CaseResult, Compression, Interaction, effective_moduli, simulate
from dem_warp.scenes.press_curve import LOADED, UNLOADED, crossing, strains_of
from dem_warp.walls import Motion, Plane

RADIUS = 2e-3
DIE = Compression(0.03, 0.02, STEEL, 2e3)
LONELY = replace(DIE, diameter=0.016, stress=50.0, speed=2e-4, grain_count=1)
SMOOTH = Interaction(0.5, 0.4, 0.1), Interaction(0.5, 0.0, 0.0)
PARTS = (*LOADED, *UNLOADED)


def cases() -> dict[str, Case]:
    bed = ball_case(DIE, friction=0.4, rolling=0.1)
    smooth = replace(bed, grain_grain=SMOOTH[0], grain_wall=SMOOTH[1])
    return {
        "ball": ball_case(LONELY, friction=0.0),
        "bed": bed,
        "slow": replace(bed, scene=replace(DIE, speed=DIE.speed / 2)),
        "smooth": smooth,
        "taps": replace(bed, scene=replace(DIE, taps=4)),
        "loads": replace(bed, scene=replace(DIE, loads=2)),
        "high": replace(bed, scene=replace(DIE, pour_height=0.1)),
        "soft": ball_case(replace(LONELY, stress=1e4, speed=5e-3), friction=0.0),
    }


@pytest.fixture(scope="module")
def runs() -> dict[str, CaseResult]:
    return dict(zip(cases(), simulate(list(cases().values()), device="cpu", workers=1), strict=True))


@pytest.mark.parametrize("name", [name for name in cases() if name != "soft"])
def test_a_compression_ends_with_what_its_scene_declares(runs, name):
    run = runs[name]
    absent = frozenset() if name == "taps" else frozenset({"tapped_density", "hausner_ratio"})
    assert (run.status, run.reason) == ("finished", "")
    assert_measured_as_declared(cases()[name], run, absent)
    assert len(run.positions) == run.observables["grain_count"]


def test_a_ball_between_base_and_piston_yields_by_hertz_at_both(runs):
    # F = 4/3 E* sqrt(R) d^1.5 on each side; the base carries the ball, too.
    case, seen = cases()["ball"], runs["ball"].observables
    modulus, _ = effective_moduli(case.grain_material, STEEL)
    radius = float(RADIUS * runs["ball"].sizes[0])
    weight = 4 / 3 * math.pi * radius**3 * GRAIN.density * GRAVITY

    def height(stress: float) -> float:
        loads = stress * LONELY.area + np.array([0.0, weight])
        return 2 * radius - float(((loads / (4 / 3 * modulus * math.sqrt(radius))) ** (2 / 3)).sum())

    strains = [1 - height(part * LONELY.stress) / height(0.01 * LONELY.stress) for part in PARTS]
    got = [seen[f"strain_{number + 1}"] for number in range(len(PARTS))]
    # Damping, and straight lines between the looks.
    assert got == pytest.approx(strains, abs=0.01 * strains[4])
    # Nothing is lost, and all that the piston carries reaches the base.
    assert seen["rebound"] == pytest.approx(1.0, abs=0.01)
    assert seen["base_share"] == pytest.approx(1.0, abs=1e-3)


def test_a_row_of_balls_has_the_stiffness_of_a_cubic_array():
    # A column of a simple cubic array has the load (2 R)^2 2/3 E* e^1.5, with the effective E* of two balls;
    # at a wall of this modulus, a ball's overlap is less deep by 2^(1/3) than between two.
    count, law = 6, worlds.pair(restitution=0.1)
    places = [[0.0, 0.0, worlds.RADIUS * (2 * number + 1)] for number in range(count)]
    walls = Plane(), Plane((0.0, 0.0, 2 * worlds.RADIUS * count), (0.0, 0.0, -1.0))
    row = worlds.world(worlds.grains(places), law, worlds.TIME_STEP, walls=walls)
    solver = worlds.solve(replace(row, weighed=(0, 1)), precision="double")
    strain, time = 0.01, 0.4
    gap = 2 * worlds.RADIUS * count
    lengths = (count - 1 + 2 * 0.5 ** (1 / 3)) / count
    solver.move_wall(0, 1, Motion(velocity=(0.0, 0.0, -strain * gap * lengths / time), duration=time))
    worlds.run_for(solver, time + 0.1)
    [before] = solver.view([0])
    worlds.run_for(solver, 0.05)
    [after] = solver.view([0])
    base, piston = ((after.impulses - before.impulses) / (after.time - before.time))[:, 2]
    wanted = (2 * worlds.RADIUS) ** 2 * 2 / 3 * law.modulus * strain**1.5
    # At rest, in double precision, but for oscillations that damping has left.
    assert piston == pytest.approx(wanted, rel=1e-3)
    assert base == pytest.approx(-piston, rel=1e-3)


def test_half_the_speed_gives_the_same_curve(runs):
    # Below an inertial number of 1e-2 the rate does not matter; a look is some 1 % of the strain.
    bed, slow = (runs[name].observables for name in ("bed", "slow"))
    assert slow["modulus"] == pytest.approx(bed["modulus"], rel=0.05)
    assert slow["strain_5"] == pytest.approx(bed["strain_5"], rel=0.03)


def test_a_wall_without_friction_passes_all_of_the_load_and_a_rough_one_less(runs):
    assert runs["smooth"].observables["base_share"] == pytest.approx(1.0, abs=0.01)
    # Janssen turned over: exp(-4 K mu H / D) of it, with K between 0.2 and 1.
    seen = runs["bed"].observables
    slenderness = 4 * 0.4 * seen["fill_height"] / DIE.diameter
    assert math.exp(-slenderness) < seen["base_share"] < math.exp(-0.2 * slenderness)


def test_grains_stay_compressed_where_they_slide(runs):
    seen = runs["bed"].observables
    down, up = [seen[f"strain_{n}"] for n in (1, 2, 3, 4, 5)], [seen[f"strain_{n}"] for n in (6, 7, 8, 9)]
    assert sorted(down) == down
    assert sorted(up, reverse=True) == up
    assert all(back > forth for back, forth in zip(up, down[-2::-1], strict=True))
    assert 0.2 < seen["rebound"] < 0.95
    assert seen["unloading_modulus"] > seen["modulus"]


def test_taps_and_a_high_fall_make_a_bed_denser(runs):
    seen = runs["taps"].observables
    poured = seen["solid_fraction"] * GRAIN.density
    # Masses are kept in single precision.
    assert seen["hausner_ratio"] == pytest.approx(seen["tapped_density"] / poured, rel=1e-6)
    assert 1.0 < seen["hausner_ratio"] < 1.3
    assert seen["rebound"] > runs["bed"].observables["rebound"]
    assert runs["high"].observables["solid_fraction"] > runs["bed"].observables["solid_fraction"]


def test_a_tap_drops_grains_by_its_height_and_ends_where_it_began(runs):
    # The base is back at 0: the lowest balls touch it, and sink in by less than a fifth of their radius.
    run = runs["taps"]
    depth = run.positions[:, 2] / (RADIUS * run.sizes)
    assert 0.8 < depth.min() < 1.0
    taps = next(phase["time"] for phase in run.phases if phase["name"] == "tap")
    fall = math.sqrt(2 * DIE.tap_height / GRAVITY)
    assert taps > 4 * (DIE.tap_height / 0.05 + fall + DIE.rest_time)


def test_each_load_has_twice_the_stress_of_the_one_before(runs):
    names = [phase["name"] for phase in runs["loads"].phases]
    assert [name for name in names if name == "release"] == ["release"] * 2
    # The second load begins on a bed that the first has left compressed, and ends where one load ends.
    once, twice = (runs[name].observables for name in ("bed", "loads"))
    assert twice["strain_2"] > once["strain_2"]
    assert twice["strain_5"] == pytest.approx(once["strain_5"], rel=0.1)


def test_a_piston_that_meets_no_stress_fails_with_its_reason(runs):
    run = runs["soft"]
    assert run.status == "failed"
    assert run.reason.startswith("the piston went down by 50% of the bed, to a stress of ")


def test_a_compression_has_the_same_bits_in_a_batch(runs):
    both = run_batch([cases()["bed"], cases()["loads"]])
    worlds.assert_same_result(both[1], runs["loads"])


def test_unlikely_pistons_are_named_and_impossible_ones_refused():
    case = ball_case(replace(DIE, speed=1e-4, stress=200.0), 0.4)
    grains, stiff, soft = case.grains, GRAIN, case.grain_material
    assert case.scene.doubts(grains, stiff) == ()
    [scaled] = case.scene.doubts(grains, soft)
    assert "100 times softer" in scaled
    fast, squeezed, _ = DIE.doubts(grains, soft)
    # v / H d sqrt(rho / p) with the first stress that is read, a twentieth.
    inertia = DIE.speed / DIE.fill_depth * 2 * RADIUS * math.sqrt(GRAIN.density / 100.0)
    assert f"{inertia:.1e}" in fast
    modulus, _ = effective_moduli(soft, soft)
    assert f"by {(1.5 * DIE.stress / modulus) ** (2 / 3):.0%} of" in squeezed
    with pytest.raises(ValueError, match=r"Compression.speed: must be below 0.0158 m/s"):
        replace(DIE, speed=0.1).doubts(grains, soft)
    with pytest.raises(ValueError, match=r"Compression.stress: must be below 1.11e\+04 Pa"):
        replace(DIE, stress=1e6).doubts(grains, soft)


def test_a_curve_is_read_where_it_crosses_a_stress():
    heights = np.array([10.0, 9.9, 9.8, 9.6, 9.7, 9.75, 9.78])
    curve = np.column_stack([[0.0, 10.0, 50.0, 100.0, 50.0, 8.0, 0.0], heights]).tolist()
    assert crossing(30.0, curve, 1) == pytest.approx(9.85)
    assert crossing(75.0, curve[3:], -1) == pytest.approx(9.65)
    assert crossing(200.0, curve[:4], 1) == 9.6
    seat = 9.99
    wanted = (
        1 - np.array([9.95, 9.9, 9.875, 9.8, 9.6, 9.7, 9.7 + 0.05 * 30 / 42, 9.7 + 0.05 * 40 / 42]) / seat
    )
    assert strains_of(curve, 100.0)[:8] == pytest.approx(wanted, rel=1e-9)
