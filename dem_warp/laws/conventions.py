"""Conventions of contact laws as named choices, and the sets of them that other codes use.

The same coefficient means different things in different codes: rolling friction may act against a grain's own
spin or the relative rotation, with different levers and limits. `docs/laws.md` has the formula, lever,
direction, limit and source of every choice.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Annotated, Any, Literal, NamedTuple

from dem_warp.parameters import Parameter, check_parameters, require_choice

Normal = Literal["hertz", "overlap_circle"]
Restitution = Literal["closed_form", "polynomial", "thornton"]
NormalDamping = Literal["tsuji", "mass_velocity", "viscoelastic"]
Attraction = Literal["free", "clamped"]
TangentialDamping = Literal["tsuji", "normal", "deme", "none"]
TangentialHistory = Literal["displacement", "force", "rescaled_displacement", "rescaled_force"]
Sliding = Literal["spring", "spring_free", "sum"]
FrictionLoad = Literal["push", "size"]
Rolling = Literal[
    "own_spin", "own_spin_whole_step", "edem_rvd", "relative_constant", "cdt", "elastic_plastic", "epsd2",
    "sds", "rocky_3", "yade", "deme",
]  # fmt: skip

PartnerTurning = Literal["opposite", "alike", "own lever"]
"""Torque on the partner: the opposite one, the same one, or the opposite force at the partner's own lever.
With these last two, `Contact.rolled` is the grain's own spin [rad/s] and the sliding velocity of both spins
[m/s]."""

_PARTNER_TURNINGS: Mapping[str, PartnerTurning] = {"edem_rvd": "alike", "deme": "own lever"}
"""Torque on the partner by the choice of rolling, where it is not opposite."""


class LawForms(NamedTuple):
    """Choices compiled into the kernels; the others are numbers in the contact's parameters."""

    normal_damping: str
    tangential_history: str
    sliding: str
    friction_load: str
    rolling: str

    @property
    def changed(self) -> tuple[str, ...]:
        """Choices that differ from the base law."""
        return tuple(own for own, base in zip(self, BASE_FORMS, strict=True) if own != base)

    @property
    def partner_turning(self) -> PartnerTurning:
        """Torque on the partner by a rolling resistance that is a torque of the contact."""
        return _PARTNER_TURNINGS.get(self.rolling, "opposite")


BASE_FORMS = LawForms("tsuji", "displacement", "spring", "push", "own_spin")
"""Forms of the base law."""


@dataclass(frozen=True, kw_only=True)
class ContactLaws:
    """Conventions of a contact law; the defaults are the base law."""

    normal: Normal = "hertz"
    """Radius of the contact area: Hertz's, or the radius of the circle in which the shapes overlap."""
    restitution: Restitution = "closed_form"
    """Formula of the damping constant from the coefficient of restitution."""
    normal_damping: NormalDamping = "tsuji"
    """Formula of the normal damping."""
    attraction: Attraction = "free"
    """Normal force at the end of an impact: it may attract (free) or not (clamped)."""
    tangential_damping: TangentialDamping = "tsuji"
    """Damping of the tangential spring."""
    tangential_history: TangentialHistory = "displacement"
    """Memory of the tangential spring: its displacement or its force; rescaled: reduced as the contact
    unloads."""
    sliding: Sliding = "spring"
    """Part of the tangential force that Coulomb's limit applies to."""
    friction_load: FrictionLoad = "push"
    """Normal force in Coulomb's limit: only where it pushes, or its absolute value (size)."""
    rolling: Rolling = "own_spin"
    """Law of the rolling resistance."""
    damping_rate: Annotated[float | None, Parameter("1/s", at_least=0.0)] = None
    """Rate of the normal damping per mass; for `viscoelastic`, at a contact area of 1 mm radius. It replaces
    the restitution."""
    rolling_stiffness: Annotated[float, Parameter("1", above=0.0)] = 2.25
    """Factor c of the spring of `elastic_plastic`, k_r = c S_n (mu_r R*)^2."""
    rolling_damping: Annotated[float, Parameter("1", at_least=0.0)] = 0.3
    """Damping ratio of the rolling vibration under `elastic_plastic`."""
    rolling_spring: Annotated[float | None, Parameter("N/m", above=0.0)] = None
    """Spring k of `sds` and `yade`, at the lever R*. Default: the tangential spring of the largest spheres at
    an overlap of 1 % of their radius."""
    rolling_dashpot: Annotated[float | None, Parameter("kg/s", at_least=0.0)] = None
    """Dashpot of `sds`. Default: half the critical one, sqrt(k m*)."""

    def __post_init__(self) -> None:
        check_parameters(self)
        if (self.normal_damping != "tsuji") != (self.damping_rate is not None):
            rule = "must be given with the damping mass_velocity or viscoelastic, and only with these"
            raise ValueError(
                f"ContactLaws.damping_rate: {rule}, got {self.damping_rate!r} with {self.normal_damping!r}"
            )
        if self.normal_damping != "tsuji":
            place = f"ContactLaws.tangential_damping (with normal_damping {self.normal_damping})"
            require_choice(place, self.tangential_damping, ("normal", "none"))

    @property
    def forms(self) -> LawForms:
        """Choices compiled into the kernels."""
        own = [getattr(self, name) for name in LawForms._fields[:-1]]
        # the duration of the torque is a number of the integration
        is_own_spin = self.rolling == "own_spin_whole_step"
        return LawForms(*own, "own_spin" if is_own_spin else self.rolling)

    @property
    def name(self) -> str:
        """Name of the set in `PRESETS`; ``"own"`` if it is not there."""
        return next((name for name, laws in PRESETS.items() if laws == self), "own")

    def to_dict(self) -> dict[str, Any]:
        """Return every choice and number as plain JSON values."""
        return asdict(self)


def laws_named(name: str) -> ContactLaws:
    """Return the set of laws of a name; raise ValueError if there is no such set."""
    require_choice("laws", name, tuple(PRESETS))
    return PRESETS[name]


EDEM = ContactLaws()
"""Base law: Hertz-Mindlin (no slip) with standard rolling friction, as in EDEM's manual."""

RELATIVE = ContactLaws(rolling="elastic_plastic")
"""Law of a new study: the base law with rolling resistance against the relative rotation of the bodies."""

_LIGGGHTS = ContactLaws(sliding="spring_free", friction_load="size", rolling="epsd2")

PRESETS: Mapping[str, ContactLaws] = {
    "edem": EDEM,
    "edem-rvd": replace(EDEM, rolling="edem_rvd"),
    "edem-c": replace(EDEM, rolling="elastic_plastic", rolling_damping=0.0),
    "relative": RELATIVE,
    "liggghts": _LIGGGHTS,
    "liggghts-cdt": replace(_LIGGGHTS, rolling="cdt"),
    "lammps": ContactLaws(
        restitution="polynomial",
        tangential_damping="normal",
        sliding="sum",
        friction_load="size",
        rolling="sds",
    ),
    "yade": ContactLaws(
        restitution="thornton",
        attraction="clamped",
        tangential_history="force",
        sliding="spring_free",
        rolling="yade",
    ),
    "deme": ContactLaws(
        normal="overlap_circle",
        tangential_damping="deme",
        sliding="sum",
        friction_load="size",
        rolling="deme",
    ),
    "rocky": ContactLaws(rolling="rocky_3"),
}
"""Sets of laws by the name of their code."""
