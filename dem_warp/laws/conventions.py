"""Conventions of contact laws as named choices, law by law, and the sets of them that other codes have.

The same coefficient means different things in different codes: rolling friction against a grain's own spin or
against the relative rotation, with the distance to the centre or the reduced radius as its lever, for a whole
step or at most until rest. `docs/laws.md` has formula, lever, direction, limit and source of every choice.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Annotated, Any, Literal, NamedTuple, get_args, get_type_hints

from dem_warp.parameters import Parameter, check_parameters

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
"""Turning of the partner: by the opposite torque, by the same one, or by the opposite force at its own lever.
Then `Contact.rolled` is the grain's own spin [rad/s], and what both spins slide [m/s]."""

_PARTNER_TURNINGS: Mapping[str, PartnerTurning] = {"edem_rvd": "alike", "deme": "own lever"}
"""Turnings by the choice of rolling, where they are not opposite."""


class LawForms(NamedTuple):
    """Choices that kernels are compiled for; the others are numbers in the contact's parameters."""

    normal_damping: str
    tangential_history: str
    sliding: str
    friction_load: str
    rolling: str

    @property
    def changed(self) -> tuple[str, ...]:
        """Choices that are not the base law's."""
        return tuple(own for own, base in zip(self, BASE_FORMS, strict=True) if own != base)

    @property
    def partner_turning(self) -> PartnerTurning:
        """Turning of the partner by a rolling resistance that is a torque of the contact."""
        return _PARTNER_TURNINGS.get(self.rolling, "opposite")


BASE_FORMS = LawForms("tsuji", "displacement", "spring", "push", "own_spin")
"""Forms of the base law."""


@dataclass(frozen=True, kw_only=True)
class ContactLaws:
    """Conventions of a contact law, law by law; by default those of the base law.

    Raises
    ------
    ValueError
        When a choice is not one of its law's, or a number is missing or breaks its bounds.
    """

    normal: Normal = "hertz"
    """Radius of the contact area: Hertz's, or that of the circle in which the shapes overlap."""
    restitution: Restitution = "closed_form"
    """Constant of the damping from the coefficient of restitution."""
    normal_damping: NormalDamping = "tsuji"
    """Growth of the normal damping with the overlap."""
    attraction: Attraction = "free"
    """Sign of the normal force at the end of an impact: free to attract, or never attracting."""
    tangential_damping: TangentialDamping = "tsuji"
    """Damping of the tangential spring."""
    tangential_history: TangentialHistory = "displacement"
    """Memory of the tangential spring: its displacement or its force, scaled down as the contact unloads or
    not."""
    sliding: Sliding = "spring"
    """Part of the tangential force that Coulomb's limit holds for."""
    friction_load: FrictionLoad = "push"
    """Normal force in Coulomb's limit: where it pushes, or its size whatever its sign."""
    rolling: Rolling = "own_spin"
    """Resistance to rolling."""
    damping_rate: Annotated[float | None, Parameter("1/s", at_least=0.0)] = None
    """Rate of the normal damping per mass; for `viscoelastic`, at a contact area of 1 mm radius. Those
    dampings take no restitution."""
    rolling_stiffness: Annotated[float, Parameter("1", above=0.0)] = 2.25
    """Factor c of the spring of `elastic_plastic`, k_r = c S_n (mu_r R*)^2."""
    rolling_damping: Annotated[float, Parameter("1", at_least=0.0)] = 0.3
    """Damping ratio of the rolling vibration under `elastic_plastic`."""
    rolling_spring: Annotated[float | None, Parameter("N/m", above=0.0)] = None
    """Spring k of `sds` and `yade`, at the lever R*; left out, the tangential spring of the largest spheres
    at an overlap of 1 % of their radius."""
    rolling_dashpot: Annotated[float | None, Parameter("kg/s", at_least=0.0)] = None
    """Dashpot of `sds`; left out, half the critical one, sqrt(k m*)."""

    def __post_init__(self) -> None:
        for law, known in choices().items():
            value = getattr(self, law)
            if value not in known:
                raise ValueError(f"ContactLaws.{law}: must be one of {', '.join(known)}, got {value!r}")
        check_parameters(self)
        if (self.normal_damping != "tsuji") != (self.damping_rate is not None):
            rule = "must be given with the damping mass_velocity or viscoelastic, and with no other"
            raise ValueError(
                f"ContactLaws.damping_rate: {rule}, got {self.damping_rate!r} with {self.normal_damping!r}"
            )
        if self.normal_damping != "tsuji" and self.tangential_damping not in ("normal", "none"):
            rule = f"must be normal or none with the normal damping {self.normal_damping}"
            raise ValueError(f"ContactLaws.tangential_damping: {rule}, got {self.tangential_damping!r}")

    @property
    def forms(self) -> LawForms:
        """Choices that kernels are compiled for."""
        own = {name: getattr(self, name) for name in LawForms._fields}
        # how long the torque acts is a number of the integration
        is_own_spin = self.rolling == "own_spin_whole_step"
        return LawForms(**(own | {"rolling": "own_spin"} if is_own_spin else own))

    @property
    def name(self) -> str:
        """Name of the set, where it is a known one; else ``"own"``."""
        return next((name for name, laws in PRESETS.items() if laws == self), "own")

    def to_dict(self) -> dict[str, Any]:
        """Every choice and number, as plain JSON values."""
        return {field.name: getattr(self, field.name) for field in fields(self)}


def choices() -> dict[str, tuple[str, ...]]:
    """Names that each law has, by law."""
    hints = get_type_hints(ContactLaws, include_extras=False)
    return {law: get_args(hint) for law, hint in hints.items() if hint not in (float, float | None)}


def laws_named(name: str) -> ContactLaws:
    """Set of laws by name.

    Raises
    ------
    ValueError
        When there is none of the name.
    """
    if name not in PRESETS:
        raise ValueError(f"laws: must be one of {', '.join(PRESETS)}, got {name!r}")
    return PRESETS[name]


EDEM = ContactLaws()
"""Hertz-Mindlin (no slip) with standard rolling friction, as EDEM's manual prints it: the base law."""

RELATIVE = ContactLaws(rolling="elastic_plastic")
"""Law of a new study: the base law, but rolling is resisted as the relative rotation of the two bodies."""

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
"""Sets of laws by the name of their code; two where a code is used in two ways."""
