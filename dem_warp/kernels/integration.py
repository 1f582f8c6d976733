"""Rotation of one rigid grain over one step."""

import functools
from types import SimpleNamespace

import warp as wp

from dem_warp.laws.rolling import resist_spin
from dem_warp.types import Precision


@functools.cache
def integration_functions(precision: Precision) -> SimpleNamespace:
    """Return `turn` and `rounded` in one precision."""
    real, vec3, quat = precision.real, precision.vec3, precision.quat

    @wp.func
    def rounded(q: wp.quatd) -> quat:
        return quat(real(q[0]), real(q[1]), real(q[2]), real(q[3]))

    @wp.func
    def inverse_root(x: wp.float64) -> wp.float64:
        """Return 1 / sqrt(x) near 1; in mixed precision a float32 root and a Newton step, exact to 1e-14."""
        if wp.static(precision.is_fixed_point):
            guess = wp.float64(1.0 / wp.sqrt(float(x)))
            return guess * (wp.float64(1.5) - wp.float64(0.5) * x * guess * guess)
        return wp.float64(1.0) / wp.sqrt(x)

    @wp.func
    def turn(
        orientation: wp.quatd,
        spin: vec3,
        torque: vec3,
        inertia: vec3,
        rolling: real,
        time_step: real,
        holds: real,
    ):
        """Return orientation and spin [rad/s] after a step under `torque` and rolling resistance [N m].

        The torque changes the angular momentum, which is then constant while the body turns about the spin at
        half the step (an explicit midpoint rule): without torque, the momentum is conserved to rounding and
        the energy to second order. The turn is the Cayley map of the midpoint spin, a unit quaternion.
        """
        q = rounded(orientation)
        body_spin = wp.quat_rotate_inv(q, spin)
        momentum = wp.cw_mul(inertia, body_spin) + wp.quat_rotate_inv(q, torque) * time_step
        body_spin = resist_spin(wp.cw_div(momentum, inertia), inertia, rolling, time_step, holds)
        momentum = wp.cw_mul(inertia, body_spin)
        half = real(0.5) * time_step
        midpoint = wp.cw_div(momentum - wp.cross(body_spin, momentum) * half, inertia)
        d = midpoint * half
        turned = orientation * wp.quatd(wp.float64(d[0]), wp.float64(d[1]), wp.float64(d[2]), wp.float64(1.0))
        turned = turned * inverse_root(wp.dot(turned, turned))
        p = rounded(turned)
        momentum = wp.quat_rotate(q, momentum)
        return turned, wp.quat_rotate(p, wp.cw_div(wp.quat_rotate_inv(p, momentum), inertia))

    return SimpleNamespace(turn=turn, rounded=rounded)
