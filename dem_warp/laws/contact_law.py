"""The contact law: Hertz-Mindlin without slip, with the mechanisms of a build put in at their places."""

import functools
from typing import Any

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
    """Values that a contact remembers for its mechanisms, and after those for its law."""
    own = sum(mechanism.memory_size for mechanism in mechanisms)
    rolling = ROLLING[forms.rolling].memory_size if forms.rolling in ROLLING else 0
    return own + rolling + int(forms.tangential_history.startswith("rescaled"))


def acts_apart(mechanisms: Mechanisms) -> bool:
    """Tell whether some mechanism acts on surfaces that do not touch."""
    return any(mechanism.acts_apart for mechanism in mechanisms)


@functools.cache
def contact_law(mechanisms: Mechanisms, forms: LawForms = BASE_FORMS) -> Any:
    """Device function of the law with some mechanisms, in a choice of its forms.

    It takes `params` (ContactParams), `contact` (Contact), the tangential displacement so far [m], and an
    array and the index in it at which the mechanisms' memory of this contact begins. It gives the force on
    the grain [N], the new tangential displacement [m], the torque [N m] beside that of the force, and the
    largest torques [N m] that rolling resistance may set against the spin of the grain and of its partner.
    Force and torque on the partner are the opposite ones.

    Both dampings use the same constant 2 sqrt(5/6) |beta|, each with its own stiffness, as in EDEM, but for
    what `params` and the forms say otherwise.

    Raises
    ------
    ValueError
        If several mechanisms stand in place of the rolling resistance, or of the tangential spring, or one
        stands where the forms have another law than the base's.
    """
    check_forms(mechanisms, forms)
    spring, friction, slider = _spring(mechanisms), _friction(mechanisms), _slider(mechanisms, forms)
    attraction, torque = _attraction(mechanisms), _torque(mechanisms)
    rolling = _rolling(mechanisms)
    rate, history, turn = (
        _DAMPINGS[forms.normal_damping],
        forms.tangential_history,
        ROLLING.get(forms.rolling),
    )
    roll = turn.torque if turn else _no_torque
    own_memory, law_memory = memory_size(mechanisms), memory_size(mechanisms, forms)

    @wp.func(name=_name("law", mechanisms, forms))
    def law(params: Any, contact: Any, displacement: Any, memory: Any, first: int):
        attracting = attraction(params, contact, memory, first)
        if wp.static(acts_apart(mechanisms)):
            contact, displacement = without_gap(contact, displacement)
        overlap = contact.overlap
        zero = type(overlap)(0.0)
        stiffness = hertz_stiffness(params.modulus, contact.radius, overlap)
        elastic = spring(params, contact, hertz_force(stiffness, overlap), memory, first)
        normal_velocity = wp.dot(contact.velocity, contact.normal)
        normal_rate = rate(params, contact, stiffness)
        normal_force = damped(elastic, normal_rate, normal_velocity, params.clamp_attraction)
        support = wp.max(normal_force, zero)
        tangential_velocity = contact.velocity - contact.normal * normal_velocity
        tangential_stiffness = mindlin_stiffness(params.shear_modulus, contact.radius, overlap)
        if wp.static(history.startswith("rescaled")):
            displacement = unloaded(contact, displacement, memory, first + wp.static(law_memory - 1))
        if wp.static(history.endswith("force")):
            displacement = stretch_of(displacement, tangential_stiffness)
        displacement = advance_displacement(
            displacement, contact.normal, tangential_velocity, contact.time_step
        )
        load = support
        if wp.static(forms.friction_load == "size"):
            load = wp.abs(normal_force)
        held = wp.length(displacement) * tangential_stiffness
        coefficient = friction(params, contact, params.static_friction, held, load, memory, first)
        tangential_rate = params.tangential_damping * normal_rate
        if wp.static(forms.normal_damping == "tsuji"):
            tangential_rate = (
                params.tangential_damping * params.damping * wp.sqrt(tangential_stiffness * contact.mass)
            )
        tangential_force, displacement = slider(
            params,
            contact,
            displacement,
            tangential_stiffness,
            tangential_rate,
            tangential_velocity,
            coefficient * load,
            memory,
            first,
        )
        if wp.static(history.endswith("force")):
            displacement = displacement * (-tangential_stiffness)
        own_torque = torque(params, contact, support, memory, first)
        limit = zero
        partner_limit = zero
        if wp.static(turn is None):
            limit = rolling(params, rolling_torque(params.rolling_friction, support, contact.lever))
            partner_torque = rolling_torque(params.rolling_friction, support, contact.partner_lever)
            partner_limit = rolling(params, partner_torque)
        else:
            rolling_load = support
            if wp.static(turn is not None and turn.load == "size"):
                rolling_load = wp.abs(normal_force)
            if wp.static(turn is not None and turn.load == "elastic"):
                rolling_load = elastic
            own_torque += roll(params, contact, rolling_load, memory, first + wp.static(own_memory))
        force = contact.normal * (normal_force - attracting)
        return force + tangential_force, displacement, own_torque, limit, partner_limit

    return law


@wp.func
def without_gap(contact: Any, displacement: Any):
    """A contact for all but attractions: while the surfaces stand apart, it is about to begin."""
    zero = type(contact.overlap)(0.0)
    if contact.overlap <= zero:
        contact.overlap = zero
        contact.is_new = True
        displacement = displacement * zero
    return contact, displacement


