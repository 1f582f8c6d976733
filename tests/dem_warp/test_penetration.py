"""Penetration: a cone between balls by Hertz, tip and shaft, tools of one shape, momentum and refusals."""

import math
from dataclasses import replace

import numpy as np
import pytest
import worlds
from worlds import GRAIN, GRAVITY, STEEL, assert_measured_as_declared, ball_case

from dem_warp import Case, CaseResult, Penetration, simulate
from dem_warp.walls import Cone, Cylinder, Motion, Plane

BED = Penetration(0.03, 0.018, STEEL, 0.01, 0.01, tool="plate", rest_speed=3e-3)
SEGMENTS = 24


def disc(radius: float, height: float = 0.0) -> tuple[tuple[float, ...], ...]:
    """Return the triangles of a thin disc, or of a cone with its tip down [m]."""
    turns = 2 * math.pi / SEGMENTS * np.arange(SEGMENTS + 1)
    ring = np.column_stack([radius * np.cos(turns), radius * np.sin(turns), np.full(len(turns), height)])
    ring[-1] = ring[0]
    return tuple((0.0, 0.0, 0.0, *a, *b) for a, b in zip(ring[:-1].tolist(), ring[1:].tolist(), strict=True))


def cases() -> dict[str, Case]:
    scenes = {
        "plate": BED,
        "slow": replace(BED, speed=BED.speed / 2),
        "cone": replace(BED, tool="cone", tool_angle=math.pi / 2),
        "body": replace(BED, tool="body", tool_diameter=None, body=disc(0.005)),
        "thin": replace(BED, shaft_diameter=2e-3),
        "deep": replace(BED, depth=0.0175),
    }
    return {name: ball_case(scene, 0.4, 0.1) for name, scene in scenes.items()}


@pytest.fixture(scope="module")
def runs() -> dict[str, CaseResult]:
    return dict(zip(cases(), simulate(list(cases().values()), device="cpu", workers=1), strict=True))


def forces(run: CaseResult, name: str = "") -> np.ndarray:
    return np.array([run.observables[f"{name}force_{number}"] for number in range(1, 6)])


@pytest.mark.parametrize("name", [name for name in cases() if name != "deep"])
def test_a_penetration_ends_with_what_its_scene_declares(runs, name):
    run = runs[name]
    assert (run.status, run.reason) == ("finished", "")
    assert_measured_as_declared(cases()[name], run)
    assert [phase["name"] for phase in run.phases] == ["fill", "settle", "approach", "penetrate"]
    # Sums of the same numbers in another order.
    assert forces(run, "tip_") + forces(run, "shaft_") == pytest.approx(forces(run), rel=1e-9)
    assert run.observables["work"] == pytest.approx(forces(run).mean() * BED.depth, rel=1e-9)


def test_the_force_grows_with_the_depth_and_is_mostly_on_the_tip(runs):
    plate, cone = forces(runs["plate"]), forces(runs["cone"])
    assert (np.diff(plate) > 0).all()
    assert forces(runs["plate"], "tip_").sum() > 0.6 * plate.sum()
    # In the same depth of its tip, a cone displaces a third of a plate's volume, or less.
    assert cone.sum() < 0.5 * plate.sum()
    # The tip of this cone is as high as half of the depth: grains meet its shaft only then.
    assert forces(runs["cone"], "shaft_")[:2] == pytest.approx([0.0, 0.0], abs=0.02 * cone.max())
    # Grains that flow over the plate rest on it, and hold a thin shaft less.
    assert forces(runs["thin"], "shaft_").sum() < forces(runs["plate"], "shaft_").sum()


def test_a_disc_of_triangles_meets_the_force_of_a_plate(runs):
    # Its area is 1.1 % smaller, and other contacts in the first step give other grains in the end.
    work, plate = (runs[name].observables["work"] for name in ("body", "plate"))
    assert work == pytest.approx(plate, rel=0.15)


def test_half_the_speed_gives_the_same_work(runs):
    # An inertial number below 0.04: single grains that slip make some 10 % in a bed of this size.
    assert runs["slow"].observables["work"] == pytest.approx(runs["plate"].observables["work"], rel=0.15)


def test_a_bed_that_is_too_shallow_fails_with_its_reason(runs):
    assert runs["deep"].status == "failed"
    assert runs["deep"].reason.startswith("the bed is 1")
    assert "mm deep, and the tool needs 22.1 mm: fill in more grains" in runs["deep"].reason


