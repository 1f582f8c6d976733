"""Walls of triangles: one contact at the nearest point of the surface, and no trace of the seams."""

import math
from dataclasses import replace

import numpy as np
import pytest
import worlds
from scipy.spatial.transform import Rotation
from worlds import GRAVITY, RADIUS, TIME_STEP, ball_mass, downhill, grains, pair, run_for, solve, state, world

from dem_warp.snapshot import put_snapshot, take_snapshot
from dem_warp.triangles import TriangleTable
from dem_warp.walls import Mesh, Motion, Plane

CONTACT = pair(restitution=0.1)
OVERLAP = worlds.static_overlap(CONTACT, ball_mass() * GRAVITY)
SLANT = math.sqrt(0.5)
CORNERS = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
SIDES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
     [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
)  # fmt: skip
EDGE = 0.04
BOX = Mesh((CORNERS - 0.5) * EDGE, SIDES)
"""A cube about the origin, each side of two triangles [m]."""


def plate(cells: int, half: float = 0.06, shift: float = 0.0) -> Mesh:
    """Return a square plate z = 0 of triangles, its inner vertices moved aside by some part of a cell."""
    rng = np.random.default_rng(cells)
    axis = np.linspace(-half, half, cells + 1)
    x, y = np.meshgrid(axis, axis, indexing="ij")
    inner = np.zeros_like(x)
    inner[1:-1, 1:-1] = shift * 2.0 * half / cells
    x, y = (a + inner * rng.uniform(-1.0, 1.0, a.shape) for a in (x, y))
    number = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    faces = np.concatenate([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)]).reshape(-1, 3)
    return Mesh(np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)]), faces)


@pytest.mark.parametrize(
    ("mesh", "nearest", "outward"),
    [
        pytest.param(BOX, (0.01, 0.01, 0.02), (0.0, 0.0, 1.0), id="on a flat seam"),
        pytest.param(BOX, (0.01, 0.02, 0.02), (0.0, 0.28, 0.96), id="on an edge, nearly on a face"),
        pytest.param(BOX, (-0.02, 0.02, 0.02), (-1 / 3, 2 / 3, 2 / 3), id="on a corner"),
        pytest.param(plate(2), (0.06, 0.01, 0.0), (0.8, 0.0, -0.6), id="on a free edge"),
        pytest.param(plate(7, shift=0.3), (0.001, -0.003, 0.0), (0.0, 0.0, -1.0), id="under a plate"),
    ],
)
def test_a_ball_rests_on_every_part_of_a_mesh(mesh, nearest, outward):
    end = worlds.settle(CONTACT, mesh, np.add(nearest, np.multiply(RADIUS, outward)), np.negative(outward))
    np.testing.assert_allclose(
        end, np.add(nearest, np.multiply(RADIUS - OVERLAP, outward)), rtol=0.0, atol=1e-6 * OVERLAP
    )


def test_a_ball_in_a_groove_touches_both_sides():
    # A right-angled groove along x: each side carries m g / sqrt(2).
    vertices = [[x, y, abs(y)] for x in (-0.05, 0.05) for y in (-0.03, 0.0, 0.03)]
    groove = Mesh(vertices, [[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]])
    end = worlds.settle(CONTACT, groove, [0.0, 0.0, RADIUS / SLANT], [0.0, 0.0, -1.0])
    overlap = worlds.static_overlap(CONTACT, ball_mass() * GRAVITY * SLANT)
    np.testing.assert_allclose(end, [0.0, 0.0, (RADIUS - overlap) / SLANT], rtol=0.0, atol=1e-6 * OVERLAP)


def around_box() -> np.ndarray:
    """Return places within a ball's reach and beyond, (n, 3): scattered, and in line with all symmetries."""
    rng = np.random.default_rng(1)
    half, out = 0.5 * EDGE, 0.5 * EDGE + 0.9 * RADIUS
    scattered = rng.uniform(-half - RADIUS, half + RADIUS, (400, 3))
    over_seams = [[x, sign * x, out] for x in (0.0, 0.3 * half, half) for sign in (-1.0, 1.0)]
    over_edges = [[x, half, out] for x in (-half, 0.0, 0.2 * half, half)]
    beyond = [[half + 0.5 * RADIUS, half + 0.5 * RADIUS, z] for z in (0.0, half, half + 0.5 * RADIUS)]
    places = np.vstack([scattered, over_seams, over_edges, beyond])
    return places[(np.abs(places) > half).any(axis=1)]


