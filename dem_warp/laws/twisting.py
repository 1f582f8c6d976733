"""Twisting resistance: a spring and a slider against the spin about the contact normal."""

from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import warp as wp

from dem_warp.laws.mechanism import Mechanism
from dem_warp.laws.tangential import coulomb_spring, mindlin_stiffness
from dem_warp.parameters import Parameter


@wp.func
def twist_torque(params: Any, contact: Any, support: Any, memory: Any, at: int):
    """Return the torque [N m] against the twist; remember the angle [rad] of the spring."""
    overlap = contact.overlap
    angle = memory[at]
    if contact.is_new:
        angle = type(overlap)(0.0)
    spin = contact.normal * wp.dot(contact.spin, contact.normal)
    twist = contact.normal * angle + spin * contact.time_step
    patch = params.twisting_radius * wp.sqrt(contact.radius * overlap)
    half_square = type(overlap)(0.5) * patch * patch
    stiffness = mindlin_stiffness(params.shear_modulus, contact.radius, overlap)
    dashpot = params.damping * wp.sqrt(stiffness * contact.mass)
    limit = type(overlap)(2.0) / type(overlap)(3.0) * patch * params.static_friction * support
    torque, twist = coulomb_spring(twist, half_square * stiffness, half_square * dashpot, spin, limit)
    memory[at] = wp.dot(twist, contact.normal)
    return torque


@dataclass(frozen=True, kw_only=True)
class Twisting(Mechanism):
    """Resistance of a contact to twisting, by the friction of its area.

    Notes
    -----
    With b = twisting_radius a and the twist psi [rad], the relative rotation about the normal since the
    contact was made:

        M = -(b^2 / 2) (S_t psi + c_t dpsi/dt),  |M| <= (2/3) b mu F_n,

    where psi slides back to the limit. S_t and c_t are the tangential stiffness and damping of the base law.
    The limit is that of a uniform pressure; Hertz's gives 3 pi / 16 in place of 2/3. Sliding and twisting
    have separate limits.

    Source: J. S. Marshall, Journal of Computational Physics 228 (2009) 1541-1561; as a spring
    and slider also S. Luding, Granular Matter 10 (2008) 235-246.
    """

    twisting_radius: Annotated[float, Parameter("1", at_least=0.0)] = 0.0
    """Radius of the resisting area over that of the Hertz contact, a = sqrt(R* d): 1 for smooth spheres,
    more where a sphere represents a flatter surface."""

    name: ClassVar[str] = "twisting"
    strength: ClassVar[str] = "twisting_radius"
    memory_size: ClassVar[int] = 1
    torque: ClassVar[Any] = twist_torque
