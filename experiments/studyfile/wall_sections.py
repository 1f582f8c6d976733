"""Materials and pairs of surfaces, and the parts of the walls that have their own."""

from __future__ import annotations

from pydantic import Field

from dem_warp import Interaction, Material, WallPart
from experiments.studyfile.schema import Density, Number, Pressure, Section

LEAST_MODULUS = 1e3
"""Least shear modulus [Pa], softened or not: the grains of a heap would flow through one another."""

LIKELY_DENSITIES = (50.0, 20_000.0)
"""Densities of solids [kg/m^3]: expanded minerals have the least, tungsten nearly the largest."""


def density_doubt(density: float, place: str) -> str:
    """Say that a density [kg/m^3] is unlikely for a solid, or nothing."""
    low, high = LIKELY_DENSITIES
    if low <= density <= high:
        return ""
    return f"{place} of {density:g} kg/m^3 is unlikely: solids have {low:g} to {high:,.0f}"


class MaterialSection(Section):
    """Material of a grain or a wall."""

    density: Density = Field(gt=0.0)
    """Mass of the solid per volume."""
    shear_modulus: Pressure = Field(ge=LEAST_MODULUS)
    """Shear modulus."""
    poisson_ratio: Number = Field(ge=0.0, le=0.5)
    """Poisson's ratio."""

    def material(self) -> Material:
        return Material(self.density, self.shear_modulus, self.poisson_ratio)


class InteractionSection(Section):
    """One pair of surfaces."""

    restitution: Number = Field(ge=0.01, le=1.0)
    """Coefficient of restitution."""
    static_friction: Number = Field(ge=0.0)
    """Coefficient of static friction."""
    rolling_friction: Number = Field(ge=0.0)
    """Coefficient of rolling friction."""

    def interaction(self) -> Interaction:
        return Interaction(**dict(self))


class WallPartSection(Section):
    """``[walls.NAME]``: walls of another material; what it omits is that of the other walls."""

    density: Density | None = Field(default=None, gt=0.0)
    """Mass of the solid per volume."""
    shear_modulus: Pressure | None = Field(default=None, ge=LEAST_MODULUS)
    """Shear modulus."""
    poisson_ratio: Number | None = Field(default=None, ge=0.0, le=0.5)
    """Poisson's ratio."""
    restitution: Number | None = Field(default=None, ge=0.01, le=1.0)
    """Coefficient of restitution."""
    static_friction: Number | None = Field(default=None, ge=0.0)
    """Coefficient of static friction."""
    rolling_friction: Number | None = Field(default=None, ge=0.0)
    """Coefficient of rolling friction."""

    def part(self, name: str, wall: MaterialSection, surface: InteractionSection) -> WallPart:
        """Build the engine's part, with what it lacks from the other walls."""
        own = self.model_dump(exclude_none=True)
        in_wall, in_surface = (
            {key: value for key, value in own.items() if key in fields}
            for fields in (MaterialSection.model_fields, InteractionSection.model_fields)
        )
        material = wall.model_copy(update=in_wall).material()
        return WallPart(name, material, surface.model_copy(update=in_surface).interaction())
