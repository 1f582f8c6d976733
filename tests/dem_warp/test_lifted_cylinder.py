"""The lifted cylinder from rain to heap, alone, in batches, over processes, and with its options."""

import math
from dataclasses import replace

import numpy as np
import pytest
import worlds
from worlds import BOOT, GRAIN, PYRAMID, SMALL_TUBE, assert_same_result, grains, pair, run_batch, small_case

from dem_warp import Case, CaseResult, ClumpShape, GrainPopulation, ShapeMixture, simulate
from dem_warp.device import resolve_device
from dem_warp.scenes.scene import Decision
from dem_warp.simulation import batches
from dem_warp.view import WorldView, overviews


def with_shapes(shapes: tuple[ClumpShape, ...], fractions: tuple[float, ...]) -> Case:
    return replace(small_case(), grains=GrainPopulation(ShapeMixture(shapes, fractions), GRAIN))


def test_a_tube_is_filled_lifted_and_leaves_a_heap_at_rest(heap):
    assert (heap.status, heap.reason) == ("finished", "")
    assert [phase["name"] for phase in heap.phases] == ["fill", "settle", "lift"]
    seen = heap.observables
    assert seen["grain_count"] == len(heap.positions) + seen["grains_lost"]
    assert seen["grains_lost"] == 0
    # Poured, long-ish grains: looser than random close packing of spheres, 0.64, and looser still at the
    # walls.
    assert 0.3 < seen["solid_fraction"] < 0.65
    # Full: the bed ends within half a grain of the rim.
    assert seen["fill_height"] == pytest.approx(SMALL_TUBE.height, abs=0.5 * PYRAMID.bounding_radius)
    times = [phase["time"] for phase in heap.phases]
    assert seen["simulated_time"] == pytest.approx(sum(times), rel=1e-12)
    assert 0.0 < seen["time_to_rest"] <= times[2] - SMALL_TUBE.rest_time
    # All of it lies on the plate: spheres sink in by less than a tenth of the smallest.
    assert (heap.sphere_centers[:, 2] > 0.9 * heap.sphere_radii).all()
    # The tube is clear of it, and let it spread beyond its wall.
    top = (heap.sphere_centers[:, 2] + heap.sphere_radii).max()
    assert SMALL_TUBE.lift_speed * times[2] > top
    assert top < seen["fill_height"]
    assert np.hypot(*heap.sphere_centers.T[:2]).max() > SMALL_TUBE.diameter / 2


def test_a_printed_result_is_one_line_with_its_numbers(heap):
    text = str(heap)
    assert text.startswith(f"CaseResult(finished, {len(heap.positions)} grains, grain_count ")
    assert f"solid_fraction {heap.observables['solid_fraction']:.4g}" in text
    assert "\n" not in text
    assert len(text) < 400


def test_the_mass_that_fills_the_tube_is_that_of_the_grains(heap):
    volume = PYRAMID.volume * (heap.sizes**3).sum()
    space = np.pi / 4.0 * SMALL_TUBE.diameter**2 * heap.observables["fill_height"]
    assert heap.observables["solid_fraction"] == pytest.approx(volume / space, rel=1e-12)


def test_the_heap_is_really_at_rest(heap):
    # 0.1 s later: grains that were slow when it ended have come no farther than a ten-thousandth of a grain
    # (measured: 6e-8 m).
    scene = replace(SMALL_TUBE, duration=heap.observables["simulated_time"] + 0.1)
    [later] = simulate([small_case(scene=scene)], device="cpu", workers=1)
    assert later.observables["simulated_time"] >= scene.duration
    np.testing.assert_allclose(later.positions, heap.positions, rtol=0.0, atol=6e-7)


def test_grains_fall_over_the_rim_of_a_small_plate():
    diameter = 1.25 * SMALL_TUBE.diameter
    result = simulate([small_case(scene=replace(SMALL_TUBE, plate_diameter=diameter))], device="cpu")[0]
    assert result.status == "finished"
    assert result.observables["grains_lost"] == result.observables["grain_count"] - len(result.positions) > 0
    # A grain lies still only where the plate is under its centre.
    assert np.hypot(*result.positions.T[:2]).max() < diameter / 2
    assert (result.positions[:, 2] > 0.0).all()


def test_a_case_of_fixed_duration_ends_then():
    scene = replace(SMALL_TUBE, grain_count=8, duration=0.5)
    result = simulate([small_case(scene=scene)], device="cpu", workers=1)[0]
    assert result.status == "finished"
    # It looks every 4 ms or up to twice that.
    assert 0.5 <= result.observables["simulated_time"] < 0.51


