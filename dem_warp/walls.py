"""Boundary surfaces and how they move: their description on the host.

A disc, a cylinder and a cone are all swept by a straight profile that goes around the axis: from `radius`, at
the point, to `upper_radius`, at `length` along the axis.
"""

import math
from dataclasses import dataclass

import numpy as np

Vector = tuple[float, float, float]

PLANE = 0
CYLINDER = 1
CONE = 2


@dataclass(frozen=True)
class Motion:
    """Rigid motion of a wall, which starts from wherever the wall then stands.

    Attributes
    ----------
    velocity : 3 floats
        Of the wall's own `point` [m/s].
    spin : 3 floats
        Rotation about that point [rad/s].
    amplitude : 3 floats
        Of a vibration amplitude * sin(2 pi frequency t) on top, t from the start of the motion [m].
    frequency : float
        [Hz]
    """

    velocity: Vector = (0.0, 0.0, 0.0)
    spin: Vector = (0.0, 0.0, 0.0)
    amplitude: Vector = (0.0, 0.0, 0.0)
    frequency: float = 0.0

    def __post_init__(self) -> None:
        for name in ("velocity", "spin", "amplitude"):
            value = getattr(self, name)
            if np.shape(value) != (3,) or not np.all(np.isfinite(value)):
                raise ValueError(f"Motion.{name}: must be three finite numbers, got {value!r}")
        if not (math.isfinite(self.frequency) and self.frequency >= 0):
            raise ValueError(f"Motion.frequency: must be finite and not negative, got {self.frequency!r}")
        if any(self.amplitude) and self.frequency == 0:
            raise ValueError(f"Motion.frequency: must be positive with amplitude {self.amplitude!r}, got 0")


@dataclass(frozen=True)
class Plane:
    """Infinite plane; grains stand on the side its normal points to.

    Attributes
    ----------
    point : 3 floats
        A point of the plane [m].
    normal : 3 floats
        Its direction; scaled to unit length on the device.
    """

    point: Vector = (0.0, 0.0, 0.0)
    normal: Vector = (0.0, 0.0, 1.0)

    kind = PLANE
    radius = upper_radius = length = 0.0
    reach = math.inf

    def __post_init__(self) -> None:
        _check_vectors(self, "point", "normal")

    @property
    def axis(self) -> Vector:
        """Unit normal."""
        return _unit(self.normal)


@dataclass(frozen=True)
class Disc:
    """Thin round plate, touched from both sides and at its rim, with a round hole if one is asked for.

    Attributes
    ----------
    point : 3 floats
        Its centre [m].
    normal : 3 floats
    radius, inner_radius : float
        Of the plate and of the hole in its middle [m].
    """

    point: Vector
    normal: Vector
    radius: float
    inner_radius: float = 0.0

    kind = CONE
    length = 0.0

    def __post_init__(self) -> None:
        _check_vectors(self, "point", "normal")
        _check_positive(self, "radius")
        if not 0 <= self.inner_radius < self.radius:
            raise ValueError(
                f"Disc.inner_radius: must be from 0 to below the radius {self.radius!r} [m], "
                f"got {self.inner_radius!r}"
            )

    @property
    def axis(self) -> Vector:
        """Unit normal."""
        return _unit(self.normal)

    @property
    def upper_radius(self) -> float:
        """Where the profile ends [m]."""
        return self.inner_radius

    @property
    def reach(self) -> float:
        """Distance of its farthest point from `point` [m]."""
        return self.radius


@dataclass(frozen=True)
class Cylinder:
    """Open, infinitely thin cylinder surface, touched from inside, from outside and at both rims.

    Attributes
    ----------
    point : 3 floats
        Centre of its lower rim [m].
    direction : 3 floats
        Its axis, from the lower rim to the upper.
    radius, length : float
        [m]
    """

    point: Vector
    radius: float
    length: float
    direction: Vector = (0.0, 0.0, 1.0)

    kind = CYLINDER

    def __post_init__(self) -> None:
        _check_vectors(self, "point", "direction")
        _check_positive(self, "radius", "length")

    @property
    def axis(self) -> Vector:
        """Unit axis."""
        return _unit(self.direction)

    @property
    def upper_radius(self) -> float:
        """Where the profile ends [m]."""
        return self.radius

    @property
    def reach(self) -> float:
        """Distance of its farthest point from `point` [m]."""
        return math.hypot(self.radius, self.length)


@dataclass(frozen=True)
class Cone:
    """Open, infinitely thin frustum of a cone, touched from inside, from outside and at both rims.

    A sphere meets it in its nearest point only. So a sphere too large for the narrow end, which in truth
    touches all around, is held from one side at a time.

    Attributes
    ----------
    point : 3 floats
        Centre of its lower rim [m].
    radius, upper_radius : float
        Of the lower rim and of the upper; one of them may be 0, a tip [m].
    length : float
        Along the axis [m].
    direction : 3 floats
        Its axis, from the lower rim to the upper.
    """

    point: Vector
    radius: float
    upper_radius: float
    length: float
    direction: Vector = (0.0, 0.0, 1.0)

    kind = CONE

    def __post_init__(self) -> None:
        _check_vectors(self, "point", "direction")
        _check_positive(self, "length")
        radii = (self.radius, self.upper_radius)
        if not (all(math.isfinite(r) and r >= 0 for r in radii) and any(radii)):
            raise ValueError(
                f"Cone.radius, upper_radius: must be finite, not negative and not both 0 [m], got {radii!r}"
            )

    @property
    def axis(self) -> Vector:
        """Unit axis."""
        return _unit(self.direction)

    @property
    def reach(self) -> float:
        """Distance of its farthest point from `point` [m]."""
        return max(self.radius, math.hypot(self.upper_radius, self.length))


Wall = Plane | Disc | Cylinder | Cone


def _check_vectors(wall: object, place: str, direction: str) -> None:
    kind = type(wall).__name__
    point, vector = getattr(wall, place), getattr(wall, direction)
    if np.shape(point) != (3,) or not np.all(np.isfinite(point)):
        raise ValueError(f"{kind}.{place}: must be three finite numbers [m], got {point!r}")
    if np.shape(vector) != (3,) or not 0 < float(np.linalg.norm(vector)) < math.inf:
        raise ValueError(f"{kind}.{direction}: must be a finite vector of non-zero length, got {vector!r}")


def _check_positive(wall: object, *names: str) -> None:
    for name in names:
        value = getattr(wall, name)
        if not (math.isfinite(value) and value > 0):
            raise ValueError(f"{type(wall).__name__}.{name}: must be positive and finite [m], got {value!r}")


def _unit(vector: Vector) -> Vector:
    x, y, z = (float(c) for c in np.asarray(vector, dtype=float) / np.linalg.norm(vector))
    return x, y, z
