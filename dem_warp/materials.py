"""Bulk materials, pairs of surfaces, and the contact constants that follow from them."""

import math
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