def test_equal_shapes_under_two_names_are_one(heap):
    [twins] = simulate([with_shapes((PYRAMID, PYRAMID), (0.5, 0.5))], device="cpu", workers=1)
    assert_same_result(twins, heap)
    assert 0 < (twins.shapes == 0).sum() < len(twins.shapes)


def test_two_shapes_in_one_world_give_a_heap_alone_and_in_a_batch(heap):
    case = with_shapes((PYRAMID, BOOT), (0.4, 0.6))
    case = replace(case, scene=replace(SMALL_TUBE, grain_count=30))
    assert batches([small_case(), case], one_each=False) == [[0, 1]]
    [alone] = simulate([case], device="cpu", workers=1)
    results = run_batch([small_case(), case])
    assert_same_result(results[0], heap)
    assert_same_result(results[1], alone)
    assert (alone.status, alone.observables["grains_lost"]) == ("finished", 0)
    drawn = case.grains.draw(30, case.seed)
    np.testing.assert_array_equal(alone.shapes, drawn.shapes)
    counts = np.bincount(drawn.shapes)
    assert counts.min() > 5
    assert len(alone.sphere_radii) == 9 * counts[0] + 3 * counts[1]
    # All of it lies on the plate: spheres sink in by less than a tenth of the smallest.
    assert (alone.sphere_centers[:, 2] > 0.9 * alone.sphere_radii).all()
    volumes = np.array([PYRAMID.volume, BOOT.volume])[alone.shapes] * alone.sizes**3
    space = np.pi / 4.0 * SMALL_TUBE.diameter**2 * alone.observables["fill_height"]
    assert alone.observables["solid_fraction"] == pytest.approx(volumes.sum() / space, rel=1e-12)


def test_grains_of_5_and_of_30_spheres_form_a_heap():
    # Rings whose spheres overlap the more, the more they are: the longest neighbour lists of a grain's size.
    rings = []
    for count in (5, 30):
        turn = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
        centers = 2e-3 * np.column_stack([np.cos(turn), np.sin(turn), 0.3 * np.cos(3.0 * turn)])
        rings.append(ClumpShape.from_spheres(centers, np.full(count, 0.8e-3), resolution=8))
    case = with_shapes(tuple(rings), (0.5, 0.5))
    case = replace(case, scene=replace(SMALL_TUBE, grain_count=8))
    [result] = simulate([case], device="cpu", workers=1)
    assert result.status == "finished"
    assert len(result.sphere_radii) == 5 * (result.shapes == 0).sum() + 30 * (result.shapes == 1).sum()
    assert (result.sphere_centers[:, 2] > 0.9 * result.sphere_radii).all()


def test_no_cases_give_no_results():
    assert simulate([], device="cpu") == []


def end_of_lift(riding: int) -> tuple[Decision, Decision, float]:
    """Return decisions on a bed of 100 that stays in place, except some grains that ride on the tube.

    They are the first one after the lift began that asks for anything and the last one, with the tube's rise
    until then, in its heights.
    """
    case = small_case()
    case = replace(case, scene=replace(case.scene, grain_count=100))
    setup = case.scene.prepare([case], resolve_device("cpu"))[0]
    controller = case.scene.controller(case, setup, 256)
    alive, rest = np.ones(100, dtype=bool), np.zeros((100, 3))
    bed = np.column_stack([rest[:, :2], np.linspace(0.05, 0.1, 100) * case.scene.height])
    lifted_at, time, rise, first, decision = None, 0.0, 0.0, None, Decision()
    while not decision.done:
        rise = 0.0 if lifted_at is None else case.scene.lift_speed * (time - lifted_at)
        positions = bed.copy()
        positions[:riding, 2] += rise
        step = round(time / setup.time_step)
        overview = [each.item() for each in overviews(positions[None], rest[None], alive[None])]
        view = WorldView(step, time, alive, alive, positions, rest, setup.masses, np.zeros((1, 3)), *overview)
        decision = controller.look(view)
        if decision.remove is not None:
            alive[decision.remove] = False
        if lifted_at is not None and first is None and (decision.done or decision.remove is not None):
            first = decision
        lifted_at = time if decision.move else lifted_at
        time += controller.period * setup.time_step
    return first, decision, rise / case.scene.height


def test_a_bed_that_rises_with_the_tube_has_clogged_it():
    first, last, risen = end_of_lift(riding=50)
    assert first is last
    assert last.failure == "the tube is clogged: 50 grains rose with it"
    assert 1.5 < risen < 1.6