def test_a_cone_between_three_balls_has_the_force_of_hertz():
    # Without friction the ball yields by d at the cone, by d cos(a)^(2/3) at the wall and d sin(a)^(2/3) at
    # the floor, whose forces are the parts of the cone's; the three make up the cone's way normal to itself.
    half, radius, law = math.radians(30), worlds.RADIUS, worlds.pair(restitution=0.1, friction=0.0)
    ring = 2 * radius / math.sqrt(3) * 1.2
    turns = 2 * math.pi / 3 * np.arange(3)
    places = np.column_stack([ring * np.cos(turns), ring * np.sin(turns), np.full(3, radius)])
    # The cone's flank touches each ball from inside and above.
    tip = radius - (ring - radius / math.cos(half)) / math.tan(half)
    walls = (
        Plane(),
        Cylinder((0.0, 0.0, -0.01), ring + radius, 0.05),
        Cone((0.0, 0.0, tip), 0.0, 0.03 * math.tan(half), 0.03),
        Plane((0.0, 0.0, -1.0)),  # far off; four walls, as the other test of this precision
    )
    setup = worlds.world(worlds.grains(places), law, worlds.TIME_STEP, walls=walls)
    solver = worlds.solve(replace(setup, weighed=(0, 1, 2)), precision="double")
    path, time = 2e-4, 0.4
    solver.move_wall(0, 2, Motion(velocity=(0.0, 0.0, -path / time), duration=time))
    worlds.run_for(solver, time + 0.1)
    [before] = solver.view([0])
    worlds.run_for(solver, 0.05)
    [after] = solver.view([0])
    floor, _, cone = ((after.impulses - before.impulses) / (after.time - before.time))[:, 2]
    shares = math.cos(half) ** (5 / 3) + math.sin(half) ** (5 / 3)
    overlap = path * math.sin(half) / (1 + shares)
    wanted = 3 * 4 / 3 * law.modulus * math.sqrt(radius) * overlap**1.5 * math.sin(half)
    # The walls turn by a hundredth of the overlap over the radius as the balls move; damping has died out.
    assert cone == pytest.approx(wanted, rel=2e-3)
    assert floor == pytest.approx(-cone, rel=1e-6)


def test_what_the_walls_bear_is_the_weight_and_the_momentum():
    case = ball_case(replace(BED, grain_count=200), 0.4, 0.1)
    [setup] = case.scene.prepare([case], "cpu")
    solver = worlds.solve(replace(setup, weighed=(0, 1, 2, 3)))
    released = float(setup.grains.release_steps.max() * setup.time_step)
    worlds.run_for(solver, released + 0.05)
    for wall in (2, 3):
        solver.move_wall(0, wall, Motion(velocity=(0.0, 0.0, -0.2)))
    [before] = solver.view([0])
    worlds.run_for(solver, 0.08)
    [after] = solver.view([0])
    assert after.alive.all()
    assert (after.impulses - before.impulses)[3, 2] > 0
    momentum = float(after.masses @ (after.velocities - before.velocities)[:, 2])
    weight = GRAVITY * float(after.masses.sum()) * (after.time - before.time)
    # Velocities and forces are in single precision.
    assert -float((after.impulses - before.impulses)[:, 2].sum()) == pytest.approx(
        weight + momentum, rel=1e-4
    )


def test_unlikely_tools_are_named_and_impossible_ones_refused():
    grains, material = ball_case(BED, 0.4).grains, GRAIN
    wide = replace(BED, diameter=0.3, tool_diameter=0.04, fill_depth=0.2, depth=0.1, speed=1e-2)
    assert wide.doubts(grains, material) == ()
    fast, narrow, near, low = BED.doubts(grains, material)
    # v / D d / sqrt(g z)
    assert f"{BED.speed / 0.01 * 4e-3 / math.sqrt(GRAVITY * 0.01):.1e} at the whole depth" in fast
    assert "2.5 grains wide" in narrow
    assert "0.8 of its widths above the base" in low
    assert "3.0 tools wide" in near
    with pytest.raises(ValueError, match=r"Penetration.speed: must be below .* an inertial number of 0.3"):
        replace(BED, speed=1.0).doubts(grains, material)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"tool_diameter": None}, r"Penetration.tool_diameter: needed with tool = 'plate'"),
        ({"tool": "body"}, r"Penetration.tool_diameter: must be absent with tool = 'body'"),
        ({"body": disc(0.005)}, r"Penetration.body: must be absent with tool = 'plate'"),
        ({"tool": "body", "tool_diameter": None, "body": disc(0.02)}, r"body: must be below the diameter"),
        ({"tool_diameter": 0.03}, r"Penetration.tool_diameter: must be below the diameter, 0.03 m"),
        ({"shaft_diameter": 0.011}, r"Penetration.shaft_diameter: must be below the width of the tip"),
        ({"depth": 0.018}, r"Penetration.depth: must be below the fill_depth, 0.018 m, got 0.018 m"),
        ({"tool_angle": math.pi}, r"Penetration.tool_angle: must be below 3.14159"),
        ({"tool": "wedge"}, r"Penetration.tool: must be one of cone, plate, body"),
    ],
)
def test_impossible_settings_are_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        replace(BED, **changes)
