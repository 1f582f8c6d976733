"""Cohesion in proportion to the contact area."""

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import warp as wp

from dem_warp.laws.mechanism import Mechanism


@wp.func
def area_attraction(params: Any, contact: Any, memory: Any, at: int):
    """Attraction k A [N] on the circle A = 2 pi R* d in which the two spheres cut each other."""
    zero = type(contact.overlap)(0.0)
    area = type(contact.overlap)(2.0 * math.pi) * contact.radius * wp.max(contact.overlap, zero)
    return params.cohesion_energy_density * area


@dataclass(frozen=True, kw_only=True)
class LinearCohesion(Mechanism):
    """Surfaces attract each other with a constant pressure over their contact area ("simplified JKR", SJKR).

    Attributes
    ----------
    cohesion_energy_density : float
        k in F = k 2 pi R* d [J/m3 = Pa].

    Notes
    -----
    The area is that of the circle of intersection, to first order in d / R*; twice the area of the Hertz
    contact. The attraction vanishes with the overlap: there is none beyond contact.

    Source: LIGGGHTS documentation, "cohesion sjkr"; JKR in its linear form.
    """

    cohesion_energy_density: float = 0.0

    name: ClassVar[str] = "linear_cohesion"
    strength: ClassVar[str] = "cohesion_energy_density"
    attraction: ClassVar[Any] = area_attraction
