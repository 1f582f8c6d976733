"""Normal force: Hertz with EDEM's viscous damping."""

from typing import Any

import warp as wp


@wp.func
def hertz_stiffness(modulus: Any, radius: Any, overlap: Any):
    """Return the tangent stiffness S_n = 2 E* sqrt(R* d) [N/m] of a Hertz contact.

    Source: K. L. Johnson, Contact Mechanics (1985), section 4.2.
    """
    return type(overlap)(2.0) * modulus * wp.sqrt(radius * overlap)


@wp.func
def hertz_force(stiffness: Any, overlap: Any):
    """Return the elastic force (4/3) E* sqrt(R*) d^(3/2) [N], from the tangent stiffness at the same overlap.

    Source: K. L. Johnson, Contact Mechanics (1985), section 4.2.
    """
    return type(overlap)(2.0) / type(overlap)(3.0) * stiffness * overlap


@wp.func
def damped(elastic: Any, damping_rate: Any, normal_velocity: Any, clamp_attraction: Any):
    """Return the normal force F - c v_n [N] of an elastic force, with c = 2 sqrt(5/6) |beta| sqrt(S_n m*).

    `normal_velocity` is the separation speed. Near the end of an impact the damping exceeds the spring and
    attracts, which gives the chosen restitution. With `clamp_attraction` the force never attracts, which
    raises the effective restitution (0.18 becomes about 0.31).

    Source: Tsuji, Tanaka and Ishida, Powder Technology 71 (1992) 239-250; EDEM 2.7 Theory Reference Guide.
    """
    force = elastic - damping_rate * normal_velocity
    if clamp_attraction > type(elastic)(0.0):
        force = wp.max(force, type(elastic)(0.0))
    return force


@wp.func
def tsuji_rate(params: Any, contact: Any, stiffness: Any):
    """Return the damping [N s/m] that grows as the root of the stiffness: one restitution at every speed.

    Source: Tsuji, Tanaka and Ishida, Powder Technology 71 (1992) 239-250.
    """
    return params.damping * wp.sqrt(stiffness * contact.mass)


@wp.func
def mass_rate(params: Any, contact: Any, stiffness: Any):
    """Return the damping eta m* [N s/m], the same at every overlap.

    Source: LAMMPS (2022-01-06), src/GRANULAR/pair_granular.cpp, lines 365-366, damping mass_velocity.
    """
    return params.damping * contact.mass


@wp.func
def viscoelastic_rate(params: Any, contact: Any, stiffness: Any):
    """Return the damping eta a m* [N s/m], a = sqrt(R* d); `damping` is that of a = 1 mm.

    Source: LAMMPS (2022-01-06), src/GRANULAR/pair_granular.cpp, lines 367-368, damping viscoelastic.
    """
    area = wp.sqrt(contact.radius * contact.overlap)
    return params.damping * type(area)(1000.0) * area * contact.mass
