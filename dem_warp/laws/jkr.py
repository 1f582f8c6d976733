"""Adhesion of elastic spheres after Johnson, Kendall and Roberts (JKR)."""

import math
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import warp as wp

from dem_warp.laws.bond import bonded
from dem_warp.laws.mechanism import Mechanism
from dem_warp.parameters import Parameter

PULL_OFF = 0.75 * 4.0 ** (-1.0 / 3.0)
"""Largest distance of two surfaces in contact, over s^2 / R*, at p = 4^(-2/3)."""

DEEPEST = 1.0e8
"""Overlap over s^2 / R* beyond which the attraction is pi W R* to 1e-6; cubes of more exceed float32."""


@wp.func
def adhesive_span(work: Any, radius: Any, modulus: Any):
    """Return the unit of length s = (2 pi W R*^2 / E*)^(1/3) [m] of contact radii."""
    return wp.cbrt(type(work)(2.0) * type(work)(math.pi) * work * radius * radius / modulus)


@wp.func
def relative_contact_radius(depth: Any):
    """Return the larger p with p^2 - sqrt(p) = `depth`, for depth >= -PULL_OFF: the stable contact.

    With x = sqrt(p), x^4 - x - depth is the product of x^2 + u x + v and x^2 - u x + w, where u^2 is the only
    positive root of y^3 + 4 depth y = 1, from Cardano's formula without cancellation.
    """
    half = type(depth)(0.5)
    zero = type(depth)(0.0)
    third = type(depth)(4.0) * depth / type(depth)(3.0)
    c = wp.cbrt(half + wp.sqrt(wp.max(type(depth)(0.25) + third * third * third, zero)))
    y = c - third / c
    if depth > zero:
        y = type(depth)(1.0) / (c * c + third + third * third / (c * c))
    u = wp.sqrt(y)
    x = half * (u + wp.sqrt(wp.max(type(depth)(2.0) / u - y, zero)))
    return x * x


@wp.func
def relative_attraction(depth: Any):
    """Return Hertz's force less JKR's at the same overlap, over pi W R*: 5/6 to 3/2."""
    p = relative_contact_radius(depth)
    shape = p * (p * p - type(depth)(3.0) * depth)
    if depth > type(depth)(0.0):
        h = wp.sqrt(depth)
        shape = p * (p + type(depth)(2.0) * h) / ((p + h) * (p + h))
    return type(depth)(4.0) / type(depth)(3.0) * shape


@wp.func
def jkr_attraction(params: Any, contact: Any, memory: Any, at: int):
    """Return Hertz's force less JKR's [N]; 0 before the surfaces touch."""
    work = params.work_of_adhesion
    zero = type(work)(0.0)
    if work <= zero:
        return zero
    span = adhesive_span(work, contact.radius, params.modulus)
    unit = span * span / contact.radius
    if not bonded(contact, type(work)(PULL_OFF) * unit, memory, at):
        return zero
    depth = wp.clamp(contact.overlap / unit, -type(work)(PULL_OFF), type(work)(DEEPEST))
    return type(work)(math.pi) * work * contact.radius * relative_attraction(depth)


@dataclass(frozen=True, kw_only=True)
class JKR(Mechanism):
    """Adhesion of elastic spheres, on a contact area that it enlarges.

    Notes
    -----
    With the contact radius a, the force and the overlap are ::

        F = 4 E* a^3 / (3 R*) - sqrt(8 pi W E* a^3)
        d = a^2 / R* - sqrt(2 pi W a / E*)

    The surfaces adhere from their first touch (d = 0, F = -(4/3) pi W R*) down to d = -0.4725 s^2 / R*, with
    s^3 = 2 pi W R*^2 / E*, where they separate. The largest pull is (3/2) pi W R*; an unloaded contact rests
    at a^3 = 9 pi W R*^2 / (2 E*), d = a^2 / (3 R*). An impact loses 7.09 (W^5 R*^4 / E*^2)^(1/3) [J] to it,
    or does not separate the surfaces.

    It is an attraction in addition to Hertz's force: damping and friction are those of Hertz's contact at the
    same overlap and end at d = 0, under 8/9 of the largest pull. With p = a / s and h = sqrt(d R*) / s the
    attraction, over pi W R*, is (4/3) p (p + 2 h) / (p + h)^2 in an overlap and (4/3) p (p^2 - 3 d R* / s^2)
    beyond it. A grain of several spheres adheres with each sphere that touches.

    Sources: K. L. Johnson, K. Kendall and A. D. Roberts, Proc. R. Soc. A 324 (1971) 301-313; the contact
    radius in closed form after E. J. R. Parteli et al., Scientific Reports 4 (2014) 6227; the energy of an
    impact: C. Thornton and Z. Ning, Powder Technology 99 (1998) 154-162.
    """

    work_of_adhesion: Annotated[float, Parameter("J/m^2", at_least=0.0)] = 0.0
    """Work W to separate two surfaces: twice the surface energy of equal ones, W = 2 gamma."""

    name: ClassVar[str] = "jkr"
    strength: ClassVar[str] = "work_of_adhesion"
    memory_size: ClassVar[int] = 1
    acts_apart: ClassVar[bool] = True
    excludes: ClassVar[tuple[str, ...]] = ("hysteretic_spring",)
    attraction: ClassVar[Any] = jkr_attraction

    def reach(self, largest_radius: float, modulus: float) -> float:
        """Return the distance [m] at which two surfaces separate, for the largest sphere on a wall."""
        span = (2.0 * math.pi * self.work_of_adhesion * largest_radius**2 / modulus) ** (1.0 / 3.0)
        return PULL_OFF * span**2 / largest_radius
