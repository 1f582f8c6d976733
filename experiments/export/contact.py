"""Contacts of a case, and terms of other codes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from dem_warp import Case, Interaction, Material
from dem_warp.model import ContactCoefficients


@dataclass(frozen=True)
class Contact:
    """Contact of two surfaces.

    Raises
    ------
    ValueError
        When the contact has a mechanism: no other code has the same.
    """

    first: Material
    second: Material
    """Their materials."""
    surface: Interaction
    """Properties of the pair of materials."""
    coefficients: ContactCoefficients
    """Coefficients of the contact law."""
    radius: float
    mass: float
    """Reduced radius [m] and mass [kg]."""
    normal_damping: str = "tsuji"
    """Law of the coefficients' damping, which is a number made of the restitution, or a rate [1/s]."""

    def __post_init__(self) -> None:
        if names := [mechanism.name for mechanism in self.coefficients.mechanisms]:
            raise ValueError(f"Contact: other codes have terms for the base law alone, got {names}")


def contacts_of(case: Case[Any], radius: float, mass: float) -> tuple[Contact, Contact]:
    """Return the contacts of grains with grains and with walls, which are of one material.

    The radius is that of a grain's largest sphere [m], the mass that of a grain [kg].

    Raises
    ------
    ValueError
        When the case has a mechanism.
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
    """Number in the terms of another code."""

    name: str
    """Name in the code."""
    value: float
    unit: str
    """SI; "1" for a number without one."""
    formula: str
    """Formula in the terms of the case."""
    source: str
    """Document that defines it."""


def values(terms: tuple[Term, ...]) -> dict[str, float]:
    """Return the values of terms by their names."""
    return {term.name: term.value for term in terms}
