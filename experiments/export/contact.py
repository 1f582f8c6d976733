"""Contacts of a case, and their translation into the terms of another code."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from dem_warp import Case, Interaction, Material
from dem_warp.model import ContactCoefficients


@dataclass(frozen=True)
class Contact:
    """Two surfaces that touch.

    Raises
    ------
    ValueError
        When the contact has a mechanism: no other code has the same.
    """

    first: Material
    second: Material
    """Their materials."""
    surface: Interaction
    """Properties of the pair."""
    coefficients: ContactCoefficients
    """Coefficients of the contact law."""
    radius: float
    mass: float
    """Reduced ones [m], [kg], for codes whose resistance to rolling asks for them."""
    normal_damping: str = "tsuji"
    """Choice that the coefficients' damping is for: a number made of the restitution, or a rate [1/s]."""

    def __post_init__(self) -> None:
        if names := [mechanism.name for mechanism in self.coefficients.mechanisms]:
            raise ValueError(f"Contact: other codes have terms for the base law alone, got {names}")


def contacts_of(case: Case[Any], radius: float, mass: float) -> tuple[Contact, Contact]:
    """Contacts of a case whose walls are of one material: of grains with grains, and with walls.

    The radius is that of a grain's largest sphere [m], the mass that of a grain [kg].

    Raises
    ------
    ValueError
        When the case has a mechanism beside the base law.
    """
    grain, wall = case.grain_material, case.scene.wall_material
    among, with_wall = case.contacts(wall)
    damping = case.laws.normal_damping
    return (
        Contact(grain, grain, case.grain_grain, among, radius / 2, mass / 2, damping),
        Contact(grain, wall, case.grain_wall, with_wall, radius, mass, damping),
    )


@dataclass(frozen=True)
class Term:
    """One number in the words of another code."""

    name: str
    """Its name there."""
    value: float
    unit: str
    """SI; "1" for a number without one."""
    formula: str
    """Its formula in the terms of the case."""
    source: str
    """Document that defines it."""


def values(terms: tuple[Term, ...]) -> dict[str, float]:
    """Values of terms by their names."""
    return {term.name: term.value for term in terms}
