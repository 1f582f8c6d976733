"""Capillary bridges: liquid between surfaces that have touched attracts them until it breaks."""

import math
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import warp as wp

from dem_warp.laws.bond import bonded
from dem_warp.laws.mechanism import Mechanism
from dem_warp.parameters import Parameter


@wp.func
def rupture_distance(volume: Any, angle: Any):
    """Return the distance of the surfaces (1 + theta / 2) V^(1/3) [m] at which a bridge breaks."""
    return (type(angle)(1.0) + type(angle)(0.5) * angle) * wp.cbrt(volume)


@wp.func
def bridge_attraction(params: Any, contact: Any, memory: Any, at: int):
    """Return the attraction 2 pi R g cos(theta) / (1 + 1.05 S + 2.5 S^2) [N] between spheres of radius R."""
    tension = params.surface_tension
    volume = params.bridge_volume
    angle = params.contact_angle
    zero = type(tension)(0.0)
    one = type(tension)(1.0)
    if tension <= zero:
        return zero
    if not bonded(contact, rupture_distance(volume, angle), memory, at):
        return zero
    radius = type(tension)(2.0) * contact.radius
    s = wp.max(-contact.overlap, zero) * wp.sqrt(radius / volume)
    at_contact = type(tension)(2.0) * type(tension)(math.pi) * radius * tension * wp.cos(angle)
    return at_contact / (one + type(tension)(1.05) * s + type(tension)(2.5) * s * s)


@dataclass(frozen=True, kw_only=True)
class CapillaryBridge(Mechanism):
    """Liquid bridge that attracts two spheres from their first touch until it breaks.

    Notes
    -----
    The attraction at the distance D of the surfaces (0 in an overlap) is ::

        F = 2 pi R g cos(theta) / (1 + 1.05 S + 2.5 S^2),    S = D sqrt(R / V)

    with R = 2 R*: the radius of two equal spheres, Derjaguin's mean 2 R1 R2 / (R1 + R2) of unequal ones, and
    twice the radius of a sphere on a wall. A bridge forms when the surfaces touch and breaks at
    D = (1 + theta / 2) V^(1/3).

    The formulas hold for bridges that are small relative to the spheres and not deformed by gravity. All
    bridges have the same volume; liquid transport and viscosity are neglected. Each pair of spheres has its
    own bridge, so a grain of several spheres may have several with the same neighbour.

    Sources: C. D. Willett, M. J. Adams, S. A. Johnson and J. P. K. Seville, Langmuir 16 (2000) 9396-9405,
    equation 12, which counts half the distance; the rupture: G. Lian, C. Thornton and M. J. Adams, J. Colloid
    Interface Sci. 161 (1993) 138-147.
    """

    surface_tension: Annotated[float, Parameter("N/m", at_least=0.0)] = 0.0
    """Surface tension g; water: 0.072 N/m."""
    bridge_volume: Annotated[float, Parameter("m^3", at_least=0.0)] = 0.0
    """Volume V of each bridge; must be above 0 if the surface tension is."""
    contact_angle: Annotated[float, Parameter("rad", at_least=0.0, below=math.pi / 2)] = 0.0
    """Angle theta of the liquid on the surfaces."""

    name: ClassVar[str] = "capillary_bridge"
    strength: ClassVar[str] = "surface_tension"
    memory_size: ClassVar[int] = 1
    acts_apart: ClassVar[bool] = True
    attraction: ClassVar[Any] = bridge_attraction

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.surface_tension > 0.0 and self.bridge_volume <= 0.0:
            raise ValueError(
                "CapillaryBridge.bridge_volume: must be above 0 [m^3] if the surface tension is, "
                f"got {self.bridge_volume!r}"
            )

    def reach(self, largest_radius: float, modulus: float) -> float:
        """Return the distance [m] at which a bridge breaks."""
        if self.surface_tension == 0.0:
            return 0.0
        return (1.0 + 0.5 * self.contact_angle) * self.bridge_volume ** (1.0 / 3.0)
