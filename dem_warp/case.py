"""One simulation: scene, grains, contacts, seed and numerics."""

from dataclasses import dataclass, field, fields, is_dataclass, replace
from typing import Annotated, Any, Generic, Literal, TypeVar

from dem_warp.laws.conventions import EDEM, ContactLaws
from dem_warp.laws.mechanism import Mechanism, check_forms
from dem_warp.materials import Interaction, Material, WallPart, rayleigh_time
from dem_warp.model import ContactCoefficients
from dem_warp.parameters import LATER, Parameter, check_parameters
from dem_warp.population import GrainPopulation
from dem_warp.scenes.scene import Scene

SceneT = TypeVar("SceneT", bound=Scene)

PrecisionName = Literal["mixed", "double"]
"""Names of `dem_warp.types.PRECISIONS`."""


@dataclass(frozen=True)
class Numerics:
    """Numerical settings of a case."""

    time_step_fraction: Annotated[float, Parameter("1", above=0.0, at_most=1.0)] = 0.25
    """Time step over the Rayleigh time of the smallest sphere; the paper uses 0.25."""
    skin: Annotated[float | None, Parameter("m", above=0.0)] = None
    """Reach of the neighbour lists beyond contact; it affects the speed only. Default: from the time step."""
    precision: PrecisionName = "mixed"
    """Floating-point precision of the forces."""
    modulus_scale: Annotated[float, Parameter("1", at_least=1.0)] = 1.0
    """Divisor of the grains' shear modulus (softer grains allow larger steps)."""

    def __post_init__(self) -> None:
        check_parameters(self)

    def softened(self, material: Material) -> Material:
        """Return a material of grains with the simulated shear modulus."""
        return replace(material, shear_modulus=material.shear_modulus / self.modulus_scale)


@dataclass(frozen=True)
class Case(Generic[SceneT]):
    """One scene with one set of parameters and one seed."""

    scene: SceneT
    """Physical test, e.g. LiftedCylinder."""
    grains: GrainPopulation
    grain_grain: Interaction
    grain_wall: Interaction
    seed: int = 0
    """Seed of the grains' sizes, orientations and places."""
    numerics: Numerics = field(default_factory=Numerics)
    mechanisms: tuple[Mechanism, ...] = ()
    """Physical effects beyond the base contact law. A mechanism at its null changes no result, except the
    last bits: its code is compiled in."""
    laws: ContactLaws = EDEM
    """Conventions of the contact law."""
    wall_parts: tuple[WallPart, ...] = field(default=(), metadata=LATER)
    """Parts of the walls with their own material."""

    def __post_init__(self) -> None:
        check_forms(tuple(type(mechanism) for mechanism in self.mechanisms), self.laws.forms)
        names = [part.name for part in self.wall_parts]
        if len(set(names)) < len(names):
            raise ValueError(f"Case.wall_parts: must name each part once, got {names}")
        if names:
            self.scene.check_parts(names)
        if not 0 <= self.seed < 2**63:
            raise ValueError(f"Case.seed: must be an integer from 0 to 2^63 - 1, got {self.seed!r}")

    @property
    def grain_material(self) -> Material:
        """Material of the grains with the simulated shear modulus."""
        return self.numerics.softened(self.grains.material)

    @property
    def time_step(self) -> float:
        """Time step [s]."""
        return self.numerics.time_step_fraction * rayleigh_time(
            self.grains.smallest_sphere, self.grain_material
        )

    @property
    def kinds(self) -> tuple[type, ...]:
        """Classes of the scene and the mechanisms."""
        return (type(self.scene), *(type(mechanism) for mechanism in self.mechanisms))

    def contacts(self, wall_material: Material) -> tuple[ContactCoefficients, ContactCoefficients]:
        """Return the contacts of grains with grains, and with walls of a material."""
        grain = self.grain_material
        return (
            self._contact("grains", grain, self.grain_grain),
            self._contact("walls", wall_material, self.grain_wall),
        )

    def contact_with(self, part: WallPart) -> ContactCoefficients:
        """Return the contact of grains with a part of the walls."""
        return self._contact("walls", part.material, part.surface)

    def _contact(self, kind: str, partner: Material, interaction: Interaction) -> ContactCoefficients:
        return ContactCoefficients.of_pair(
            self.grain_material,
            partner,
            interaction,
            self.laws,
            tuple(m for m in self.mechanisms if m.acts_between(kind)),
            *self._reduced(kind),
        )

    def _reduced(self, kind: str) -> tuple[float, float]:
        """Return the reduced radius [m] and mass [kg] of the largest spheres of mean grains."""
        share = 0.5 if kind == "grains" else 1.0
        size = self.grains.size_mean
        radius = max(float(shape.radii.max()) for shape in self.grains.mixture.shapes) * size
        mass = self.grain_material.density * self.grains.mean(lambda shape: shape.volume) * size**3
        return share * radius, share * mass

    def to_dict(self) -> dict[str, Any]:
        """Return everything that determines the result, as plain JSON values: neither device nor skin."""
        content = _plain(self)
        content["scene"] = {"kind": type(self.scene).__name__} | content["scene"]
        del content["numerics"]["skin"]
        content["numerics"] |= _BASE_LAW
        if self.laws == EDEM:
            del content["laws"]
        return content


_BASE_LAW = {"clamp_attraction": False, "tangential_damping": True, "rolling_holds": True}
"""Entries of the base law in the content of a case, from before laws had names: keys stay valid."""


def _plain(value: Any) -> Any:
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    if isinstance(value, Mechanism):
        return {"name": value.name, "between": value.between} | value.parameters
    if hasattr(value, "to_dict") and not isinstance(value, Case):
        return value.to_dict()
    if is_dataclass(value) and not isinstance(value, type):
        items = ((f, getattr(value, f.name)) for f in fields(value))
        return {f.name: _plain(own) for f, own in items if not (f.metadata == LATER and own == f.default)}
    return value
