"""Tangential force: Mindlin without slip, with history, EDEM's damping and the Coulomb limit."""

from typing import Any

import warp as wp


@wp.func
def mindlin_stiffness(shear_modulus: Any, radius: Any, overlap: Any):
    """Tangential stiffness S_t = 8 G* sqrt(R* d) [N/m].

    Source: Mindlin, Journal of Applied Mechanics 16 (1949) 259-268.
    """
    return type(overlap)(8.0) * shear_modulus * wp.sqrt(radius * overlap)


@wp.func
def advance_displacement(displacement: Any, normal: Any, tangential_velocity: Any, time_step: Any):
    """Tangential displacement [m] after a step: turned into the contact's present plane, then moved along."""
    return displacement - normal * wp.dot(displacement, normal) + tangential_velocity * time_step


@wp.func
def limited(force: Any, limit: Any):
    """A force [N], no larger than a limit."""
    size = wp.length(force)
    if size > limit:
        force = force * (limit / size)
    return force


@wp.func
def coulomb_spring(
    displacement: Any, stiffness: Any, damping_rate: Any, tangential_velocity: Any, limit: Any
):
    """Tangential force [N] and displacement [m] under the Coulomb limit |F_t| <= mu F_n.

    The spring slides when it alone passes the limit; then its displacement shrinks to what the limit holds
    and the damping is left out. A spring within the limit is damped, and the sum is limited again.

    Source: Cundall and Strack, Geotechnique 29 (1979) 47-65; EDEM 2.7 Theory Reference Guide.
    """
    force = displacement * (-stiffness)
    size = wp.length(force)
    if size > limit:
        keep = limit / size
        displacement = displacement * keep
        force = force * keep
    else:
        force = force - tangential_velocity * damping_rate
        # written out: calling `limited` makes a CPU's step 5 % longer
        size = wp.length(force)
        if size > limit:
            force = force * (limit / size)
    return force, displacement
