"""The hysteretic normal spring, against closed forms."""

import math

import numpy as np
import pytest
from worlds import GRAVITY, RADIUS, TIME_STEP, Impact, ball_mass, downhill, grains, pair, record, solve, world

from dem_warp.laws.hysteretic_spring import HystereticSpring
from dem_warp.model import ContactCoefficients
from dem_warp.walls import Motion, Plane


def dented(plasticity: float, restitution: float = 1.0) -> ContactCoefficients:
    return pair(restitution=restitution, mechanisms=(HystereticSpring(plasticity=plasticity),))


def hertz(contact: ContactCoefficients) -> float:
    return 4.0 / 3.0 * contact.modulus * math.sqrt(RADIUS)


def branch(contact: ContactCoefficients, plasticity: float, overlap: np.ndarray, deepest: np.ndarray):
    """Return the law's force [N] at overlaps on the branch that leads to the deepest one."""
    dent = plasticity * deepest
    part = np.clip((overlap - dent) / (deepest - dent), 0.0, None)
    return hertz(contact) * deepest**1.5 * part**1.5


@pytest.mark.parametrize("plasticity", [0.75])
def test_an_impact_gives_the_same_part_back_at_any_speed_and_never_attracts(plasticity):
    contact, speeds = dented(plasticity), (0.02, 0.2, 2.0)
    setups = []
    for speed in speeds:
        step = Impact.of(contact, RADIUS, ball_mass(), speed).duration / 1000.0
        bodies = grains([0.0, 0.0, RADIUS + 0.5 * step * speed], velocities=[0.0, 0.0, -speed])
        setups.append(world(bodies, contact, step, walls=(Plane(),)))
    seen = record(solve(*setups), 1100).velocities[:, :, 2]
    # Second order in the step, of which the steeper branch has 500 or more; measured: 3e-6.
    np.testing.assert_allclose(seen[-1] / speeds, math.sqrt(1.0 - plasticity), rtol=1e-5)
    assert (np.diff(seen, axis=0) >= 0.0).all()


def test_a_dent_reloads_along_its_unloading_branch_and_grows_beyond():
    plasticity = 0.4
    contact = dented(plasticity)
    # Let go where it just touches, the ball makes its dent, and swings on in it without loss.
    bodies = grains([0.0, 0.0, RADIUS])
    solver = solve(world(bodies, contact, TIME_STEP, walls=(Plane(),), gravity=downhill(0.0)))
    first = record(solver, 400)
    # A jerk of the plane makes it deeper.
    lift = 0.02
    solver.move_wall(0, 0, Motion(velocity=(0.0, 0.0, lift)))
    second = record(solver, 24)
    raised = lift * TIME_STEP * np.arange(24)
    overlap = np.concatenate(
        [RADIUS - first.positions[:-1, 0, 2], RADIUS - (second.positions[:-1, 0, 2] - raised)]
    )
    speeds = [seen.velocities[:, 0, 2] for seen in (first, second)]
    force = ball_mass() * (np.concatenate([np.diff(speed) for speed in speeds]) / TIME_STEP + GRAVITY)
    deepest = np.maximum.accumulate(overlap)
    overlap, force, deepest = overlap[1:], force[1:], deepest[1:]  # it just touches in the first
    assert (overlap > 0.0).all()
    assert (np.diff(overlap) > 0.0)[200:399].sum() > 50
    weight = ball_mass() * GRAVITY
    # The work of the weight down to the deepest point is that of Hertz's spring. Two steps may lie on either
    # side of it, by (pi / 60)^2 / 8 = 3e-4 of it.
    assert deepest[398] == pytest.approx((2.5 * weight / hertz(contact)) ** (2.0 / 3.0), rel=1e-3)
    assert deepest[-1] > 1.5 * deepest[398]
    # The force is taken from velocities, rounded to 1e-16 m/s, over a step.
    closed = branch(contact, plasticity, overlap, deepest)
    np.testing.assert_allclose(force, closed, rtol=0.0, atol=1e-12 * weight)
