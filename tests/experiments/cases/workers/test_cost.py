"""Costs told before a case runs: neighbours, stages of each test, grains that hang on walls."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from dem_warp import (
    MECHANISMS,
    Case,
    ClumpShape,
    GrainPopulation,
    Hopper,
    Interaction,
    LiftedCylinder,
    Material,
    Numerics,
    simulate,
)
from dem_warp.batch import Batch
from dem_warp.model import GRAVITY
from experiments.cases.forecast.cost import APART, cost_of, listed_entries
from experiments.cases.forecast.course import (
    BULK_FRACTION,
    CALM,
    FALL,
    SLOPE,
    SURVEYED,
    expected_course,
    hangs_on_walls,
    pull_on_walls,
)
from experiments.evidence.performance.scenes import SKETCHES, STEEL, sketch_case

RADIUS = 2.0e-3


def case_of(scene: Any, shape: ClumpShape | None = None, *laws: Any) -> Case:
    surfaces = Interaction(restitution=0.3, static_friction=0.4, rolling_friction=0.05)
    grains = GrainPopulation(shape or ClumpShape.sphere(RADIUS), Material(1200.0, 1.0e7, 0.25))
    return Case(
        scene, grains, surfaces, surfaces, seed=1, numerics=Numerics(modulus_scale=100.0), mechanisms=laws
    )


def tube(**settings: Any) -> LiftedCylinder:
    return LiftedCylinder(0.024, 0.03, STEEL, grain_count=40, **settings)


# ---- neighbours --------------------------------------------------------------------------------------------


def test_a_ball_lists_half_of_the_balls_in_the_shell_that_its_skin_reaches() -> None:
    case, skin = case_of(tube()), RADIUS
    shell = (2.0 * RADIUS + skin) ** 3 - (2.0 * APART * RADIUS) ** 3
    listed = 0.5 * BULK_FRACTION / RADIUS**3 * shell
    # 2048 points count the shell's share of the box around it to 1 %; the skin is rounded by 2.5 % at most
    assert listed_entries(case, skin) == pytest.approx(listed, rel=0.05)


def test_spheres_far_apart_list_neighbours_as_so_many_balls() -> None:
    apart = ClumpShape.from_spheres(np.array([[0.0, 0, 0], [12 * RADIUS, 0, 0]]), np.full(2, RADIUS))
    pair, ball = case_of(tube(), apart), case_of(tube())
    # the box around two holds fewer points of each shell
    assert listed_entries(pair, RADIUS) == pytest.approx(2.0 * listed_entries(ball, RADIUS), rel=0.1)


def test_neighbours_are_counted_as_the_solver_lists_them() -> None:
    """As seen in beds of the bench study of buckwheat: 28 a grain."""
    from experiments.studyfile import load_study

    case = load_study(None, "bench").case({}, 1)
    skin = float(case.grains.mean(lambda shape: float(shape.radii.mean())))
    assert listed_entries(case, skin) == pytest.approx(28.0, rel=0.2)


# ---- stages ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["lifted-cylinder", "hopper", "drum"])
def test_steps_of_every_test_are_told_within_a_half(name: str) -> None:
    smaller: dict[str, dict[str, float]] = {
        "lifted-cylinder": {},
        "hopper": {"diameter": 0.05, "fill_depth": 0.04, "outlet": 0.036},
        "drum": {"diameter": 0.06, "rotation_rate": 1.0, "revolutions": 0.5},
    }
    sketch = SKETCHES[name]
    case = sketch_case(sketch._replace(scene=replace(sketch.scene, **smaller[name])), 0.003)  # type: ignore[arg-type]
    [result] = simulate([case], "cpu", 1)
    assert result.status == "finished"
    assert 1 / 1.5 < cost_of(case).steps / sum(phase["steps"] for phase in result.phases) < 1.5


def test_a_case_of_fixed_duration_takes_that_long() -> None:
    case = case_of(tube(duration=2.5))
    assert cost_of(case).steps * case.time_step == pytest.approx(2.5)


def test_fewer_grains_are_there_where_a_container_is_struck_off_or_runs_out() -> None:
    counted, full = case_of(tube()), case_of(replace(tube(), grain_count=None))
    bin_ = case_of(Hopper(0.05, 0.04, 0.03, STEEL))
    assert cost_of(counted).present == 1.0
    assert cost_of(bin_).present < 0.8 < cost_of(full).present < 1.0


def test_only_a_box_with_a_slot_has_meshes() -> None:
    meshed = {name: cost_of(sketch_case(sketch, 0.003)).meshed for name, sketch in SKETCHES.items()}
    assert meshed == {"lifted-cylinder": False, "hopper": False, "drum": False, "draw-down": True}


def test_a_drum_that_turns_is_dearer_to_look_at() -> None:
    tended = {name: cost_of(sketch_case(sketch, 0.003)).tended for name, sketch in SKETCHES.items()}
    drum = tended.pop("drum")
    assert set(tended.values()) == {1.0}
    assert 1.0 < drum < SURVEYED
    case = sketch_case(SKETCHES["drum"], 0.003)
    brief = replace(case, scene=replace(case.scene, revolutions=1.0e-6))
    assert cost_of(brief).tended == pytest.approx(1.0, abs=1e-3)


# ---- plates and walls --------------------------------------------------------------------------------------


def test_balls_roll_down_a_plate_that_is_steeper_than_their_rolling_friction() -> None:
    times = [
        sum(stage.time for stage in expected_course(case_of(tube(tilt=math.atan(slope))), 40))
        for slope in (0.0, 0.049, 0.06, 0.12)
    ]
    assert times[0] == times[1]
    # a = 5/7 g (sin - mu_r cos): seven times the drive takes 7^-1/2 of the time
    assert times[2] > times[3] > times[0]
    start = times[2] - (times[2] - times[3]) / (1.0 - 1.0 / math.sqrt(7.0))
    heap = (3.0 * 40 * (4 / 3 * math.pi * RADIUS**3) / BULK_FRACTION * SLOPE**2 / math.pi) ** (1.0 / 3.0)
    # of the same time until the tube is clear of the heap
    assert start == pytest.approx(40 / 3000 + FALL + CALM + heap / 0.05, rel=0.02)


def test_clumps_with_feet_stay_on_a_tilted_plate() -> None:
    corners = RADIUS * np.array([[0.6, 0.6, 0.6], [0.6, -0.6, -0.6], [-0.6, 0.6, -0.6], [-0.6, -0.6, 0.6]])
    feet = ClumpShape.from_spheres(corners, np.full(4, RADIUS))
    level, tilted = (case_of(tube(tilt=tilt), feet) for tilt in (0.0, 0.1))
    assert cost_of(tilted).steps == cost_of(level).steps


def test_a_grain_hangs_on_a_wall_where_friction_under_the_pull_holds_its_weight() -> None:
    weight = 1200.0 * 4.0 / 3.0 * math.pi * RADIUS**3 * GRAVITY
    limit = weight / 0.4
    bridge, jkr = MECHANISMS["capillary_bridge"], MECHANISMS["jkr"]
    for part in (0.99, 1.01):
        # 4 pi r g of a bridge on a wall, and Hertz's 2 / sqrt(3) pi W r of an adhering contact without load
        wet = bridge(surface_tension=part * limit / (4.0 * math.pi * RADIUS), bridge_volume=1.0e-12)  # type: ignore[call-arg]
        dry = jkr(work_of_adhesion=part * limit / (2.0 / math.sqrt(3.0) * math.pi * RADIUS))  # type: ignore[call-arg]
        assert hangs_on_walls(case_of(tube(), None, wet)) == (part > 1.0)
        assert hangs_on_walls(case_of(tube(), None, dry)) == (part > 1.0)
    among_grains = jkr(work_of_adhesion=1.0, between="grains")  # type: ignore[call-arg]
    assert pull_on_walls(case_of(tube(), None, among_grains)) == 0.0


def test_grains_that_hang_on_the_tube_are_waited_for() -> None:
    high = replace(tube(), height=0.06)
    sticky = MECHANISMS["wall_adhesion"](wall_adhesion_energy_density=1.0e4, between="walls")  # type: ignore[call-arg]
    clean, hung = case_of(high), case_of(high, None, sticky)
    batch = Batch([hung], "cpu")
    while not batch.advance():
        pass
    told = cost_of(hung).steps
    assert told > 1.3 * cost_of(clean).steps
    assert 1 / 1.5 < told / batch.steps[0] < 1.5
