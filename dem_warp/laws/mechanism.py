"""Base of mechanisms: physical effects that contacts have beside, or in place of, a part of the base law.

A mechanism is a frozen dataclass of its parameters, each with unit and bounds and a field of `ContactParams`
under the same name, and of device functions (`@wp.func`), each at one of the places where the law can be
changed; `None` leaves one as it is. A mechanism of strength 0, the default, is at its null: it leaves the
base law as it is.
"""

from dataclasses import dataclass
from typing import Any, ClassVar, Literal, get_args

from dem_warp.laws.conventions import BASE_FORMS, LawForms
from dem_warp.parameters import check_parameters, parameters_of

Between = Literal["all", "grains", "walls"]
"""Contacts that have a mechanism: every one, those of grains with grains, or those of grains with walls."""


@dataclass(frozen=True, kw_only=True)
class Mechanism:
    """A physical effect of contacts.

    Notes
    -----
    The device functions of a subclass take `params` (ContactParams of the pair) and `contact` (Contact)
    first, and last `memory` and `at`: an array and the index in it of the first of the `memory_size` values
    that the mechanism remembers of this contact from step to step; nothing as yet when `contact.is_new`.
    Surfaces that stand apart, where some mechanism acts on such, have a negative `contact.overlap` for
    `attraction` alone; for the others the overlap is then 0 and the contact new.

    spring(params, contact, elastic, memory, at)
        Elastic normal force [N] in place of Hertz's, `elastic`.
    attraction(params, contact, memory, at)
        Force [N] that pulls the two bodies together. Friction does not feel it.
    friction(params, contact, coefficient, spring, support, memory, at)
        Coefficient of friction in place of `coefficient`, knowing the force of the tangential spring [N], not
        yet limited, and the normal force [N] by which the surfaces push each other off.
    slider(params, contact, displacement, stiffness, damping_rate, velocity, limit, memory, at)
        Tangential force [N], no larger than `limit` [N], and displacement [m] of the spring for the next
        step, in place of the base law's one spring. It is given the spring's displacement [m] after this
        step, its stiffness [N/m] and damping [N s/m], and the tangential velocity [m/s]. One mechanism of a
        build at the most has it.
    torque(params, contact, support, memory, at)
        Torque [N m] on the grain beside that of the contact force; the partner feels the opposite one.
    rolling(params, limit)
        Largest torque [N m] of the base law's rolling resistance in place of `limit`: none where `torque`
        stands in its place. One mechanism of a build at the most has it.
    """

    between: Between = "all"
    """Contacts that have it: all, those between grains, or those with walls."""

    name: ClassVar[str]
    strength: ClassVar[str]
    """The parameter that says how strong it is: 0 is its null, whatever the others are."""
    memory_size: ClassVar[int] = 0
    excludes: ClassVar[tuple[str, ...]] = ()
    """Names of mechanisms that the same contact may not have, since this one builds on Hertz's force."""
    acts_apart: ClassVar[bool] = False
    """True of one that acts on surfaces that no longer touch; then `reach` says how far."""

    spring: ClassVar[Any] = None
    attraction: ClassVar[Any] = None
    friction: ClassVar[Any] = None
    slider: ClassVar[Any] = None
    torque: ClassVar[Any] = None
    rolling: ClassVar[Any] = None

    def __post_init__(self) -> None:
        if self.between not in get_args(Between):
            rule = f"must be one of {get_args(Between)}"
            raise ValueError(f"{type(self).__name__}.between: {rule}, got {self.between!r}")
        check_parameters(self)

    @classmethod
    def parameter_names(cls) -> tuple[str, ...]:
        """Names of the parameters, which are fields of `ContactParams` too."""
        return tuple(parameters_of(cls))

    @property
    def parameters(self) -> dict[str, float]:
        """Value of each parameter."""
        return {name: float(getattr(self, name)) for name in self.parameter_names()}

    def acts_between(self, kind: str) -> bool:
        """Tell whether contacts of a kind, "grains" or "walls", have it."""
        return self.between in ("all", kind)

    def reach(self, largest_radius: float, modulus: float) -> float:
        """Largest distance [m] between two surfaces at which it acts, for spheres up to a radius [m].

        `modulus` is the pair's effective Young's modulus E* [Pa].
        """
        return 0.0


Mechanisms = tuple[type[Mechanism], ...]
"""Mechanisms of a build, in the order of the library."""

REPLACED = {"rolling": ("rolling",), "slider": ("sliding", "tangential_history")}
"""Laws whose base choice alone leaves room for a mechanism, by the hook that it has."""


def clashes(mechanisms: tuple[Mechanism, ...]) -> list[tuple[str, str]]:
    """Names of those that must not stand in one contact: each with the one that it excludes."""
    pairs = [(one, other) for one in mechanisms for other in mechanisms]
    return [(one.name, other.name) for one, other in pairs if other.name in one.excludes]


def check_forms(mechanisms: Mechanisms, forms: LawForms) -> None:
    """Check that no mechanism stands where the law is another than the base's.

    Raises
    ------
    ValueError
        With the mechanism and the law that it does not go with.
    """
    base = BASE_FORMS
    for hook, laws in REPLACED.items():
        for law in laws:
            chosen = getattr(forms, law)
            clash = [
                m.name for m in mechanisms if getattr(m, hook) is not None and chosen != getattr(base, law)
            ]
            if clash:
                rule = f"must be {getattr(base, law)!r} beside the mechanism {clash[0]}"
                raise ValueError(f"ContactLaws.{law}: {rule}, got {chosen!r}")
    if forms.partner_turning != "opposite" and (
        clash := [m.name for m in mechanisms if m.torque is not None]
    ):
        raise ValueError(
            f"ContactLaws.rolling: must not be {forms.rolling!r} beside the mechanism {clash[0]}"
        )
