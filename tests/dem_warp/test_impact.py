"""Impacts of two spheres, and of a sphere that slides on a plane, against closed forms."""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from worlds import RADIUS, Impact, ball_mass, grains, oblique_impact, pair, record, solve, world

from dem_warp.model import ContactCoefficients
from dem_warp.walls import Plane

SPEED = 0.1
PHASES = (0.0, 0.25, 0.5, 0.75)
"""Part of a step at which the spheres meet: what is seen of an impact depends on it."""


@dataclass(frozen=True)
class Seen:
    """One impact as simulated: overlap [m], force [N] and speed of separation [m/s], step by step."""

    expected: Impact
    time_step: float
    overlap: np.ndarray
    force: np.ndarray
    speed: np.ndarray

    @property
    def duration(self) -> float:
        """Time from first to last touch [s], the overlap being interpolated to zero."""
        d = self.overlap
        first, last = np.flatnonzero(d > 0.0)[[0, -1]]
        before = d[first] / (d[first] - d[first - 1])
        after = d[last] / (d[last] - d[last + 1])
        return (last - first + before + after) * self.time_step

    @property
    def restitution(self) -> float:
        return self.speed[-1] / SPEED

    def errors(self) -> np.ndarray:
        """Return relative errors of largest overlap, largest force, duration, and speed after."""
        expected = self.expected
        return np.array(
            [
                self.overlap.max() / expected.overlap - 1.0,
                self.force.max() / expected.force - 1.0,
                self.duration / expected.duration - 1.0,
                self.restitution - 1.0,
            ]
        )


def two_spheres(contact: ContactCoefficients, steps: int, length: float = 1.3) -> list[Seen]:
    """Return an impact at each phase, with `steps` in the duration of an elastic one, for `length` of it."""
    mass = ball_mass() / 2.0
    expected = Impact.of(contact, RADIUS / 2.0, mass, SPEED)
    dt = expected.duration / steps
    half_gaps = [(1.0 + phase) * dt * SPEED / 2.0 for phase in PHASES]
    solver = solve(
        *(
            world(
                grains(
                    [[0.0, 0.0, -RADIUS - gap], [0.0, 0.0, RADIUS + gap]],
                    velocities=[[0.0, 0.0, SPEED / 2.0], [0.0, 0.0, -SPEED / 2.0]],
                ),
                contact,
                dt,
            )
            for gap in half_gaps
        )
    )
    seen = record(solver, int(length * steps) + 3)
    z, v = seen.positions[..., 2], seen.velocities[..., 2]
    return [
        Seen(expected, dt, overlap, mass * np.diff(speed) / dt, speed)
        for overlap, speed in zip(
            (2.0 * RADIUS - z[:, 1::2] + z[:, ::2]).T, (v[:, 1::2] - v[:, ::2]).T, strict=True
        )
    ]


def worst(impacts: list[Seen]) -> np.ndarray:
    return np.abs([impact.errors() for impact in impacts]).max(axis=0)


def test_an_elastic_impact_follows_hertz():
    # The scheme is of second order: (2 pi / 200)^2 / 24 = 4e-5 is a harmonic oscillator's error at 200 steps
    # half a period (measured here: 2e-5 at the most).
    assert (worst(two_spheres(pair(restitution=1.0), 200)) < 4e-5).all()


def test_an_elastic_impact_converges_at_second_order():
    coarse, fine = (worst(two_spheres(pair(restitution=1.0), steps)) for steps in (100, 400))
    # Measured orders: 2.0 (overlap, force, duration) and 2.5 (speed: the force starts as overlap^1.5).
    order = np.log(coarse / fine) / math.log(4.0)
    assert (order > 1.9).all()
    assert (order[:3] < 2.2).all()


def test_the_chosen_restitution_comes_back():
    # The damped Hertz contact maps onto a linear oscillator (Antypov and Elliott, EPL 94 (2011) 50004), whose
    # restitution exp(-pi zeta / sqrt(1 - zeta^2)) is the one that was chosen. The damping takes the speed of
    # half a step before, so the error is of first order: 1.2 % of e = 0.1, 0.7 % of 0.18, 0.2 % of 0.5 at 200
    # steps.
    tolerance = {0.1: 0.015, 0.18: 0.008, 0.3: 0.005, 0.5: 0.002, 0.7: 0.001, 0.9: 2e-4}
    for chosen, relative in tolerance.items():
        for impact in two_spheres(pair(restitution=chosen), 200, length=3.0):
            assert impact.restitution == pytest.approx(chosen, rel=relative)


@pytest.mark.parametrize(("chosen", "comes"), [(0.1, 0.253), (0.5, 0.550)])
def test_damping_that_may_not_attract_returns_a_higher_restitution(chosen, comes):
    # The oscillator leaves when its force, not its overlap, is zero: exp(-2 theta cot theta) with cos theta =
    # zeta.
    theta = math.acos(-math.log(chosen) / math.hypot(math.log(chosen), math.pi))
    expected = math.exp(-2.0 * theta / math.tan(theta))
    assert expected == pytest.approx(comes, abs=5e-4)
    for impact in two_spheres(pair(restitution=chosen, clamp=True), 200, length=3.0):
        # First order in the step, as above; measured: 0.5 % at e = 0.1.
        assert impact.restitution == pytest.approx(expected, rel=0.006)
        assert impact.force.min() >= 0.0


