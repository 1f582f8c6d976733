"""The contact law: Hertz-Mindlin without slip, with the mechanisms of a build."""

import functools
from typing import Any, NamedTuple

import warp as wp

from dem_warp.laws.conventions import BASE_FORMS, LawForms
from dem_warp.laws.mechanism import Mechanisms, check_forms
from dem_warp.laws.normal import (
    damped,
    hertz_force,
    hertz_stiffness,
    mass_rate,
    tsuji_rate,
    viscoelastic_rate,
)
from dem_warp.laws.rolling import rolling_torque
from dem_warp.laws.rolling_choices import ROLLING
from dem_warp.laws.tangential import (
    advance_displacement,
    coulomb_spring,
    free_spring,
    mindlin_stiffness,
    stretch_of,
    sum_spring,
    unloaded,
)

_DAMPINGS = {"tsuji": tsuji_rate, "mass_velocity": mass_rate, "viscoelastic": viscoelastic_rate}
_SPRINGS = {"spring": coulomb_spring, "spring_free": free_spring, "sum": sum_spring}


def memory_size(mechanisms: Mechanisms, forms: LawForms = BASE_FORMS) -> int:
    """Return the number of values that a contact remembers for its mechanisms, then for its law."""
    own = sum(mechanism.memory_size for mechanism in mechanisms)
    rolling = ROLLING[forms.rolling].memory_size if forms.rolling in ROLLING else 0
    return own + rolling + int(forms.tangential_history.startswith("rescaled"))


def acts_apart(mechanisms: Mechanisms) -> bool:
    """Return True if some mechanism acts on surfaces that do not touch."""
    return any(mechanism.acts_apart for mechanism in mechanisms)


class _Hook(NamedTuple):
    """Device function of a mechanism at a place of the law."""

    call: Any
    memory: int
    """Offset of the mechanism's values in the memory of a contact."""


def _hooks(mechanisms: Mechanisms, name: str) -> list[_Hook]:
    own = [(getattr(m, name), memory_size(mechanisms[:i])) for i, m in enumerate(mechanisms)]
    return [_Hook(*hook) for hook in own if hook[0] is not None]


def _one_hook(mechanisms: Mechanisms, name: str, replaced: str) -> list[_Hook]:
    """Return the hook of the only mechanism, if any, that replaces a part of the law."""
    hooks = _hooks(mechanisms, name)
    if len(hooks) > 1:
        names = [mechanism.name for mechanism in mechanisms if getattr(mechanism, name) is not None]
        raise ValueError(f"mechanisms: at most one may replace {replaced}, got {names}")
    return hooks


def _name(part: str, mechanisms: Mechanisms, forms: LawForms) -> str:
    return "_".join([part, *(mechanism.name for mechanism in mechanisms), *forms.changed])


@functools.cache
def contact_law(mechanisms: Mechanisms, forms: LawForms = BASE_FORMS) -> Any:
    """Return the device function of the law with some mechanisms, in a choice of its forms.

    It takes `params` (ContactParams), `contact` (Contact), the tangential displacement so far [m], and an
    array with the index of the first value that the mechanisms remember of this contact. It returns the force
    on the grain [N], the new tangential displacement [m], the torque [N m] in addition to that of the force,
    and the largest torques [N m] of rolling resistance against the spin of the grain and of its partner. The
    partner gets the opposite force and torque.

    Both dampings use the constant 2 sqrt(5/6) |beta|, each with its own stiffness, as in EDEM, unless
    `params` and the forms say otherwise.
    """
    check_forms(mechanisms, forms)
    attractions, springs = _hooks(mechanisms, "attraction"), _hooks(mechanisms, "spring")
    rate = _DAMPINGS[forms.normal_damping]
    tangential, resistance = _tangential(mechanisms, forms), _resistance(mechanisms, forms)

    @wp.func(name=_name("law", mechanisms, forms))
    def law(params: Any, contact: Any, displacement: Any, memory: Any, first: int):
        attracting = contact.overlap * type(contact.overlap)(0.0)
        for i in range(wp.static(len(attractions))):
            attracting += wp.static(attractions[i].call)(
                params, contact, memory, first + wp.static(attractions[i].memory)
            )
        if wp.static(acts_apart(mechanisms)):
            contact, displacement = without_gap(contact, displacement)
        stiffness = hertz_stiffness(params.modulus, contact.radius, contact.overlap)
        elastic = hertz_force(stiffness, contact.overlap)
        for i in range(wp.static(len(springs))):
            elastic = wp.static(springs[i].call)(
                params, contact, elastic, memory, first + wp.static(springs[i].memory)
            )
        normal_velocity = wp.dot(contact.velocity, contact.normal)
        normal_rate = rate(params, contact, stiffness)
        normal_force = damped(elastic, normal_rate, normal_velocity, params.clamp_attraction)
        velocity = contact.velocity - contact.normal * normal_velocity
        force, displacement = tangential(
            params, contact, displacement, velocity, normal_force, normal_rate, memory, first
        )
        torque, limit, partner_limit = resistance(params, contact, normal_force, elastic, memory, first)
        force = contact.normal * (normal_force - attracting) + force
        return force, displacement, torque, limit, partner_limit

    return law


