"""Cohesion in proportion to the contact area."""

import math
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import warp as wp

from dem_warp.laws.mechanism import Mechanism
from dem_warp.parameters import Parameter


@wp.func
def contact_area(contact: Any):
    """Return the area 2 pi R* d [m2] of the circle in which two spheres overlap, to first order in d / R*."""
    overlap = wp.max(contact.overlap, type(contact.overlap)(0.0))
    return type(overlap)(2.0) * type(overlap)(math.pi) * contact.radius * overlap


@wp.func
def area_attraction(params: Any, contact: Any, memory: Any, at: int):
    """Return the attraction k A [N] with A = 2 pi R* d."""
    return params.cohesion_energy_density * contact_area(contact)


@dataclass(frozen=True, kw_only=True)
class LinearCohesion(Mechanism):
    """Attraction of surfaces by a constant pressure over their contact area ("simplified JKR", SJKR).

    Notes
    -----
    The area is that in which the two undeformed surfaces cut each other, twice that of the Hertz contact
    (pi R* d). It is taken to first order in the overlap: the exact circle is smaller by the part d / (8 R*)
    for two like spheres and by d / (2 R*) for a sphere on a plane.

    There is no attraction at d = 0 and beyond, and it is conservative: an impact loses no energy to it. An
    unloaded contact rests at d0 = R* (3 pi k / (2 E*))^2; the largest force that it holds is
    (2/3) pi^3 k^3 R*^2 / E*^2, at (4/9) d0. So choose k for the simulated modulus, and small: d0 is
    22 (k / E*)^2 of R*.

    Source: LIGGGHTS documentation, "gran cohesion sjkr"; its "sjkr2" takes twice this area.
    """

    cohesion_energy_density: Annotated[float, Parameter("J/m^3", at_least=0.0)] = 0.0
    """k in F = k 2 pi R* d."""

    name: ClassVar[str] = "linear_cohesion"
    strength: ClassVar[str] = "cohesion_energy_density"
    attraction: ClassVar[Any] = area_attraction