def test_spheres_of_different_size_keep_their_momentum():
    contact, sizes = pair(restitution=0.3, friction=0.5), np.array([1.0, 0.6])
    masses = ball_mass() * sizes**3
    velocities = [[0.0, 0.03, 0.0], [0.0, -0.01, -SPEED]]
    dt = Impact.of(contact, RADIUS / 2.0, masses[1], SPEED).duration / 100.0
    bodies = grains([[0.0, 0.0, 0.0], [0.0, 0.001, 1.605 * RADIUS]], velocities=velocities, sizes=sizes)
    seen = record(solve(world(bodies, contact, dt)), 400).velocities
    assert seen[-1, 0, 2] < 0.0
    # Opposite forces of equal size: rounding only, of 1e-16 a step.
    momentum = np.einsum("g,tgi->ti", masses, seen)
    np.testing.assert_allclose(momentum - momentum[0], 0.0, atol=1e-14 * masses[0])


def slide(restitution: float, friction: float, clamp: bool, angles: np.ndarray):
    """Return kicks and twists, (steps, angles, 3), of spheres thrown on a plane at angles from its normal."""
    contact = pair(restitution, friction, clamp=clamp)
    dt = Impact.of(contact, RADIUS, ball_mass(), SPEED).duration / 400.0
    solver = solve(
        *(
            world(
                grains(
                    [0.0, 0.0, RADIUS + 1.3 * dt * SPEED],
                    velocities=[SPEED * math.tan(angle), 0.0, -SPEED],
                ),
                contact,
                dt,
                walls=(Plane(),),
            )
            for angle in angles
        )
    )
    seen = record(solver, 1200)
    return np.diff(seen.velocities, axis=0), np.diff(seen.spins, axis=0)


@pytest.mark.parametrize(
    ("restitution", "clamp", "comes"),
    [(1.0, False, 1.0), (0.5, True, 0.5502831696)],
)
def test_an_impact_in_full_sliding_is_that_of_rigid_bodies(restitution, clamp, comes):
    friction = 0.2
    # Sliding throughout: tan(angle) > 3.5 mu (1 + e), beyond which friction cannot stop the contact point.
    kicks, twists = slide(restitution, friction, clamp, np.deg2rad([60.0, 75.0, 85.0]))
    impulse = friction * (1.0 + comes) * SPEED
    # 400 steps an impact bring e back to 0.1 % (first order), with e = 1 to 1e-6.
    np.testing.assert_allclose(-kicks[..., 0].sum(axis=0), impulse, rtol=1e-3)
    # A solid sphere spins up by 5/2 of the impulse; the lever is shorter than the radius by half an overlap
    # of 1 %.
    np.testing.assert_allclose(twists[..., 1].sum(axis=0) * RADIUS, 2.5 * impulse, rtol=0.01)


def test_the_tangential_spring_turns_with_the_contact():
    solver = solve(oblique_impact())
    seen = record(solver, 80)
    touching = 2.0 * RADIUS - np.linalg.norm(seen.positions[:, 1] - seen.positions[:, 0], axis=1) > 0.0
    assert touching[40:80].all()
    across = seen.positions[79, 0] - seen.positions[79, 1]
    normal = across / np.linalg.norm(across)
    spring = solver.neighbours.history.numpy()[0, :3]
    assert np.linalg.norm(spring) > 1e-9
    # It is in the plane of the contact at its last step: rounding, while the normal has turned
    # by 1e-3.
    assert abs(spring @ normal) < 1e-12 * np.linalg.norm(spring)


def test_a_contact_that_opened_starts_without_a_spring():
    # A ball that hops on over a plane, and the same from its state in the first flight on: its second impact
    # is the same, whatever the first one left in its spring.
    contact = pair(restitution=1.0, friction=50.0)
    dt = Impact.of(contact, RADIUS, ball_mass(), SPEED).duration / 100.0
    gravity = (0.0, 0.0, -2.0 * SPEED / (200.0 * dt))

    def hop(position, velocity, spin, steps):
        bodies = grains(position, velocities=velocity, spins=spin)
        return record(solve(world(bodies, contact, dt, walls=(Plane(),), gravity=gravity)), steps)

    whole = hop([0.0, 0.0, RADIUS], [3.0 * SPEED, 0.0, -SPEED], [0.0, -20.0, 0.0], 500)
    height = whole.positions[:, 0, 2] - RADIUS
    assert height[170] > 0.0
    assert height[200:400].min() < 0.0
    later = hop(*(getattr(whole, name)[170, 0] for name in ("positions", "velocities", "spins")), 330)
    assert np.abs(later.spins[-1] - later.spins[0]).max() > 1.0
    # The orientations differ, so the spin is rounded otherwise: 330 times 1e-16.
    for name, array in vars(later).items():
        np.testing.assert_allclose(array, getattr(whole, name)[170:], rtol=1e-11, atol=1e-15)