def test_a_ball_anywhere_about_a_turned_box_has_one_contact_with_its_nearest_point():
    turn = Rotation.from_rotvec([0.3, -0.5, 0.9])
    box = Mesh(turn.apply(np.array(BOX.vertices)), BOX.faces)
    places = around_box()
    contact = pair()
    solver = solve(*(world(grains(turn.apply(p)), contact, TIME_STEP, walls=(box,)) for p in places))
    solver._cycle(1)
    velocities = solver.grains[1].velocity.numpy()[:, :3]
    arm = places - np.clip(places, -0.5 * EDGE, 0.5 * EDGE)
    distance = np.linalg.norm(arm, axis=1)
    overlap = np.maximum(RADIUS - distance, 0.0)
    force = 4.0 / 3.0 * contact.modulus * math.sqrt(RADIUS) * overlap**1.5
    expected = (force / distance)[:, None] * arm * TIME_STEP / ball_mass()
    assert np.count_nonzero(overlap) > 150
    # An overlap of at least 1e-6 m is wrong by the rounding of places, 1e-17 m.
    np.testing.assert_allclose(turn.inv().apply(velocities), expected, rtol=1e-8, atol=1e-12)


@pytest.mark.parametrize(
    ("mesh", "place", "velocity"),
    [
        pytest.param(plate(1), (-0.03, -0.03, 0.0), (0.4, 0.4, 0.0), id="along the seam"),
        pytest.param(plate(25, shift=0.35), (-0.03, 0.002, 0.0), (0.6, 0.03, 0.0), id="over many"),
    ],
)
def test_a_plate_of_triangles_is_a_plane(mesh, place, velocity):
    # Down a slope with friction, bouncing at first, sliding, then rolling: forces and their history count.
    contact = pair(restitution=0.4, friction=0.3, rolling=0.01)
    ends = []
    for wall in (Plane(), mesh):
        ball = grains(np.add(place, [0.0, 0.0, RADIUS + 1e-4]), velocities=velocity)
        solver = solve(world(ball, contact, TIME_STEP, walls=(wall,), gravity=downhill(15.0)))
        run_for(solver, 0.1)
        assert solver.flags.numpy()[0] == 0
        ends.append(state(solver))
    assert ends[0]["positions"][0, 0] > 0.0
    assert np.abs(ends[0]["spins"]).max() > 20.0
    # An overlap of 1e-6 m differs by 1e-17 m at each step, some 1e4 of them.
    for name, size in (("positions", 0.1), ("velocities", 1.0), ("spins", 100.0)):
        np.testing.assert_allclose(ends[1][name], ends[0][name], rtol=0.0, atol=1e-9 * size, err_msg=name)


def test_neighbours_of_a_triangle_are_those_that_share_corners():
    table = TriangleTable.of(BOX)
    for i, mine in enumerate(table.corners):
        found = dict.fromkeys(range(len(table.corners)), 0)
        for entry in table.adjacent[table.first[i] : table.first[i] + table.count[i]].tolist():
            found[entry >> 3] |= entry & 7
        for j, theirs in enumerate(table.corners):
            shared = sum(1 << k for k in range(3) if (theirs == mine[k]).all(axis=1).any())
            assert found[j] == (shared if i != j else 0)
    # a corner of the box where five triangles meet, or four
    assert table.count.tolist() == [8] * 12


def heap_in(mesh: Mesh, seed: int):
    rng = np.random.default_rng(seed)
    places = [[0.012 * x, 0.012 * y, 0.03 + 0.012 * z] for x in (-1, 1) for y in (-1, 1) for z in range(3)]
    bodies = grains(places + rng.uniform(-1e-3, 1e-3, (12, 3)), velocities=[0.0, 0.0, -0.3])
    contact = pair(restitution=0.3, friction=0.4, rolling=0.02)
    return world(bodies, contact, TIME_STEP, walls=(mesh, Plane()), gravity=downhill(0.0), skin=1.5e-3)


def test_a_world_goes_on_with_its_moving_mesh_in_a_batch_with_another():
    setup = replace(heap_in(Mesh.tube(0.0245, 0.06, 12), 1), skin=3e-3)
    larger = replace(heap_in(BOX, 2), grains=grains(np.mgrid[:2, :2, :5].reshape(3, -1).T * 0.012))
    whole, first, second = solve(setup), solve(setup), solve(larger, setup)
    for solver in (whole, first):
        solver.move_wall(0, 0, Motion((0.0, 0.0, 0.01), spin=(0.2, 0.0, 0.3)))
        run_for(solver, 0.05)
    put_snapshot(second, 1, take_snapshot(first, 0))
    for solver, w in ((whole, 0), (second, 1)):
        run_for(solver, 0.02)
        solver.move_wall(w, 0, Motion((0.0, 0.0, -0.01)))
        run_for(solver, 0.02)
    worlds.assert_same_bits(state(second, 1), state(whole))
