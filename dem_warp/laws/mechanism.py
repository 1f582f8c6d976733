"""Base of mechanisms: physical effects of contacts that add to the base law or replace a part of it.

A mechanism is a frozen dataclass of parameters, which are also fields of `ContactParams`, and of device
functions (`@wp.func`), each at one of the places where the law can change; `None` changes nothing there.
A mechanism of strength 0, the default, is at its null: the base law holds.
"""

from dataclasses import dataclass
from typing import Any, ClassVar, Literal

from dem_warp.laws.conventions import BASE_FORMS, LawForms
from dem_warp.parameters import check_parameters, parameters_of

Between = Literal["all", "grains", "walls"]
"""Contacts that have a mechanism: all, grain with grain, or grain with wall."""


@dataclass(frozen=True, kw_only=True)
class Mechanism:
    """A physical effect of contacts.

    Notes
    -----
    The device functions of a subclass take `params` (ContactParams of the pair) and `contact` (Contact)
    first. Last come `memory` and `at`: an array and the index of the first of the `memory_size` values that
    the mechanism remembers of this contact; they are undefined when `contact.is_new`. Where a mechanism acts
    on separated surfaces, `attraction` alone sees their negative `contact.overlap`; for the other functions
    the overlap is then 0 and the contact new.

    spring(params, contact, elastic, memory, at)
        Elastic normal force [N] in place of Hertz's, `elastic`.
    attraction(params, contact, memory, at)
        Force [N] that pulls the two bodies together. Friction does not count it.
    friction(params, contact, coefficient, spring, support, memory, at)
        Coefficient of friction in place of `coefficient`; `spring` is the force of the tangential spring [N]
        before its limit, `support` the repulsive normal force [N].
    slider(params, contact, displacement, stiffness, damping_rate, velocity, limit, memory, at)
        Tangential force [N], at most `limit` [N], and displacement [m] of the spring for the next step, in
        place of the base law's spring. It gets the spring's displacement [m] after this step, stiffness
        [N/m], damping [N s/m] and tangential velocity [m/s]. At most one mechanism of a build has it.
    torque(params, contact, support, memory, at)
        Torque [N m] on the grain in addition to that of the contact force; the partner gets the opposite.
    rolling(params, limit)
        Largest torque [N m] of the base law's rolling resistance in place of `limit`: 0 where `torque`
        replaces it. At most one mechanism of a build has it.
    """

    between: Between = "all"
    """Contacts that have it: all, only between grains, or only with walls."""

    name: ClassVar[str]
    strength: ClassVar[str]
    """Name of the parameter whose value 0 is the null, whatever the others are."""
    memory_size: ClassVar[int] = 0
    excludes: ClassVar[tuple[str, ...]] = ()
    """Names of mechanisms that the same contact may not have."""
    acts_apart: ClassVar[bool] = False
    """True if it acts on surfaces that no longer touch, up to `reach`."""

    spring: ClassVar[Any] = None
    attraction: ClassVar[Any] = None
    friction: ClassVar[Any] = None
    slider: ClassVar[Any] = None
    torque: ClassVar[Any] = None
    rolling: ClassVar[Any] = None

    def __post_init__(self) -> None:
        check_parameters(self)

    @classmethod
    def parameter_names(cls) -> tuple[str, ...]:
        """Return the names of the parameters, which are fields of `ContactParams` too."""
        return tuple(parameters_of(cls))

    @property
    def parameters(self) -> dict[str, float]:
        return {name: float(getattr(self, name)) for name in self.parameter_names()}

    def acts_between(self, kind: str) -> bool:
        """Return True if contacts of a kind, "grains" or "walls", have it."""
        return self.between in ("all", kind)

    def reach(self, largest_radius: float, modulus: float) -> float:
        """Return the largest distance [m] of surfaces at which it acts, for spheres up to a radius [m].

        `modulus` is the pair's effective Young's modulus E* [Pa].
        """
        return 0.0


Mechanisms = tuple[type[Mechanism], ...]
"""Mechanisms of a build, in the order of the library."""

REPLACED = {"rolling": ("rolling",), "slider": ("sliding", "tangential_history")}
"""Laws that must be the base law's, by the hook of a mechanism that replaces them."""


def clashes(mechanisms: tuple[Mechanism, ...]) -> list[tuple[str, str]]:
    """Return the names of mechanisms that one contact must not have, each with the one it excludes."""
    return [
        (one.name, other.name) for one in mechanisms for other in mechanisms if other.name in one.excludes
    ]


def check_forms(mechanisms: Mechanisms, forms: LawForms) -> None:
    """Raise ValueError if a mechanism replaces a law that is not the base law's."""
    for mechanism in mechanisms:
        replaced = [law for hook, laws in REPLACED.items() if getattr(mechanism, hook) for law in laws]
        for law in replaced:
            base, chosen = getattr(BASE_FORMS, law), getattr(forms, law)
            if chosen != base:
                rule = f"must be {base!r} with the mechanism {mechanism.name}"
                raise ValueError(f"ContactLaws.{law}: {rule}, got {chosen!r}")
        if mechanism.torque and forms.partner_turning != "opposite":
            rule = f"must not be {forms.rolling!r} with the mechanism {mechanism.name}"
            raise ValueError(f"ContactLaws.rolling: {rule}")
