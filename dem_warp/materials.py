"""Bulk materials, pairs of surfaces, and the contact constants that follow from them."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass


def _require(holds: bool, rule: str, name: str, value: float) -> None:
    if not holds:
        raise ValueError(f"{name} must be {rule}, got {value!r}")


def _is_positive(value: float) -> bool:
    return math.isfinite(value) and value > 0.0


@dataclass(frozen=True)
class Material:
    """An isotropic, linearly elastic solid.

    Raises
    ------
    ValueError
        If a value lies outside its range.
    """

    density: float
    """Mass of the solid by its volume [kg/m3], positive."""
    shear_modulus: float
    """Shear modulus [Pa], positive."""
    poisson_ratio: float
    """Poisson's ratio, above -1 and at most 0.5, the limits of a stable isotropic solid."""

    def __post_init__(self) -> None:
        _require(_is_positive(self.density), "finite and positive [kg/m3]", "density", self.density)
        _require(
            _is_positive(self.shear_modulus), "finite and positive [Pa]", "shear_modulus", self.shear_modulus
        )
        _require(
            -1.0 < self.poisson_ratio <= 0.5, "above -1 and at most 0.5", "poisson_ratio", self.poisson_ratio
        )

    @property
    def youngs_modulus(self) -> float:
        """Young's modulus [Pa], ``2 G (1 + v)``."""
        return 2.0 * self.shear_modulus * (1.0 + self.poisson_ratio)


@dataclass(frozen=True)
class Interaction:
    """Contact properties of one pair of surfaces.

    Raises
    ------
    ValueError
        If a value lies outside its range.
    """

    restitution: float
    """Coefficient of restitution, above 0 (whose damping would be critical) and at most 1 (none)."""
    static_friction: float
    """Coulomb coefficient of static friction, 0 or more."""
    rolling_friction: float
    """Coefficient of rolling friction, 0 or more."""

    def __post_init__(self) -> None:
        _require(0.0 < self.restitution <= 1.0, "above 0 and at most 1", "restitution", self.restitution)
        for name in ("static_friction", "rolling_friction"):
            value = getattr(self, name)
            _require(math.isfinite(value) and value >= 0.0, "finite and 0 or more", name, value)


@dataclass(frozen=True)
class WallPart:
    """Walls of one name that are of another material than the rest."""

    name: str
    """Name that the scene has for them, as ``"ends"`` of a drum."""
    material: Material
    """Their material."""
    surface: Interaction
    """Contact of grains with them."""


def rayleigh_time(radius: float, material: Material) -> float:
    """Time that a Rayleigh wave takes to cross a sphere's half circumference.

    Parameters
    ----------
    radius
        Radius of the sphere [m], positive.
    material
        Material of the sphere.

    Returns
    -------
    float
        ``pi R sqrt(rho / G) / (0.1631 v + 0.8766)`` [s].

    Raises
    ------
    ValueError
        If the radius is not finite and positive.

    References
    ----------
    Thornton and Randall (1988), in Micromechanics of Granular Materials, 133-142; the time step of a
    simulation is a fraction of it.
    """
    _require(_is_positive(radius), "finite and positive [m]", "radius", radius)
    speed_ratio = 0.1631 * material.poisson_ratio + 0.8766
    return math.pi * radius * math.sqrt(material.density / material.shear_modulus) / speed_ratio


def effective_moduli(a: Material, b: Material) -> tuple[float, float]:
    """Effective Young's and shear moduli of two bodies in contact.

    Returns
    -------
    tuple of float
        ``E*`` and ``G*`` [Pa], from ``1/E* = (1 - va^2)/Ea + (1 - vb^2)/Eb`` and
        ``1/G* = (2 - va)/Ga + (2 - vb)/Gb``.

    References
    ----------
    Johnson (1985), Contact Mechanics, equations 4.22 (normal) and 7.43 (tangential, no slip).
    """
    youngs_compliance = sum((1.0 - m.poisson_ratio**2) / m.youngs_modulus for m in (a, b))
    shear_compliance = sum((2.0 - m.poisson_ratio) / m.shear_modulus for m in (a, b))
    return 1.0 / youngs_compliance, 1.0 / shear_compliance


