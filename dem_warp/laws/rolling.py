"""Rolling resistance: the directional constant torque ("standard rolling friction"), as a limiter."""

from typing import Any

import warp as wp


@wp.func
def rolling_torque(rolling_friction: Any, support: Any, lever: Any):
    """Return the largest torque mu_r F_n R_i [N m] of a contact against a spin.

    Source: Zhou et al., Physica A 269 (1999) 536-553; model A of Ai et al., Powder Technology 206 (2011) 269.
    """
    return rolling_friction * support * wp.length(lever)


@wp.func
def resist_spin(spin: Any, inertia: Any, torque: Any, time_step: Any, holds: Any):
    """Return the body-frame spin [rad/s] after `torque` [N m] acted against it for a step, at most to rest.

    With `holds` 0 instead of 1 the torque acts for the whole step, as in some codes: it reverses a slow spin
    each step, so that a grain at rest creeps.
    """
    zero = type(torque)(0.0)
    speed = wp.length(spin)
    loss = wp.cw_div(spin, inertia) * (torque * time_step / speed)
    acts = torque > zero and speed > zero
    stops = holds * wp.dot(loss, spin) >= speed * speed
    for i in range(3):  # without a branch, so that a CPU turns several grains at once
        spin[i] = wp.where(acts, wp.where(stops, spin[i] * zero, spin[i] - loss[i]), spin[i])
    return spin