def test_a_grain_that_hangs_on_the_rim_leaves_with_the_tube():
    first, last, risen = end_of_lift(riding=1)
    assert first.remove.tolist() == [0]
    assert last.done
    assert last.failure == ""
    assert risen < 3.0


def test_a_bed_that_stays_is_a_heap_once_the_tube_is_above_it():
    first, last, risen = end_of_lift(riding=0)
    assert first is last
    assert last.failure == ""
    assert risen < 1.5


SLIPPERY = 0.1
ABOVE, BELOW = math.atan(SLIPPERY) + 0.08, math.atan(SLIPPERY) - 0.04
"""Slopes on either side of the friction angle [rad]."""

ONE = replace(SMALL_TUBE, grain_count=1)


def one_grain(**options: float) -> CaseResult:
    """Simulate one grain of three feet in a slippery lifted cylinder with options."""
    case = small_case(scene=replace(ONE, **options))
    slippery = replace(case, grain_wall=replace(case.grain_wall, static_friction=SLIPPERY))
    [result] = simulate([slippery], device="cpu", workers=1)
    assert result.status == ("failed" if result.observables["grains_lost"] else "finished")
    return result


@pytest.fixture(scope="module")
def low_heap() -> CaseResult:
    return simulate([small_case(scene=replace(SMALL_TUBE, grain_count=20))], device="cpu", workers=1)[0]


def test_a_tilt_turns_gravity_towards_x():
    gravity = np.array(replace(SMALL_TUBE, tilt=0.3).gravity)
    assert np.linalg.norm(gravity) == pytest.approx(9.81, rel=1e-15)
    assert math.atan2(gravity[0], -gravity[2]) == pytest.approx(0.3, rel=1e-15)
    assert gravity[1] == 0.0
    assert SMALL_TUBE.gravity == (0.0, 0.0, -9.81)


def test_a_grain_on_a_tilted_plate_stays_below_the_friction_angle_and_leaves_above():
    assert one_grain(tilt=BELOW).observables["grains_lost"] == 0
    assert one_grain(tilt=ABOVE).observables["grains_lost"] == 1


def test_the_friction_of_the_plate_is_the_plates_alone():
    def contacts(**options: float) -> dict[str, object]:
        case = small_case(scene=replace(SMALL_TUBE, **options))
        [setup] = case.scene.prepare([case], resolve_device("cpu"))
        plate, tube = (setup.contacts[contact] for _, contact in setup.walls)
        return {"grains": setup.contacts[0], "tube": tube, "plate": plate}

    base, rough = contacts(), contacts(plate_friction=0.9)
    assert base["plate"] == base["tube"]
    assert rough == base | {"plate": replace(base["plate"], static_friction=0.9)}
    assert contacts(plate_friction_excess=0.5) == rough


def test_a_vibration_flattens_the_heap_and_ends_before_it_rests(low_heap):
    scene = replace(SMALL_TUBE, grain_count=20, vibration_amplitude=1e-4, vibration_hold=0.2)
    [shaken] = simulate([small_case(scene=scene)], device="cpu", workers=1)
    assert shaken.status == "finished"
    # 50 vibrations a second, whole ones: 0.32 s for the height of the tube, 0.2 s more.
    assert scene.vibration_time == pytest.approx(0.52, rel=1e-12)
    assert shaken.observables["time_to_rest"] >= scene.vibration_time
    assert shaken.positions[:, 2].mean() < low_heap.positions[:, 2].mean()
    # The plate is back at z = 0: spheres sink in by less than a tenth of the smallest.
    assert (shaken.sphere_centers[:, 2] > 0.9 * shaken.sphere_radii).all()


def test_air_takes_velocity_at_its_rate():
    rate, speed, step = 5.0, 0.2, 1e-4
    still = replace(
        worlds.world(grains(np.zeros(3), velocities=[speed, 0.0, 0.0]), pair(), step), air_drag=rate
    )
    solver = worlds.solve(still)
    worlds.run_for(solver, 0.2)
    time = int(solver.grains[0].step.numpy()[0]) * step
    end = worlds.state(solver)
    # The decay of every step is exact: rounding of float64 over 2,000 steps.
    assert end["velocities"][0, 0] == pytest.approx(speed * math.exp(-rate * time), rel=1e-12)
    # The path is the sum over the steps, of first order in the step.
    path = speed / rate * -math.expm1(-rate * time)
    assert end["positions"][0, 0] == pytest.approx(path, rel=rate * step)