def damping_coefficient(restitution: float) -> float:
    """Dimensionless damping that gives a Hertz contact the restitution asked for.

    Parameters
    ----------
    restitution
        Coefficient of restitution, above 0 and at most 1.

    Returns
    -------
    float
        ``2 sqrt(5/6) |beta|`` with ``beta = ln e / sqrt(ln^2 e + pi^2)``; the damping force is this, times
        ``sqrt(S m*)`` (contact stiffness, effective mass), times the relative speed. 0 at ``e = 1``.

    Raises
    ------
    ValueError
        If the restitution lies outside its range.

    References
    ----------
    Tsuji, Tanaka and Ishida (1992), Powder Technology 71, 239-250, in the form of the Hertz-Mindlin
    (no slip) model of EDEM.
    """
    _require(0.0 < restitution <= 1.0, "above 0 and at most 1", "restitution", restitution)
    log_restitution = math.log(restitution)
    return 2.0 * math.sqrt(5.0 / 6.0) * abs(log_restitution) / math.hypot(log_restitution, math.pi)


TSUJI_POLYNOMIAL = (4.8218, -18.022, 27.467, -22.348, 11.087, -4.2783, 1.2728)
"""LAMMPS' fit of Tsuji's damping over sqrt(4/3 E* sqrt(R* d) m*), highest power of the restitution first."""

THORNTON_POLYNOMIAL = (
    -1489.915, 6276.757, -11342.18, 11494.29, -7206.864, 2928.711, -796.4559, 146.8049, -16.41105, -6.918798,
    0.0,
)  # fmt: skip
"""Thornton's fit of the exponent that Yade takes the damping ratio from, highest power first."""


def tsuji_damping(restitution: float) -> float:
    """Dimensionless damping that LAMMPS takes for a restitution, as `damping_coefficient` has it.

    Raises
    ------
    ValueError
        If the restitution lies outside its range.

    References
    ----------
    LAMMPS (2022-01-06), src/GRANULAR/pair_granular.cpp, lines 987-991, damping tsuji.
    """
    _require(0.0 < restitution <= 1.0, "above 0 and at most 1", "restitution", restitution)
    return math.sqrt(2.0 / 3.0) * max(_polynomial(TSUJI_POLYNOMIAL, restitution), 0.0)


def thornton_damping(restitution: float) -> float:
    """Dimensionless damping that Yade takes for a restitution, as `damping_coefficient` has it.

    It gives the restitution to a damping that never attracts.

    Raises
    ------
    ValueError
        If the restitution lies outside its range.

    References
    ----------
    C. Thornton, S. J. Cummins and P. W. Cleary, Powder Technology 233 (2013) 30-46, equations B6 and B7;
    Yade, pkg/dem/HertzMindlin.cpp, Ip2_FrictMat_FrictMat_MindlinPhys::go.
    """
    _require(0.0 < restitution <= 1.0, "above 0 and at most 1", "restitution", restitution)
    if restitution == 1.0:
        return 0.0
    exponent = _polynomial(THORNTON_POLYNOMIAL, restitution)
    return 2.0 * math.sqrt(1.0 / (1.0 - (1.0 + restitution) ** 2 * math.exp(exponent)) - 1.0)


def _polynomial(coefficients: tuple[float, ...], x: float) -> float:
    total = 0.0
    for coefficient in coefficients:
        total = total * x + coefficient
    return total


DAMPINGS: Mapping[str, Callable[[float], float]] = {
    "closed_form": damping_coefficient,
    "polynomial": tsuji_damping,
    "thornton": thornton_damping,
}
"""Dimensionless damping from the restitution, by the name that the conventions give it."""
