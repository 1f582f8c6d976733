"""The base contact law, Hertz-Mindlin without slip: what one contact does in one step."""

from typing import Any

import warp as wp

from dem_warp.laws.normal import damped_hertz, hertz_stiffness
from dem_warp.laws.tangential import advance_displacement, coulomb_spring, mindlin_stiffness


@wp.func
def contact_force(
    params: Any,
    normal: Any,
    overlap: Any,
    radius: Any,
    mass: Any,
    velocity: Any,
    displacement: Any,
    time_step: Any,
):
    """Force on a grain [N], the contact's new tangential displacement [m], and the force's normal part [N].

    Parameters
    ----------
    params
        ContactParams of this pair of surfaces.
    normal
        Unit vector from the partner to the grain.
    overlap, radius, mass
        Overlap d [m], effective radius R* [m] and effective mass m* [kg].
    velocity
        Of the grain's surface relative to the partner's, at the contact point [m/s].
    displacement
        Tangential displacement so far [m].
    time_step
        [s]

    Notes
    -----
    Both dampings use the same constant 2 sqrt(5/6) |beta|, each with its own stiffness, as in EDEM.
    """
    stiffness = hertz_stiffness(params.modulus, radius, overlap)
    normal_velocity = wp.dot(velocity, normal)
    normal_force = damped_hertz(
        stiffness,
        overlap,
        params.damping * wp.sqrt(stiffness * mass),
        normal_velocity,
        params.clamp_attraction,
    )
    tangential_velocity = velocity - normal * normal_velocity
    displacement = advance_displacement(displacement, normal, tangential_velocity, time_step)
    tangential_stiffness = mindlin_stiffness(params.shear_modulus, radius, overlap)
    tangential_force, displacement = coulomb_spring(
        displacement,
        tangential_stiffness,
        params.damping * wp.sqrt(tangential_stiffness * mass),
        tangential_velocity,
        params.static_friction * wp.max(normal_force, type(overlap)(0.0)),
    )
    return normal * normal_force + tangential_force, displacement, normal_force
