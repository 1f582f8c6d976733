"""Laws of rolling resistance that are torques of a contact; `conventions.Rolling` names them.

Each acts on the relative rotation of the two bodies, except EDEM's RVD (mean of their spins) and DEM-Engine's
(sliding velocity of the spins). The other laws limit a grain's own spin (`rolling.resist_spin`).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import warp as wp

from dem_warp.laws.elastic_plastic_rolling import spring_torque
from dem_warp.laws.tangential import (
    advance_displacement,
    coulomb_spring,
    limited,
    mindlin_stiffness,
    sum_spring,
)

STEP_SHARE = wp.constant(0.05)
"""Stiffness of the holding spring of `relative_constant`, over inertia / step^2: a grain in a pile has a
dozen contacts or more, and all together must stay below 4."""

DASHPOT_SHARE = wp.constant(0.2)
"""Dashpot of that spring over inertia / step: a damping ratio of 0.45."""

SOLID_SPHERE = wp.constant(2.5)
"""m R^2 / I of a solid sphere."""

UNLIMITED = wp.constant(1.0e30)
"""Limit above any torque [N m]."""

EXACT_RATIO = wp.constant(1.8257418583505538)
"""Constant 2 sqrt(5/6) of the damping over |beta|."""


@wp.func
def roll_of(contact: Any):
    """Return the part of the relative rotation [rad/s] in the contact's plane."""
    return contact.spin - contact.normal * wp.dot(contact.spin, contact.normal)


@wp.func
def recalled(contact: Any, memory: Any, at: int):
    """Return three remembered values as a vector, zero in a new contact."""
    value = type(contact.normal)(memory[at], memory[at + 1], memory[at + 2])
    if contact.is_new:
        value = type(contact.normal)()
    return value


@wp.func
def wound_torque(contact: Any, torque: Any, stiffness: Any, limit: Any, memory: Any, at: int):
    """Advance the remembered torque [N m] of a spring without dashpot, limited; remember and return it."""
    torque = limited(torque - roll_of(contact) * (stiffness * contact.time_step), limit)
    for i in range(3):
        memory[at + i] = torque[i]
    return torque


@wp.func
def constant_torque(params: Any, contact: Any, load: Any, memory: Any, at: int):
    """Return the torque mu_r R* F_n [N m] against the roll; at rest a spring holds the grain.

    The spring is the stiffest that the step allows, damped. The inertia is that of solid spheres.

    Source: model A of Ai et al., Powder Technology 206 (2011) 269-282, which does not define rest.
    """
    one = type(load)(1.0)
    roll = roll_of(contact)
    angle = advance_displacement(recalled(contact, memory, at), contact.normal, roll, contact.time_step)
    rate = one / (type(load)(SOLID_SPHERE) * contact.mobility * contact.time_step)
    stiffness = type(load)(STEP_SHARE) * rate / contact.time_step
    limit = params.rolling_friction * contact.radius * load
    torque, angle = coulomb_spring(angle, stiffness, type(load)(DASHPOT_SHARE) * rate, roll, limit)
    for i in range(3):
        memory[at + i] = angle[i]
    return torque


@wp.func
def rvd_torque(params: Any, contact: Any, load: Any, memory: Any, at: int):
    """Return the torque mu_r R* F_n [N m] against the mean spin in the contact's plane, the same on both.

    On a wall it is the grain's own spin. It acts for whole steps.

    Source: Altair EDEM, help, RVD Rolling Friction Model, as printed but for the sign.
    """
    spin = contact.rolled
    if wp.length(contact.partner_lever) > type(load)(0.0):
        spin = spin - type(load)(0.5) * contact.spin
    spin = spin - contact.normal * wp.dot(spin, contact.normal)
    speed = wp.length(spin)
    torque = spin * type(load)(0.0)
    if speed > type(load)(0.0):
        torque = spin * (-params.rolling_friction * contact.radius * load / speed)
    return torque


@wp.func
def cdt_torque(params: Any, contact: Any, load: Any, memory: Any, at: int):
    """Return the torque mu_r R* F_n [N m] against the relative rotation, less its normal part.

    F_n is the elastic force. It reverses a slow roll each step, so that a grain at rest creeps.

    Source: LIGGGHTS-PUBLIC 3.8.0, src/rolling_model_cdt.h, lines 89-162.
    """
    speed = wp.length(contact.spin)
    torque = contact.spin * type(speed)(0.0)
    if speed > type(speed)(0.0):
        torque = roll_of(contact) * (-params.rolling_friction * contact.radius * load / speed)
    return torque


@wp.func
def epsd2_torque(params: Any, contact: Any, load: Any, memory: Any, at: int):
    """Return the torque [N m] of a spring S_t R*^2 without dashpot, at most mu_r R* |F_n|.

    The remembered torque does not turn with the contact.

    Source: LIGGGHTS-PUBLIC 3.8.0, src/rolling_model_epsd2.h, lines 161-226.
    """
    stiffness = mindlin_stiffness(params.shear_modulus, contact.radius, contact.overlap)
    stiffness = stiffness * contact.radius * contact.radius
    limit = params.rolling_friction * contact.radius * load
    return wound_torque(contact, recalled(contact, memory, at), stiffness, limit, memory, at)


