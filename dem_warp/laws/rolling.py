"""Rolling resistance: the directional constant torque ("standard rolling friction"), as a limiter."""

from typing import Any

import warp as wp


@wp.func
def rolling_torque(rolling_friction: Any, support: Any, lever: Any):
    """Largest torque mu_r F_n R_i [N m] that a contact sets against a spin, F_n being what it supports.

    Source: Zhou et al., Physica A 269 (1999) 536-553; model A of Ai et al., Powder Technology 206 (2011) 269.
    """
    return rolling_friction * support * wp.length(lever)


@wp.func
def resist_spin(spin: Any, inertia: Any, torque: Any, time_step: Any, holds: Any):
    """Body-frame spin [rad/s] after `torque` [N m] acted against it for a step: at most it stops.

    Where `holds` is 0 instead of 1, the torque acts for the whole step: it reverses a slow spin each step, so
    that a grain that ought to stick creeps. Codes that take the formula at its word do so.
    """
    speed = wp.length(spin)
    if torque > type(torque)(0.0) and speed > type(torque)(0.0):
        loss = wp.cw_div(spin, inertia) * (torque * time_step / speed)
        if holds * wp.dot(loss, spin) >= speed * speed:
            spin = spin * type(torque)(0.0)
        else:
            spin = spin - loss
    return spin