def _places(mechanisms: Mechanisms, hook: str) -> list[tuple[Any, int, str]]:
    """Each device function at a place of the law, where its memory begins, and a name up to it."""
    found = []
    for i, mechanism in enumerate(mechanisms):
        function = getattr(mechanism, hook)
        if function is not None:
            found.append((function, memory_size(mechanisms[:i]), _name(hook, mechanisms[: i + 1])))
    return found


def _name(hook: str, mechanisms: Mechanisms, forms: LawForms = BASE_FORMS) -> str:
    return "_".join([hook, *(mechanism.name for mechanism in mechanisms), *forms.changed])


@wp.func
def _no_attraction(params: Any, contact: Any, memory: Any, first: int):
    return contact.overlap * type(contact.overlap)(0.0)


@wp.func
def _no_torque(params: Any, contact: Any, support: Any, memory: Any, first: int):
    return contact.normal * (support * type(support)(0.0))


@wp.func
def _same_elastic(params: Any, contact: Any, elastic: Any, memory: Any, first: int):
    return elastic


@wp.func
def _same_limit(params: Any, limit: Any):
    return limit


@wp.func
def _same_coefficient(
    params: Any, contact: Any, coefficient: Any, spring: Any, support: Any, memory: Any, first: int
):
    return coefficient


def _one_spring(forms: LawForms) -> Any:
    spring = _SPRINGS[forms.sliding]

    @wp.func(name=_name("one_spring", (), forms))
    def one_spring(
        params: Any,
        contact: Any,
        displacement: Any,
        stiffness: Any,
        damping_rate: Any,
        velocity: Any,
        limit: Any,
        memory: Any,
        first: int,
    ):
        return spring(displacement, stiffness, damping_rate, velocity, limit)

    return one_spring


def _attraction(mechanisms: Mechanisms) -> Any:
    total = _no_attraction
    for own, offset, name in _places(mechanisms, "attraction"):
        total = _plus_attraction(total, own, offset, name)
    return total


def _plus_attraction(before: Any, own: Any, offset: int, name: str) -> Any:
    @wp.func(name=name)
    def attraction(params: Any, contact: Any, memory: Any, first: int):
        at = first + wp.static(offset)
        return before(params, contact, memory, first) + own(params, contact, memory, at)

    return attraction


def _torque(mechanisms: Mechanisms) -> Any:
    total = _no_torque
    for own, offset, name in _places(mechanisms, "torque"):
        total = _plus_torque(total, own, offset, name)
    return total


def _plus_torque(before: Any, own: Any, offset: int, name: str) -> Any:
    @wp.func(name=name)
    def torque(params: Any, contact: Any, support: Any, memory: Any, first: int):
        at = first + wp.static(offset)
        return before(params, contact, support, memory, first) + own(params, contact, support, memory, at)

    return torque


def _rolling(mechanisms: Mechanisms) -> Any:
    _require_one(mechanisms, "rolling", "law of rolling resistance")
    return next((m.rolling for m in mechanisms if m.rolling is not None), _same_limit)


def _require_one(mechanisms: Mechanisms, hook: str, what: str) -> None:
    names = [mechanism.name for mechanism in mechanisms if getattr(mechanism, hook) is not None]
    if len(names) > 1:
        raise ValueError(f"mechanisms: at most one {what}, got {names}")


def _slider(mechanisms: Mechanisms, forms: LawForms) -> Any:
    _require_one(mechanisms, "slider", "law in place of the tangential spring")
    places = _places(mechanisms, "slider")
    return _remembering_slider(*places[0]) if places else _one_spring(forms)


def _remembering_slider(own: Any, offset: int, name: str) -> Any:
    @wp.func(name=name)
    def slider(
        params: Any,
        contact: Any,
        displacement: Any,
        stiffness: Any,
        damping_rate: Any,
        velocity: Any,
        limit: Any,
        memory: Any,
        first: int,
    ):
        at = first + wp.static(offset)
        return own(params, contact, displacement, stiffness, damping_rate, velocity, limit, memory, at)

    return slider


def _spring(mechanisms: Mechanisms) -> Any:
    chain = _same_elastic
    for own, offset, name in _places(mechanisms, "spring"):
        chain = _then_spring(chain, own, offset, name)
    return chain


def _then_spring(before: Any, own: Any, offset: int, name: str) -> Any:
    @wp.func(name=name)
    def spring(params: Any, contact: Any, elastic: Any, memory: Any, first: int):
        at = first + wp.static(offset)
        return own(params, contact, before(params, contact, elastic, memory, first), memory, at)

    return spring


def _friction(mechanisms: Mechanisms) -> Any:
    chain = _same_coefficient
    for own, offset, name in _places(mechanisms, "friction"):
        chain = _then_friction(chain, own, offset, name)
    return chain


def _then_friction(before: Any, own: Any, offset: int, name: str) -> Any:
    @wp.func(name=name)
    def friction(
        params: Any, contact: Any, coefficient: Any, spring: Any, support: Any, memory: Any, first: int
    ):
        at = first + wp.static(offset)
        changed = before(params, contact, coefficient, spring, support, memory, first)
        return own(params, contact, changed, spring, support, memory, at)

    return friction
