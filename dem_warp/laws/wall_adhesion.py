"""Adhesion to walls only, in proportion to the contact area."""

from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import warp as wp

from dem_warp.laws.linear_cohesion import contact_area
from dem_warp.laws.mechanism import Between, Mechanism
from dem_warp.parameters import Parameter, require_choice


@wp.func
def wall_attraction(params: Any, contact: Any, memory: Any, at: int):
    """Return the attraction k_w A [N] with A = 2 pi R* d."""
    return params.wall_adhesion_energy_density * contact_area(contact)


@dataclass(frozen=True, kw_only=True)
class WallAdhesion(Mechanism):
    """Attraction of grains to walls, as `LinearCohesion` with its own strength.

    A case may have either or both, and a study may vary them separately.

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
        require_choice("WallAdhesion.between", self.between, ("walls",))
