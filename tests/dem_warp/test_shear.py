"""Shear: a free wall and periodic sides in the engine, Mohr's circles, and the test with its lid."""

import math
from dataclasses import replace

import numpy as np
import pytest
import worlds
from worlds import GRAIN, GRAVITY, STEEL, assert_measured_as_declared, ball_case

from dem_warp import Case, CaseResult, Interaction, Shear, WallPart
from dem_warp.batch import Batch
from dem_warp.device import resolve_device
from dem_warp.model import ContactCoefficients, WorldSetup
from dem_warp.scenes.shear import GRIP
from dem_warp.scenes.shear_points import (
    LOADS,
    consolidation_stress,
    strengths,
    unconfined_strength,
    wall_friction,
    yield_locus,
)
from dem_warp.walls import Disc, Mesh, Motion, Plane

SIDE, WIDE, UP = 0.05, 0.2, (0.0, 0.0, 1.0)
COLUMN = Shear(0.028, 0.018, STEEL, 1e3, speed=0.04, rest_speed=3e-3)
OF_A_LOCUS = {
    "friction_angle", "cohesion", "steady_angle", "consolidation_stress", "unconfined_strength", "flow_ratio",
}  # fmt: skip


def cases() -> dict[str, Case]:
    bed = ball_case(COLUMN, friction=0.5)
    smooth = replace(COLUMN, base="smooth", stress=2e3)
    return {
        "bed": bed,
        "frictionless": replace(bed, grain_grain=Interaction(0.5, 0.0, 0.0)),
        # Grains that do not roll slide on the base.
        "smooth": replace(ball_case(smooth, friction=0.5), grain_wall=Interaction(0.5, 0.2, 1.0)),
    }


@pytest.fixture(scope="module")
def batch() -> Batch:
    return Batch(list(cases().values()), resolve_device("cpu"))


@pytest.fixture(scope="module")
def runs(batch: Batch) -> dict[str, CaseResult]:
    found = worlds.finish(batch)
    return {name: found[number] for number, name in enumerate(cases())}


@pytest.mark.parametrize("name", cases())
def test_a_shear_test_ends_with_what_its_scene_declares(runs, name):
    run = runs[name]
    absent = OF_A_LOCUS if name == "smooth" else {"wall_friction_angle"}
    assert (run.status, run.reason) == ("finished", "")
    absent |= {"flow_ratio"} - run.observables.keys()
    assert_measured_as_declared(cases()[name], run, frozenset(absent))


def test_balls_have_the_friction_of_the_literature(runs):
    # Quasi-static flow: .36 to .40 with a friction of .5 and without rolling friction, .10 without friction
    # (Peyneau and Roux, Physical Review E 78, 2008, 011307). Some 240 balls scatter by .02.
    steady = {
        name: math.tan(math.radians(runs[name].observables["steady_angle"]))
        for name in cases()
        if name != "smooth"
    }
    assert 0.3 < steady["bed"] < 0.45
    assert 0.05 < steady["frictionless"] < 0.16
    # They do not stick: a tenth of the stress at most, by chance.
    assert abs(runs["bed"].observables["cohesion"]) < 0.1 * COLUMN.stress


def test_a_smooth_base_measures_its_friction(runs):
    # Grains that do not roll slide, up to the few that do not move at an instant.
    seen = runs["smooth"].observables
    assert math.tan(math.radians(seen["wall_friction_angle"])) == pytest.approx(0.2, rel=0.03)
    stresses = [seen[f"shear_stress_{number}"] for number in range(1, 6)]
    assert stresses == pytest.approx([0.2 * part * 2e3 for part in (*LOADS, 1.0)], rel=0.05)


def test_each_load_is_on_the_plane_of_shear(runs, batch):
    # The lid carries it to 1 %, and the grains above have their part of it.
    assert runs["bed"].status == "finished"
    state = batch.controllers[0].state
    assert [point[0] for point in state.points] == pytest.approx([part * 1e3 for part in LOADS], rel=0.01)
    assert np.array(state.steady)[:, 1].mean() == pytest.approx(1e3, rel=0.01)
    assert [phase["name"] for phase in state.phases].count("shear") == len(LOADS)


