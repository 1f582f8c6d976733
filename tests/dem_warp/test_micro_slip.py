"""Micro-slip, against closed forms of Cattaneo, Mindlin and Deresiewicz, on a contact that is led by hand."""

from typing import Any

import numpy as np
import warp as wp

from dem_warp.laws.micro_slip import SPRINGS, MicroSlip, row_force
from dem_warp.types import DOUBLE, device_structs

Contact = device_structs(DOUBLE).Contact

STIFFNESS = 8.0
"""S_t over the contact radius, in units in which the radius R*, and E* or G*, are 1."""


@wp.kernel(enable_backward=False)
def lead(
    # model
    overlaps: wp.array(dtype=wp.float64),
    moves: wp.array(dtype=wp.vec3d),
    limits: wp.array(dtype=wp.float64),
    # state out
    memory_out: wp.array(dtype=wp.float64),
    force_out: wp.array(dtype=wp.vec3d),
):
    contact = Contact()
    contact.normal = wp.vec3d(wp.float64(0.0), wp.float64(0.0), wp.float64(1.0))
    contact.radius = wp.float64(1.0)
    contact.time_step = wp.float64(1.0)
    for step in range(overlaps.shape[0]):
        contact.overlap = overlaps[step]
        contact.is_new = step == 0
        stiffness = wp.float64(8.0) * wp.sqrt(overlaps[step])
        force_out[step] = row_force(contact, stiffness, moves[step], limits[step], memory_out, 0)


def forces(overlaps: Any, places: Any, friction: float = 1.0) -> np.ndarray:
    """Return the tangential force after each step of a contact led through overlaps (n,) and places (n, 2).

    Friction is over a normal force of overlap^(3/2). It begins at the first place without a force.
    """
    overlaps, places = np.asarray(overlaps, dtype=float), np.asarray(places, dtype=float)
    moves = np.zeros((len(overlaps), 3))
    moves[1:, :2] = np.diff(places, axis=0)
    memory = wp.full(MicroSlip.memory_size, np.nan, dtype=wp.float64, device="cpu")
    force = wp.full(len(overlaps), wp.vec3d(np.nan), dtype=wp.vec3d, device="cpu")
    given = [
        wp.array(values, dtype=kind, device="cpu")
        for values, kind in (
            (overlaps, wp.float64),
            (moves, wp.vec3d),
            (friction * overlaps**1.5, wp.float64),
        )
    ]
    wp.launch(lead, 1, inputs=given, outputs=[memory, force], device="cpu")
    return force.numpy()[:, :2]


def along(x: Any) -> np.ndarray:
    return np.column_stack([x, np.zeros_like(x)])


def pressed(steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Return overlaps of a contact that is pressed from a hundredth to 1 without moving, and its places."""
    return np.linspace(0.01, 1.0, steps), np.zeros(steps)


def cattaneo(force: np.ndarray) -> np.ndarray:
    """Return the displacement at a force over the limit, at overlap 1: Johnson (1985), equation 7.42."""
    return 1.5 / STIFFNESS * (1.0 - (1.0 - force) ** (2.0 / 3.0))


def test_a_steady_contact_slips_inwards_back_and_forth_as_theory_has_it():
    # Loaded to 0.9 of the limit, back to its opposite, and forth again: Mindlin and Deresiewicz (1953), with
    # every return twice the first loading at half the change of force.
    turn, steps = 0.9, 400
    up, down = np.linspace(0.0, turn, steps), np.linspace(turn, -turn, steps)
    reach = cattaneo(np.array(turn))
    back = reach - 2.0 * cattaneo(0.5 * (turn - down))
    overlaps, still = pressed(10)
    places = np.concatenate([still, cattaneo(up), back, -back])
    force = -forces(np.concatenate([overlaps, np.ones(3 * steps)]), along(places))[:, 0]
    want = np.concatenate([up, down, -down])
    # Theory has the limit (3/2) (1 - x^2) dx, and the row its mean over the width h of a spring. So a spring
    # that is about to slip bears at most (3/8) h^2 too much, and twice that on the way back. The row has
    # doubled four times since a radius of 0.1, so that five springs are pressed.
    assert SPRINGS * 1.0 / 1.6 == 5.0
    chord = 0.375 / 5.0**2
    np.testing.assert_allclose(force[10 : 10 + steps], up, atol=chord)
    np.testing.assert_allclose(force[10 + steps :], want[steps:], atol=2.0 * chord)
    assert np.abs(force[10:] - want).max() > 0.5 * chord


def test_nothing_slips_while_both_forces_grow_and_fall_together():
    # dT / dN below the friction: T = (2/3) S_t / a of the ratio of the two displacements, times N.
    ratio, half = 0.1, np.geomspace(1e-4, 1.0, 2000)
    overlaps = np.concatenate([half, half[::-1]])
    force = -forces(overlaps, along(ratio * overlaps))[:, 0]
    want = 2.0 / 3.0 * STIFFNESS * ratio * overlaps**1.5
    # On the way back the spring at the rim lets go of its mean force, unlike in theory: up to
    # (3/8) h^2 of the largest force, the width h of a spring being 0.16. A step adds half its change.
    np.testing.assert_allclose(force, want, atol=(0.375 * 0.16**2 + 0.0012) * want.max())


def test_gross_slip_is_coulombs_and_turns_with_the_motion():
    overlaps, still = pressed(10)
    ahead, aside = np.linspace(0.0, 1.0, 100), np.linspace(0.0, 50.0, 5000)
    places = np.vstack([along(still), along(ahead), np.column_stack([np.ones_like(aside), aside])])
    force = forces(np.concatenate([overlaps, np.ones(5100)]), places, friction=0.4)
    np.testing.assert_allclose(force[109], [-0.4, 0.0], atol=1e-12)
    # The second way is hundreds of times as long as a spring is stretched in sliding, 0.4 * 1.5 / 8.
    np.testing.assert_allclose(force[-1], [0.0, -0.4], atol=1e-12)
    assert (np.linalg.norm(force, axis=1) <= 0.4 * (1.0 + 1e-12)).all()


def test_a_contact_forgets_its_force_when_it_opens():
    overlaps = [1.0, 1.0, 0.0, 1.0]
    force = forces(overlaps, along([0.0, 0.05, 0.05, 0.05]))
    assert force[1, 0] < -0.1
    assert not force[2:].any()


def test_no_direction_is_special():
    rng = np.random.default_rng(1)
    overlaps = 1.0 + 0.5 * np.sin(np.arange(300) / 20.0)
    places = np.cumsum(0.02 * rng.normal(size=(300, 2)), axis=0)
    turn = np.array([[0.6, 0.8], [-0.8, 0.6]])
    # Three hundred steps, each rounded by 1e-16 of forces of about 1.
    np.testing.assert_allclose(forces(overlaps, places @ turn), forces(overlaps, places) @ turn, atol=1e-12)
