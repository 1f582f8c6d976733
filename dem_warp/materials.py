"""Bulk materials, pairs of surfaces, and the contact constants that follow from them."""

import functools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated

from dem_warp.parameters import Parameter, check_parameters


@dataclass(frozen=True)
class Material:
    """Isotropic, linearly elastic solid."""

    density: Annotated[float, Parameter("kg/m^3", above=0.0)]
    """Density of the solid."""
    shear_modulus: Annotated[float, Parameter("Pa", above=0.0)]
    """Shear modulus."""
    poisson_ratio: Annotated[float, Parameter("1", above=-1.0, at_most=0.5)]
    """Poisson's ratio; the limits are those of a stable isotropic solid."""

    def __post_init__(self) -> None:
        check_parameters(self)

    @property
    def youngs_modulus(self) -> float:
        """Young's modulus [Pa], ``2 G (1 + v)``."""
        return 2.0 * self.shear_modulus * (1.0 + self.poisson_ratio)


_RESTITUTION = Parameter("1", above=0.0, at_most=1.0)


@dataclass(frozen=True)
class Interaction:
    """Contact properties of one pair of surfaces."""

    restitution: Annotated[float, _RESTITUTION]
    """Coefficient of restitution; 1 is without damping."""
    static_friction: Annotated[float, Parameter("1", at_least=0.0)]
    """Coulomb coefficient of static friction."""
    rolling_friction: Annotated[float, Parameter("1", at_least=0.0)]
    """Coefficient of rolling friction."""

    def __post_init__(self) -> None:
        check_parameters(self)


@dataclass(frozen=True)
class WallPart:
    """Named part of the walls with its own material."""

    name: str
    """Name in the scene, e.g. ``"ends"`` of a drum."""
    material: Material
    """Material of the part."""
    surface: Interaction
    """Contact of grains with the part."""


def rayleigh_time(radius: float, material: Material) -> float:
    """Return the time of a Rayleigh wave over half a sphere's circumference [s].

    It is ``pi R sqrt(rho / G) / (0.1631 v + 0.8766)`` for a radius [m].

    References
    ----------
    Thornton and Randall (1988), in Micromechanics of Granular Materials, 133-142.
    """
    Parameter("m", above=0.0).check("rayleigh_time.radius", radius)
    speed_ratio = 0.1631 * material.poisson_ratio + 0.8766
    return math.pi * radius * math.sqrt(material.density / material.shear_modulus) / speed_ratio


def effective_moduli(a: Material, b: Material) -> tuple[float, float]:
    """Return the effective Young's and shear moduli of two bodies in contact, E* and G* [Pa].

    ``1/E* = (1 - va^2)/Ea + (1 - vb^2)/Eb`` and ``1/G* = (2 - va)/Ga + (2 - vb)/Gb``.

    References
    ----------
    Johnson (1985), Contact Mechanics, equations 4.22 (normal) and 7.43 (tangential, no slip).
    """
    youngs_compliance = sum((1.0 - m.poisson_ratio**2) / m.youngs_modulus for m in (a, b))
    shear_compliance = sum((2.0 - m.poisson_ratio) / m.shear_modulus for m in (a, b))
    return 1.0 / youngs_compliance, 1.0 / shear_compliance


def damping_coefficient(restitution: float) -> float:
    """Return the dimensionless damping that gives a Hertz contact a restitution.

    It is ``2 sqrt(5/6) |beta|`` with ``beta = ln e / sqrt(ln^2 e + pi^2)``; the damping force is this, times
    ``sqrt(S m*)`` (contact stiffness, effective mass), times the relative speed.

    References
    ----------
    Tsuji, Tanaka and Ishida (1992), Powder Technology 71, 239-250, in the form of EDEM's Hertz-Mindlin model.
    """
    _RESTITUTION.check("restitution", restitution)
    log_restitution = math.log(restitution)
    return 2.0 * math.sqrt(5.0 / 6.0) * abs(log_restitution) / math.hypot(log_restitution, math.pi)


TSUJI_POLYNOMIAL = (4.8218, -18.022, 27.467, -22.348, 11.087, -4.2783, 1.2728)
"""Fit by LAMMPS of Tsuji's damping over sqrt(4/3 E* sqrt(R* d) m*), highest power of restitution first."""

THORNTON_POLYNOMIAL = (
    -1489.915, 6276.757, -11342.18, 11494.29, -7206.864, 2928.711, -796.4559, 146.8049, -16.41105, -6.918798,
    0.0,
)  # fmt: skip
"""Thornton's fit of the exponent in Yade's damping ratio, highest power first."""


def tsuji_damping(restitution: float) -> float:
    """Return the damping of `damping_coefficient` that LAMMPS uses for a restitution.

    References
    ----------
    LAMMPS (2022-01-06), src/GRANULAR/pair_granular.cpp, lines 987-991, damping tsuji.
    """
    _RESTITUTION.check("restitution", restitution)
    return math.sqrt(2.0 / 3.0) * max(_polynomial(TSUJI_POLYNOMIAL, restitution), 0.0)


def thornton_damping(restitution: float) -> float:
    """Return the damping of `damping_coefficient` that Yade uses for a restitution, without attraction.

    References
    ----------
    C. Thornton, S. J. Cummins and P. W. Cleary, Powder Technology 233 (2013) 30-46, equations B6 and B7;
    Yade, pkg/dem/HertzMindlin.cpp, Ip2_FrictMat_FrictMat_MindlinPhys::go.
    """
    _RESTITUTION.check("restitution", restitution)
    if restitution == 1.0:
        return 0.0
    exponent = _polynomial(THORNTON_POLYNOMIAL, restitution)
    return 2.0 * math.sqrt(1.0 / (1.0 - (1.0 + restitution) ** 2 * math.exp(exponent)) - 1.0)


def _polynomial(coefficients: tuple[float, ...], x: float) -> float:
    return functools.reduce(lambda total, coefficient: total * x + coefficient, coefficients, 0.0)


DAMPINGS: Mapping[str, Callable[[float], float]] = {
    "closed_form": damping_coefficient,
    "polynomial": tsuji_damping,
    "thornton": thornton_damping,
}
"""Dimensionless damping from the restitution, by the name in `ContactLaws.restitution`."""
