"""Elastic-plastic rolling resistance: a rotational spring, a slider and a dashpot."""

from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import warp as wp

from dem_warp.laws.mechanism import Mechanism
from dem_warp.laws.normal import hertz_stiffness
from dem_warp.laws.tangential import advance_displacement, coulomb_spring
from dem_warp.parameters import Parameter


@wp.func
def spring_torque(params: Any, contact: Any, support: Any, memory: Any, at: int):
    """Return the torque [N m] against the roll; remember the angle [rad] of the spring."""
    angle = type(contact.normal)(memory[at], memory[at + 1], memory[at + 2])
    if contact.is_new:
        angle = type(contact.normal)()
    roll = contact.spin - contact.normal * wp.dot(contact.spin, contact.normal)
    angle = advance_displacement(angle, contact.normal, roll, contact.time_step)
    arm = params.rolling_friction * contact.radius
    normal_stiffness = hertz_stiffness(params.modulus, contact.radius, contact.overlap)
    stiffness = params.rolling_stiffness * normal_stiffness * arm * arm
    inertia = type(contact.overlap)(1.4) / contact.mobility
    # two roots, as the product may be too small for float32
    dashpot = type(contact.overlap)(2.0) * params.rolling_damping * wp.sqrt(inertia) * wp.sqrt(stiffness)
    torque, angle = coulomb_spring(angle, stiffness, dashpot, roll, arm * support)
    for i in range(3):
        memory[at + i] = angle[i]
    return torque


@wp.func
def limit_without_spring(params: Any, limit: Any):
    """Return the limit of the constant torque [N m]: 0 where the spring replaces it."""
    if params.rolling_stiffness > type(limit)(0.0):
        limit = type(limit)(0.0)
    return limit


@dataclass(frozen=True, kw_only=True)
class ElasticPlasticRolling(Mechanism):
    """Elastic-plastic spring-dashpot rolling resistance, in place of the constant directional torque.

    A grain on a slope below atan(mu_r) stays at rest, and two grains get opposite torques of equal size.

    Notes
    -----
    With the relative roll theta [rad], the part of the relative rotation in the contact's tangent plane since
    the contact was made:

        M = -k_r theta - C_r dtheta/dt  while  |k_r theta| <= mu_r R* F_n, and |M| at most that;
        M = -mu_r R* F_n theta / |theta|  beyond, where theta slides back to the limit.

    C_r = 2 eta_r sqrt(I_r k_r), with 1 / I_r the sum of 1 / (7/5 m l^2) over the two bodies, l from the
    centre of the grain to the contact: exact for solid spheres.

    Source: Ai, Chen, Rotter and Ooi, Powder Technology 206 (2011) 269-282, model C with f = 0 (no dashpot
    beyond the limit), except that here the sum of spring and dashpot does not pass the limit.
    """

    rolling_stiffness: Annotated[float, Parameter("1", at_least=0.0)] = 0.0
    """Factor c in k_r = c S_n (mu_r R*)^2, with the normal stiffness S_n = 2 E* sqrt(R* d) and the rolling
    friction mu_r of the pair; the source recommends 2.25."""
    rolling_damping: Annotated[float, Parameter("1", at_least=0.0)] = 0.0
    """Damping ratio eta_r of the rolling vibration."""

    name: ClassVar[str] = "elastic_plastic_rolling"
    strength: ClassVar[str] = "rolling_stiffness"
    memory_size: ClassVar[int] = 3
    torque: ClassVar[Any] = spring_torque
    rolling: ClassVar[Any] = limit_without_spring
