"""Adhesion to walls alone, in proportion to the contact area."""

from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import warp as wp

from dem_warp.laws.linear_cohesion import contact_area
from dem_warp.laws.mechanism import Between, Mechanism
from dem_warp.parameters import Parameter


@wp.func
def wall_attraction(params: Any, contact: Any, memory: Any, at: int):
    """Attraction k_w A [N] with A = 2 pi R* d."""
    return params.wall_adhesion_energy_density * contact_area(contact)


@dataclass(frozen=True, kw_only=True)
class WallAdhesion(Mechanism):
    """Walls attract grains as `LinearCohesion` attracts surfaces, with a strength of their own.

    It is a mechanism beside the cohesion of the grains, so that a case may have either, or both, and a study
    may vary them apart.

    Raises
    ------
    ValueError
        If `between` is not "walls".

    Notes
    -----
    Source: LIGGGHTS documentation, "gran cohesion sjkr", for pairs of a grain and a wall.
    """

    between: Between = "walls"
    wall_adhesion_energy_density: Annotated[float, Parameter("J/m^3", at_least=0.0)] = 0.0
    """k_w in F = k_w 2 pi R* d; R* is the radius of the sphere on the wall."""

    name: ClassVar[str] = "wall_adhesion"
    strength: ClassVar[str] = "wall_adhesion_energy_density"
    attraction: ClassVar[Any] = wall_attraction

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.between != "walls":
            raise ValueError(f"WallAdhesion.between: must be 'walls', got {self.between!r}")
