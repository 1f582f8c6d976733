"""Boundary surfaces: their description on the host."""

from dataclasses import dataclass

import numpy as np

PLANE = 0
CYLINDER = 1


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

    point: tuple[float, float, float] = (0.0, 0.0, 0.0)
    normal: tuple[float, float, float] = (0.0, 0.0, 1.0)

    kind = PLANE
    radius = 0.0
    length = 0.0

    def __post_init__(self) -> None:
        _check_direction("normal", self.normal)

    @property
    def axis(self) -> tuple[float, float, float]:
        """Unit normal."""
        return _unit(self.normal)


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

    point: tuple[float, float, float]
    radius: float
    length: float
    direction: tuple[float, float, float] = (0.0, 0.0, 1.0)

    kind = CYLINDER

    def __post_init__(self) -> None:
        _check_direction("direction", self.direction)
        for name in ("radius", "length"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise ValueError(f"Cylinder.{name}: must be positive and finite [m], got {value!r}")

    @property
    def axis(self) -> tuple[float, float, float]:
        """Unit axis."""
        return _unit(self.direction)


Wall = Plane | Cylinder


def _check_direction(name: str, vector: tuple[float, float, float]) -> None:
    length = float(np.linalg.norm(vector))
    if not (np.isfinite(length) and length > 0):
        raise ValueError(f"Wall.{name}: must be a finite vector of non-zero length, got {vector!r}")


def _unit(vector: tuple[float, float, float]) -> tuple[float, float, float]:
    x, y, z = (float(c) for c in np.asarray(vector, dtype=float) / np.linalg.norm(vector))
    return x, y, z
