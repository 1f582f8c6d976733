"""A lifted cylinder with more to it than any study can say: what only another code simulates."""

import math
from dataclasses import dataclass, fields
from typing import Annotated

from dem_warp import LiftedCylinder, Parameter


@dataclass(frozen=True)
class OddLift(LiftedCylinder):
    """A lifted cylinder of another workshop."""

    taper: Annotated[float, Parameter("rad", at_least=0.0, at_most=0.2)] = 0.0
    """Half the angle of the cone that the tube is part of: it narrows upwards, its radius is right at half
    its height."""
    turn_rate: Annotated[float, Parameter("1/s", at_least=0.0)] = 0.0
    """Turning of the tube about its axis while it is lifted, in radians a second."""
    odd_share: Annotated[float, Parameter("1", at_least=0.0, below=1.0)] = 0.0
    """Part of the number of grains that are of another kind."""
    odd_friction: Annotated[float, Parameter("1", at_least=0.0)] = 1.0
    """Static friction of the other kind, with all that it touches, over that of the rest."""
    odd_modulus: Annotated[float, Parameter("1", above=0.0, at_most=1.0)] = 1.0
    """Modulus of the other kind over that of the rest."""
    tube_sides: Annotated[int, Parameter("1", at_least=12)] = 60
    """Sides of the prism that stands for the tube."""
    look_time: Annotated[float, Parameter("s", above=0.0)] = 4e-3
    """Time between two looks of the film and the balance."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.upper_radius > 0.5 * self.diameter / 2:
            rule = "must leave the rim half of the tube's width"
            raise ValueError(f"OddLift.taper: {rule}, got {self.taper!r} [rad]")

    @property
    def lower_radius(self) -> float:
        """Radius of the tube on the plate [m]."""
        return self.diameter / 2 + self._widening

    @property
    def upper_radius(self) -> float:
        """Radius of the tube at its rim [m]."""
        return self.diameter / 2 - self._widening

    @property
    def _widening(self) -> float:
        return 0.5 * self.height * math.tan(self.taper)


def odd(scene: LiftedCylinder, **changes: float) -> OddLift:
    """Take a test to the other workshop, with changes."""
    own = {field.name: getattr(scene, field.name) for field in fields(scene) if field.init}
    return OddLift(**own | changes)
