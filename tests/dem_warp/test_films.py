"""Frames of a case: forces in them, their spread over the case, and results that they leave as they are."""

from dataclasses import replace

import numpy as np
import pytest
import worlds
from worlds import DEVICE, GRAVITY, RADIUS, SMALL_TUBE, ball_mass, ball_on_plane, pair, small_case, solve

from dem_warp import CaseResult, Film, simulate, simulate_frames
from dem_warp.contact_forces import NO_GRAIN, NO_WALL, ForceProbe
from dem_warp.laws.micro_slip import MicroSlip
from dem_warp.snapshot import take_snapshot

COUNT = 12
CLUMPS = small_case(scene=replace(SMALL_TUBE, grain_count=20))


@pytest.fixture(scope="module")
def filmed() -> tuple[CaseResult, Film]:
    result, film = simulate_frames(CLUMPS, COUNT, DEVICE)
    assert film is not None
    return result, film


def test_frames_do_not_change_a_bit(filmed: tuple[CaseResult, Film]) -> None:
    [alone] = simulate([CLUMPS], DEVICE, workers=1)
    worlds.assert_same_result(alone, filmed[0])


def test_a_probe_leaves_no_trace_in_contacts_with_a_memory() -> None:
    contact = pair(restitution=0.3, friction=0.5, mechanisms=(MicroSlip(micro_slip=1.0),))
    solver = solve(replace(ball_on_plane(contact, 10.0), contacts=(contact, contact)))
    solver.advance(1)
    assert solver.neighbours.memory.numpy().any()
    before = take_snapshot(solver, 0)
    assert len(ForceProbe(solver).forces(0)) > 0
    worlds.assert_same_bits(before, take_snapshot(solver, 0))
    assert not solver.neighbours.reactions.force.numpy().any()
    assert not solver.neighbours.reactions.torque.numpy().any()


def test_contact_forces_accelerate_the_grains() -> None:
    setup = worlds.pile(count=12)
    solver = solve(setup)
    worlds.run_for(solver, 0.03)
    contacts = ForceProbe(solver).forces(0)
    net = np.zeros((setup.grains.count, 3))
    np.add.at(net, contacts.grains, contacts.forces)
    between = contacts.partners != NO_GRAIN
    np.add.at(net, contacts.partners[between], -contacts.forces[between])
    assert 0 < between.sum() < len(contacts)
    before, after = worlds.record(solver, 1).velocities
    gained = (after - before) / setup.time_step - np.array(setup.gravity)
    # A velocity of up to 1 m/s is kept in double precision, 1e-16, and a step lasts 5e-6 s.
    np.testing.assert_allclose(net / setup.masses[:, None], gained, rtol=1e-9, atol=1e-9)


def test_a_ball_at_rest_puts_its_weight_on_the_plane_below_it() -> None:
    contact = pair()
    found = ForceProbe(solve(ball_on_plane(contact))).forces(0)
    weight = ball_mass() * GRAVITY
    assert (found.grains, found.partners, found.walls) == ([0], [NO_GRAIN], [0])
    np.testing.assert_allclose(found.forces, [[0.0, 0.0, weight]], rtol=1e-12, atol=1e-12 * weight)
    np.testing.assert_allclose(found.normals, [[0.0, 0.0, 1.0]])
    # The surfaces meet half way into each other.
    overlap = worlds.static_overlap(contact, weight)
    np.testing.assert_allclose(found.points, [[0.0, 0.0, -0.5 * overlap]], atol=1e-12)


def test_two_balls_press_on_each_other_once() -> None:
    overlap = 1e-4
    bodies = worlds.grains([[0.0, 0.0, 0.0], [0.0, 2.0 * RADIUS - overlap, 0.0]])
    contact = pair()
    found = ForceProbe(solve(worlds.world(bodies, contact, 1e-6))).forces(0)
    assert (found.grains, found.partners, found.walls) == ([0], [1], [NO_WALL])
    # Hertz, with half a ball's radius.
    force = 4.0 / 3.0 * contact.modulus * np.sqrt(RADIUS / 2.0) * overlap**1.5
    np.testing.assert_allclose(found.forces, [[0.0, -force, 0.0]], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(found.normals, [[0.0, -1.0, 0.0]])
    np.testing.assert_allclose(found.points, [[0.0, RADIUS - 0.5 * overlap, 0.0]], atol=1e-12)


def test_frames_are_spread_over_the_whole_case(filmed: tuple[CaseResult, Film]) -> None:
    result, film = filmed
    times = np.array([frame.time for frame in film.frames])
    assert (len(times), times[0]) == (COUNT, 0.0)
    assert times[-1] == pytest.approx(result.observables["simulated_time"], rel=1e-12)
    # Chosen from four times as many and more, they are at most a fourth off an even spread, twice.
    np.testing.assert_allclose(np.diff(times), times[-1] / (COUNT - 1), rtol=0.5)
    assert [frame.phase for frame in (film.frames[0], film.frames[-1])] == ["fill", "rest"]


def test_the_last_frame_is_the_result(filmed: tuple[CaseResult, Film]) -> None:
    result, film = filmed
    last = film.frames[-1]
    np.testing.assert_array_equal(last.positions, result.positions)
    np.testing.assert_array_equal(last.orientations, result.orientations)
    centers, radii, grain = film.spheres(last)
    np.testing.assert_array_equal(centers, result.sphere_centers)
    np.testing.assert_array_equal(radii, result.sphere_radii)
    np.testing.assert_array_equal(grain, result.sphere_grain)


def test_the_plate_bears_the_heap_at_rest(filmed: tuple[CaseResult, Film]) -> None:
    _, film = filmed
    last = film.frames[-1]
    on_plate = last.contacts.walls == film.wall_names.index("plate")
    weight = film.masses[last.grains].sum() * GRAVITY
    # At rest: the speeds that are left, below 1 cm/s, change by far less than a hundredth of the weight.
    assert last.contacts.forces[on_plate, 2].sum() == pytest.approx(weight, rel=0.01)
    assert on_plate.any()
    assert (last.contacts.points[on_plate, 2] < 0.0).all()


def test_the_tube_rises_and_grains_that_wait_are_not_shown(filmed: tuple[CaseResult, Film]) -> None:
    _, film = filmed
    heights = [frame.wall_poses[film.wall_names.index("tube")][0][2] for frame in film.frames]
    phases = [frame.phase for frame in film.frames]
    lifted = (
        film.frames[-1].time - next(f.time for f in film.frames if f.phase == "lift") + film.frames[1].time
    )
    assert heights[0] == 0.0
    assert np.diff(heights).min() >= 0.0
    assert 0.0 < heights[-1] <= SMALL_TUBE.lift_speed * lifted
    assert phases == sorted(phases, key=["fill", "settle", "lift", "rest"].index)
    assert len(film.frames[0].grains) < len(film.frames[-1].grains) == 20


def test_a_case_that_cannot_begin_has_no_film() -> None:
    narrow = small_case(scene=replace(SMALL_TUBE, diameter=1e-3, height=1e-3))
    result, film = simulate_frames(narrow, COUNT, DEVICE)
    assert (result.status, film) == ("failed", None)