def _tangential(mechanisms: Mechanisms, forms: LawForms) -> Any:
    """Return the device function of the tangential force [N] and the new displacement [m]."""
    frictions = _hooks(mechanisms, "friction")
    sliders = _one_hook(mechanisms, "slider", "the tangential spring")
    slide, history = _SPRINGS[forms.sliding], forms.tangential_history
    law_memory = memory_size(mechanisms, forms)

    @wp.func(name=_name("tangential", mechanisms, forms))
    def tangential(
        params: Any,
        contact: Any,
        displacement: Any,
        velocity: Any,
        normal_force: Any,
        normal_rate: Any,
        memory: Any,
        first: int,
    ):
        stiffness = mindlin_stiffness(params.shear_modulus, contact.radius, contact.overlap)
        if wp.static(history.startswith("rescaled")):
            displacement = unloaded(contact, displacement, memory, first + wp.static(law_memory - 1))
        if wp.static(history.endswith("force")):
            displacement = stretch_of(displacement, stiffness)
        displacement = advance_displacement(displacement, contact.normal, velocity, contact.time_step)
        load = wp.max(normal_force, type(normal_force)(0.0))
        if wp.static(forms.friction_load == "size"):
            load = wp.abs(normal_force)
        held = wp.length(displacement) * stiffness
        coefficient = params.static_friction
        for i in range(wp.static(len(frictions))):
            coefficient = wp.static(frictions[i].call)(
                params, contact, coefficient, held, load, memory, first + wp.static(frictions[i].memory)
            )
        rate = params.tangential_damping * normal_rate
        if wp.static(forms.normal_damping == "tsuji"):
            rate = params.tangential_damping * params.damping * wp.sqrt(stiffness * contact.mass)
        limit = coefficient * load
        if wp.static(not sliders):
            force, displacement = slide(displacement, stiffness, rate, velocity, limit)
        for i in range(wp.static(len(sliders))):
            at = first + wp.static(sliders[i].memory)
            force, displacement = wp.static(sliders[i].call)(
                params, contact, displacement, stiffness, rate, velocity, limit, memory, at
            )
        if wp.static(history.endswith("force")):
            displacement = displacement * (-stiffness)
        return force, displacement

    return tangential


def _resistance(mechanisms: Mechanisms, forms: LawForms) -> Any:
    """Return the device function of a contact's own torque and of both limits of rolling resistance [N m]."""
    torques, turn = _hooks(mechanisms, "torque"), ROLLING.get(forms.rolling)
    rollings = _one_hook(mechanisms, "rolling", "the rolling resistance")
    roll = turn.torque if turn else None
    own_memory = memory_size(mechanisms)

    @wp.func(name=_name("resistance", mechanisms, forms))
    def resistance(params: Any, contact: Any, normal_force: Any, elastic: Any, memory: Any, first: int):
        zero = type(normal_force)(0.0)
        support = wp.max(normal_force, zero)
        torque = contact.normal * (support * zero)
        for i in range(wp.static(len(torques))):
            torque += wp.static(torques[i].call)(
                params, contact, support, memory, first + wp.static(torques[i].memory)
            )
        limit = zero
        partner_limit = zero
        if wp.static(turn is None):
            limit = rolling_torque(params.rolling_friction, support, contact.lever)
            partner_limit = rolling_torque(params.rolling_friction, support, contact.partner_lever)
            for i in range(wp.static(len(rollings))):
                limit = wp.static(rollings[i].call)(params, limit)
                partner_limit = wp.static(rollings[i].call)(params, partner_limit)
        else:
            load = support
            if wp.static(turn is not None and turn.load == "size"):
                load = wp.abs(normal_force)
            if wp.static(turn is not None and turn.load == "elastic"):
                load = elastic
            torque += roll(params, contact, load, memory, first + wp.static(own_memory))
        return torque, limit, partner_limit

    return resistance


@wp.func
def without_gap(contact: Any, displacement: Any):
    """Return a contact whose separated surfaces are about to touch, for all functions but attractions."""
    zero = type(contact.overlap)(0.0)
    if contact.overlap <= zero:
        contact.overlap = zero
        contact.is_new = True
        displacement = displacement * zero
    return contact, displacement