# ---- the free wall -----------------------------------------------------------------------------------------


def lidded(count: int = 9) -> WorldSetup:
    """Return balls on a plane, and a wide lid above them that is free."""
    places = np.array([[0.02 * (i % 3 - 1), 0.02 * (i // 3 - 1), worlds.RADIUS] for i in range(count)])
    walls = Plane(), Disc((0.0, 0.0, 2.02 * worlds.RADIUS), UP, 0.1)
    law = worlds.pair(restitution=0.3, friction=0.5)
    world = worlds.world(worlds.grains(places), law, worlds.TIME_STEP, walls=walls, gravity=(0, 0, -GRAVITY))
    return replace(world, weighed=(0, 1), free_wall=1, period=WIDE)


def test_a_free_wall_without_contact_falls_by_its_force():
    solver = worlds.solve(lidded(1))
    solver.move_wall(0, 1, Motion((0.3, 0.0, 0.0), mass=2.0, force=8.0))
    solver.advance(1)
    steps, step = 256, worlds.TIME_STEP
    place, _ = solver.wall_pose(0, 1)
    rise = 4.0 * step**2 * steps * (steps + 1) / 2  # as of a grain: the speed first, then the place
    # In a period it stays in the middle, as it looks the same anywhere.
    assert place == pytest.approx([0.0, 0.0, 2.02 * worlds.RADIUS + rise], rel=1e-12)
    assert solver.view([0])[0].rise == pytest.approx(rise, rel=1e-12)


@pytest.mark.parametrize("precision", ["double", "mixed"])
def test_balls_carry_the_load_of_a_free_wall(precision):
    solver = worlds.solve(lidded(), precision=precision)
    solver.move_wall(0, 1, Motion(mass=5e-3, force=-1.0))
    worlds.run_for(solver, 0.3)
    [before] = solver.view([0])
    worlds.run_for(solver, 0.05)
    [after] = solver.view([0])
    base, lid = (after.impulses - before.impulses)[:, 2] / (after.time - before.time)
    # At rest, but for what single precision leaves.
    assert lid == pytest.approx(1.0, rel=1e-6)
    assert base == pytest.approx(-1.0 - 9 * worlds.ball_mass() * GRAVITY, rel=1e-6)
    # A new load acts from where the wall is.
    solver.move_wall(0, 1, Motion(mass=5e-3, force=-0.5))
    assert solver.view([0])[0].rise == 0.0


def test_a_free_wall_has_the_same_bits_alone_and_with_others():
    light, heavy = Motion(mass=5e-3, force=-1.0), Motion(mass=5e-2, force=-20.0)
    alone, both = (
        worlds.solve(lidded(), precision="mixed"),
        worlds.solve(lidded(4), lidded(), precision="mixed"),
    )
    alone.move_wall(0, 1, light)
    both.move_walls([(0, 1, heavy), (1, 1, light)])
    for _ in range(6):
        alone.advance(2)
        both.advance(1)
        both.advance(1)
    worlds.assert_same_bits(worlds.state(alone), worlds.state(both, 1))
    assert alone.wall_pose(0, 1)[0].tolist() == both.wall_pose(1, 1)[0].tolist()


def test_a_rigid_slab_slides_at_the_friction_of_its_base():
    # Balls that do not roll between a smooth base and a rough lid: their shear stress is mu times the normal
    # one.
    mu = 0.3
    law, grip = worlds.pair(0.3, mu, 1.0), worlds.pair(0.3, *GRIP)
    base, lid = ((wall, number) for number, (wall, _) in enumerate(lidded().walls, 1))
    solver = worlds.solve(
        replace(lidded(), contacts=(law, law, grip), walls=(base, lid), gravity=(0.0, 0.0, 0.0))
    )
    for load in (2.0, 1.0):
        solver.move_wall(0, 1, Motion((0.01, 0.0, 0.0), mass=5e-3, force=-load))
        worlds.run_for(solver, 0.2)
        [before] = solver.view([0])
        worlds.run_for(solver, 0.1)
        [after] = solver.view([0])
        base, lid = (after.impulses - before.impulses) / (after.time - before.time)
        assert [-base[2], lid[2]] == pytest.approx([load, load], rel=1e-3)
        assert base[0] == pytest.approx(mu * load, rel=1e-3)
        assert lid[0] == pytest.approx(-mu * load, rel=1e-3)


# ---- the period --------------------------------------------------------------------------------------------


def colliding(shift: float, period: float | None = SIDE) -> WorldSetup:
    """Return two balls that meet askew, moved along x and y."""
    start = np.array([[shift - 0.0055, shift - 0.001, 0.0], [shift + 0.0055, shift + 0.001, 0.0]])
    half = SIDE / 2 if period else SIDE
    placed = (start + half) % (2 * half) - half
    placed[:, 2] = 0.0
    bodies = worlds.grains(placed, velocities=[[0.3, 0.0, 0.0], [-0.3, 0.0, 0.0]])
    domain = ((-0.06,) * 3, (0.06,) * 3)
    law = worlds.pair(0.5, 0.4, 0.05)
    world = worlds.world(bodies, law, worlds.TIME_STEP, domain=domain)
    # With a wall that may be free, as in the test itself: all worlds with a period have one build.
    return replace(world, period=period, free_wall=0 if period else None)


@pytest.mark.parametrize("precision", ["double", "mixed"])
def test_balls_meet_across_the_side_of_a_period_as_in_its_middle(precision):
    shifts = [0.0, SIDE / 2, SIDE / 2 - 0.002, 0.01]
    solver = worlds.solve(*map(colliding, shifts), precision=precision)
    worlds.run_for(solver, 0.03)
    middle, *others = (worlds.state(solver, world) for world in range(4))
    plain = worlds.solve(colliding(0.0, None), precision=precision)
    worlds.run_for(plain, 0.03)
    # Places are rounded otherwise, at most by a count of 2**-34 m or a bit.
    close = {"rel": 0.0, "abs": 1e-12 if precision == "double" else 3e-6}
    for other in (*others, worlds.state(plain)):
        assert other["velocities"] == pytest.approx(middle["velocities"], **close)
        assert other["spins"] == pytest.approx(middle["spins"], rel=0.0, abs=1e3 * close["abs"])
    assert abs(middle["velocities"][0, 0]) < 0.2
    for state in (middle, *others):
        assert np.abs(state["positions"][:, :2]).max() <= SIDE / 2


def test_a_period_has_room_for_a_search_and_no_mesh():
    world = colliding(0.0)
    with pytest.raises(ValueError, match=r"WorldSetup.period: must be at least 0.0364 \[m\], got 0.03"):
        replace(world, period=0.03)
    plate = Mesh.plates([[(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]])
    with pytest.raises(ValueError, match=r"WorldSetup.period: walls must not be meshes"):
        replace(world, walls=((plate, 1), world.walls[1]))


def test_wrong_free_walls_are_refused():
    with pytest.raises(ValueError, match=r"WorldSetup.free_wall: must be a weighed wall, got 1"):
        replace(lidded(), weighed=(0,))
    with pytest.raises(ValueError, match=r"Motion.mass: must be 0 for wall 0, which is not free, got 1.0"):
        worlds.solve(lidded()).move_wall(0, 0, Motion(mass=1.0))
    with pytest.raises(ValueError, match=r"Motion.mass: must be positive with a force 2.0 N, got 0"):
        Motion(force=2.0)
    with pytest.raises(ValueError, match=r"Motion.mass: must be finite and 0 or more"):
        Motion(mass=math.nan)


# ---- Mohr's circles ----------------------------------------------------------------------------------------


def gap(slope: float, cohesion: float, middle: float, radius: float) -> float:
    """Return the distance of a circle on the normal axis from a line [Pa]."""
    return (cohesion + slope * middle) / math.hypot(1.0, slope) - radius


@pytest.mark.parametrize(("slope", "cohesion"), [(0.6, 200.0), (0.0, 300.0), (1.2, 0.0)])
def test_mohrs_circles_touch_the_yield_locus(slope, cohesion):
    strength = unconfined_strength(slope, cohesion)
    assert gap(slope, cohesion, strength / 2, strength / 2) == pytest.approx(0.0, abs=1e-9)
    steady = 1000.0, 0.9 * (cohesion + 1000.0 * slope)
    major = consolidation_stress(slope, cohesion, steady)
    # The middle of the circle through the point that ends at the major stress.
    middle = (major**2 - steady[0] ** 2 - steady[1] ** 2) / (2 * (major - steady[0]))
    assert gap(slope, cohesion, middle, major - middle) == pytest.approx(0.0, abs=1e-6)
    # It touches the locus left of the point: it is the smaller of the two.
    assert middle - (major - middle) * slope / math.hypot(1.0, slope) <= steady[0]


def test_a_point_above_the_locus_counts_as_on_it():
    on = consolidation_stress(0.5, 100.0, (1000.0, 600.0))
    assert consolidation_stress(0.5, 100.0, (1000.0, 630.0)) == pytest.approx(on, rel=1e-12)


def test_points_give_angle_cohesion_and_flow_function():
    points = [(normal, 50.0 + 0.7 * normal) for normal in (200.0, 400.0, 600.0, 800.0)]
    assert yield_locus(points) == pytest.approx((0.7, 50.0))
    found = strengths(points, (1000.0, 650.0))
    assert found["friction_angle"] == pytest.approx(math.degrees(math.atan(0.7)))
    assert found["steady_angle"] == pytest.approx(math.degrees(math.atan(0.65)))
    assert found["flow_ratio"] == pytest.approx(found["consolidation_stress"] / found["unconfined_strength"])
    loose = strengths([(normal, 0.7 * normal - 1.0) for normal, _ in points], (1000.0, 650.0))
    assert "flow_ratio" not in loose
    assert wall_friction(points)["wall_friction_angle"] > found["friction_angle"]


# ---- refusals ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "rule"),
    [
        ({"width": 0.02}, r"Shear.width: must be at least 0.024 m, 6 grains"),
        ({"fill_depth": 0.01}, r"Shear.fill_depth: must be at least 0.016 m, 4 grains"),
        (
            {"stress": 250.0},
            r"Shear.stress: must be above .* where the grains weigh more than the least load",
        ),
        ({"speed": 0.1}, r"Shear.speed: must be below .* an inertial number of 0.01"),
        ({"stress": 1e6}, r"Shear.stress: must be below .* where the lid meets the base"),
    ],
)
def test_impossible_shear_tests_are_refused(changes, rule):
    case = ball_case(replace(COLUMN, **changes), 0.4)
    with pytest.raises(ValueError, match=rule):
        case.scene.doubts(case.grains, case.grain_material)


def test_a_smooth_base_alone_may_have_its_own_material():
    part = WallPart("base", STEEL, Interaction(0.5, 0.1, 0.0))
    rough, smooth = (ball_case(replace(COLUMN, base=base), 0.3) for base in ("rough", "smooth"))
    _, holds = smooth.scene.surfaces(replace(smooth, wall_parts=(part,)), 2)
    assert holds == [3, 2]
    with pytest.raises(
        ValueError, match=r"Shear.base: must be smooth if it has its own material, got 'rough'"
    ):
        replace(rough, wall_parts=(part,))
    with pytest.raises(ValueError, match=r"Shear: part of the walls: must be one of base, got 'lid'"):
        replace(smooth, wall_parts=(replace(part, name="lid"),))


def test_fast_lids_are_named():
    grains = ball_case(COLUMN, 0.4).grains
    [fast] = COLUMN.doubts(grains, GRAIN)
    assert "the lid is not quasi-static: an inertial number of" in fast
    assert replace(COLUMN, speed=1e-3).doubts(grains, GRAIN) == ()


def test_grip_is_the_contact_of_rough_plates_alone():
    rough, smooth = (ball_case(replace(COLUMN, base=base), 0.3) for base in ("rough", "smooth"))
    assert [rough.scene.contact_of(wall) for wall in (0, 1)] == [2, 2]
    assert [smooth.scene.contact_of(wall) for wall in (0, 1)] == [1, 2]
    grip: ContactCoefficients = smooth.scene.contacts(smooth)[2]
    assert (grip.parameters["static_friction"], grip.parameters["rolling_friction"]) == GRIP