@wp.func
def rocky_torque(params: Any, contact: Any, load: Any, memory: Any, at: int):
    """Return the torque [N m] of a spring S_t R_r^2 without dashpot, at most mu_r R_r F_n.

    R_r is the reduced distance of the contact from the two centres of mass, 1/R_r = 1/l_i + 1/l_j.

    Source: Ansys Rocky 2024 R2, DEM Technical Manual, 2.3.2, type C (type 3 before): linear spring rolling
    limit; C. M. Wensrich and A. Katterfeld, Powder Technology 217 (2012) 409-417.
    """
    lever = wp.length(contact.lever)
    other = wp.length(contact.partner_lever)
    if other > type(lever)(0.0):
        lever = lever * other / (lever + other)
    stiffness = mindlin_stiffness(params.shear_modulus, contact.radius, contact.overlap) * lever * lever
    torque = recalled(contact, memory, at)
    torque = torque - contact.normal * wp.dot(torque, contact.normal)
    return wound_torque(contact, torque, stiffness, params.rolling_friction * lever * load, memory, at)


@wp.func
def yade_torque(params: Any, contact: Any, load: Any, memory: Any, at: int):
    """Return the torque [N m] of a spring of constant stiffness [N m/rad], at most mu_r R* F_n.

    Without normal force (after a clamped impact) there is no limit: the source has `if (MomentMax > 0)`.

    Source: Yade, pkg/dem/HertzMindlin.cpp, Law2_ScGeom_MindlinPhys_Mindlin::go, "MOMENT CONTACT LAW" (krot;
    eta, the limit over the mean radius and the normal force).
    """
    torque = recalled(contact, memory, at)
    torque = torque - contact.normal * wp.dot(torque, contact.normal)
    limit = params.rolling_friction * contact.radius * load
    if limit <= type(limit)(0.0):
        limit = type(limit)(UNLIMITED)
    return wound_torque(contact, torque, params.rolling_stiffness, limit, memory, at)


@wp.func
def sds_torque(params: Any, contact: Any, load: Any, memory: Any, at: int):
    """Return the torque [N m] of a spring k and dashpot gamma at the lever R*, at most mu_r R* |F_n|.

    Source: LAMMPS (2022-01-06), src/GRANULAR/pair_granular.cpp, lines 550-617; S. Luding, Granular Matter 10
    (2008) 235-246.
    """
    roll = roll_of(contact)
    angle = advance_displacement(recalled(contact, memory, at), contact.normal, roll, contact.time_step)
    square = contact.radius * contact.radius
    limit = params.rolling_friction * contact.radius * load
    torque, angle = sum_spring(
        angle, params.rolling_stiffness * square, params.rolling_damping * square, roll, limit
    )
    for i in range(3):
        memory[at + i] = angle[i]
    return torque


@wp.func
def deme_couple(params: Any, contact: Any, load: Any, memory: Any, at: int):
    """Return a force mu_r |F_n| [N] that only turns, each grain at its own lever, against the spins' sliding.

    It begins when the contact is older than an impact. The duration is the source's, in SI units, which
    neglects that the stiffness grows with the root of the overlap.

    Source: DEM-Engine 3.0.19, kernel/DEMCustomizablePolicies/FullHertzianForceModel.cu, "Rolling resistance
    part"; the torque, ForceInKernelReductionStrat.cu.
    """
    age = memory[at]
    if contact.is_new:
        age = type(load)(0.0)
    age = age + contact.time_step
    memory[at] = age
    couple = contact.rolled * type(load)(0.0)
    speed = wp.length(contact.rolled)
    # R_eff is the square of the contact radius over the overlap, 2 R* on that of the overlap circle
    stiffness = type(load)(4.0 / 3.0) * params.modulus * wp.sqrt(contact.radius)
    ratio = params.damping / type(load)(EXACT_RATIO) * type(load)(1.118033988749895)
    least_age = type(load)(0.0)
    if ratio < type(load)(1.0):
        rest = stiffness * (type(load)(1.0) - ratio * ratio)
        least_age = type(load)(wp.pi) * wp.sqrt(contact.mass / rest)
    if age > least_age and speed > type(load)(1.0e-12):
        couple = contact.rolled * (-params.rolling_friction * load / speed)
    return couple


@dataclass(frozen=True)
class RollingChoice:
    """Rolling resistance that is a torque of the contact."""

    torque: Any
    """Device function of ContactParams, Contact, load [N], memory and index in it. It returns the torque
    [N m] on the grain, or the force [N] if each grain turns at its own lever."""
    load: str = "push"
    """Normal force where it pushes, its absolute value (`size`), or its `elastic` part."""
    memory_size: int = 0
    """Values remembered of a contact."""


ROLLING: Mapping[str, RollingChoice] = {
    "edem_rvd": RollingChoice(rvd_torque),
    "relative_constant": RollingChoice(constant_torque, memory_size=3),
    "cdt": RollingChoice(cdt_torque, "elastic"),
    "elastic_plastic": RollingChoice(spring_torque, memory_size=3),
    "epsd2": RollingChoice(epsd2_torque, "size", 3),
    "sds": RollingChoice(sds_torque, "size", 3),
    "rocky_3": RollingChoice(rocky_torque, memory_size=3),
    "yade": RollingChoice(yade_torque, "size", 3),
    "deme": RollingChoice(deme_couple, "size", 1),
}
"""Rolling laws that are torques of a contact, by name; the others limit a grain's own spin."""
