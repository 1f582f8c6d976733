"""Motion of single rigid grains, and of clumps that collide."""

import math

import numpy as np
from scipy.spatial.transform import Rotation
from worlds import BOOT, GRAVITY, PYRAMID, grains, pair, record, solve, state, world

SPIN = np.array([3.0, 40.0, 5.0])
"""Near the middle axis of the boot, where a free body tumbles [rad/s]."""

TUMBLE_STEP = 1e-5


def spin_momentum(setup, poses) -> np.ndarray:
    """Return angular momentum of each grain about its own centre [kg m2/s], (n, 3)."""
    turns = [Rotation.from_quat(q).as_matrix() for q in poses["orientations"]]
    inertia = setup.inertias[poses["slots"]]
    return np.array([r @ (i * (r.T @ s)) for r, i, s in zip(turns, inertia, poses["spins"], strict=True)])


def tumbling(time_step: float):
    bodies = grains([0.0, 0.0, 0.0], spins=SPIN, shapes=1)
    return world(bodies, pair(), time_step, shapes=(PYRAMID, BOOT))


def drift(time_step: float, chunks: int, precision: str = "double") -> tuple[float, float]:
    """Return relative changes of angular momentum and of rotation energy of the free boot."""
    setup = tumbling(time_step)
    solver = solve(setup, precision=precision)
    momentum = [spin_momentum(setup, state(solver))]
    energy = [float(momentum[0][0] @ SPIN) / 2.0]
    solver.advance(chunks)
    end = state(solver)
    momentum.append(spin_momentum(setup, end))
    energy.append(float(momentum[1][0] @ end["spins"][0]) / 2.0)
    size = np.linalg.norm(momentum[0])
    return float(np.linalg.norm(momentum[1] - momentum[0]) / size), abs(energy[1] / energy[0] - 1.0)


def test_a_free_asymmetric_top_keeps_momentum_and_energy():
    moments = np.sort(BOOT.inertia_over_mass)
    assert (np.diff(moments) > 0.05 * moments[2]).all()
    # 1e5 steps, 6 turns, at the step of production. The momentum is carried by rotations: 1e5 roundings of
    # 1e-16.
    momentum, energy = drift(TUMBLE_STEP, 391)
    assert momentum < 1e-11
    assert energy < 1e-6


def test_the_energy_of_a_free_top_drifts_at_second_order():
    # The same 0.41 s with 16 and 4 times the step above.
    coarse = drift(16 * TUMBLE_STEP, 10)[1]
    fine = drift(4 * TUMBLE_STEP, 40)[1]
    assert math.log(coarse / fine) / math.log(4.0) > 1.8


def test_a_free_top_follows_the_equations_of_euler():
    # Reference: Runge-Kutta of fourth order at the same step, exact to 1e-12 here; the body frame starts as
    # the world's.
    setup = tumbling(TUMBLE_STEP)
    solver = solve(setup)
    steps = 256 * 40
    solver.advance(40)
    moments = setup.inertias[0]

    def rate(s: np.ndarray) -> np.ndarray:
        return np.cross(moments * s, s) / moments

    s = SPIN.copy()
    for _ in range(steps):
        a = rate(s)
        b = rate(s + 0.5 * TUMBLE_STEP * a)
        c = rate(s + 0.5 * TUMBLE_STEP * b)
        d = rate(s + TUMBLE_STEP * c)
        s = s + TUMBLE_STEP / 6.0 * (a + 2.0 * b + 2.0 * c + d)
    end = state(solver)
    body_spin = Rotation.from_quat(end["orientations"][0]).inv().apply(end["spins"][0])
    # Second order: (spin * step)^2 = 1.6e-7 times the angle turned, 4 rad.
    np.testing.assert_allclose(body_spin, s, atol=1e-6 * np.linalg.norm(SPIN))


def test_a_free_fall_is_that_of_symplectic_euler():
    dt, chunks = 1e-5, 20
    bodies = grains([0.01, -0.02, 0.03], velocities=[0.3, -0.2, 0.5], spins=SPIN)
    setup = world(bodies, pair(), dt, shapes=(PYRAMID,), gravity=(0.0, 0.0, -GRAVITY))
    n = 256 * chunks
    place = bodies.positions[0] + bodies.velocities[0] * n * dt
    place[2] -= GRAVITY * dt * dt * n * (n + 1) / 2.0
    # float32 velocities round by 6e-8 in each step, always the same way at worst.
    for precision, speed_error in (("double", 1e-15 * n), ("mixed", 6e-8 * n)):
        solver = solve(setup, precision=precision)
        solver.advance(chunks)
        end = state(solver)
        np.testing.assert_allclose(
            end["velocities"][0], [0.3, -0.2, 0.5 - GRAVITY * n * dt], atol=speed_error
        )
        np.testing.assert_allclose(end["positions"][0], place, atol=speed_error * n * dt)


def test_colliding_clumps_keep_both_momenta():
    rng = np.random.default_rng(4)
    places = 4.5e-3 * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
    turns = rng.normal(size=(8, 4))
    bodies = grains(
        places, velocities=-60.0 * places, spins=rng.normal(size=(8, 3)) * 20.0, orientations=turns
    )
    setup = world(bodies, pair(restitution=0.4, friction=0.5), 5e-6, shapes=(PYRAMID,), skin=1e-3)
    solver = solve(setup)
    masses = setup.masses

    def momenta() -> tuple[np.ndarray, np.ndarray, float]:
        now = state(solver)
        linear = masses[:, None] * now["velocities"]
        orbit = np.cross(now["positions"], linear).sum(axis=0)
        own = spin_momentum(setup, now)
        energy = 0.5 * float(np.sum(linear * now["velocities"]) + np.sum(own * now["spins"]))
        return linear.sum(axis=0), orbit + own.sum(axis=0), energy

    linear_before, angular_before, energy_before = momenta()
    solver.advance(20)
    linear_after, angular_after, energy_after = momenta()
    # They did collide, and friction and damping took their part.
    assert energy_after < 0.8 * energy_before
    # Each contact's forces are equal and opposite and act at one point: only rounding, 5,000 steps of 1e-16
    # of the momentum that single grains have.
    size = masses[0] * np.linalg.norm(bodies.velocities[0])
    np.testing.assert_allclose(linear_after, linear_before, atol=1e-12 * size)
    np.testing.assert_allclose(angular_after, angular_before, atol=1e-12 * size * np.linalg.norm(places[0]))


def test_the_frame_does_not_matter():
    turns = Rotation.from_rotvec([0.4, -1.1, 2.0]).as_matrix()
    contact = pair(restitution=0.3, friction=0.4)
    places = np.array([[0.0, 0.0, 0.0], [0.002, 0.001, 0.0098]])
    velocities = np.array([[0.0, 0.0, 0.1], [0.02, 0.05, -0.1]])
    straight, turned = (
        record(solve(world(grains(places @ m, velocities=velocities @ m), contact, 2e-6)), 1500)
        for m in (np.eye(3), turns)
    )
    assert np.abs(straight.spins[-1]).max() > 0.1
    for name, array in vars(straight).items():
        # 1,500 roundings of 1e-16 each, magnified a little by the contact.
        np.testing.assert_allclose(
            getattr(turned, name) @ turns.T, array, atol=1e-12 * np.abs(array).max(), err_msg=name
        )
