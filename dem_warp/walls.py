"""Boundary surfaces and their motions: the description on the host.

A disc, a cylinder and a cone are swept by a straight profile that goes around the axis: from `radius`, at
the point, to `upper_radius`, at `length` along the axis.
"""

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from dem_warp.parameters import Parameter, check_parameters

Vector = tuple[float, float, float]
Triangles = tuple[tuple[float, ...], ...]
"""Triangles of a surface [m]: the nine coordinates of the corners of each."""

PLANE = 0
CYLINDER = 1
CONE = 2
MESH = 3

THINNEST = 1.0e-9
"""Least value of twice a triangle's area over its longest side squared."""


@dataclass(frozen=True)
class Motion:
    """Rigid motion of a wall from its present place."""

    velocity: Vector = (0.0, 0.0, 0.0)
    """Velocity of the wall's own `point` [m/s]."""
    spin: Vector = (0.0, 0.0, 0.0)
    """Rotation about that point [rad/s]."""
    amplitude: Vector = (0.0, 0.0, 0.0)
    """Amplitude of an added vibration amplitude * sin(2 pi frequency t) from the start of the motion [m]."""
    frequency: float = 0.0
    """Frequency of the vibration [Hz]."""
    duration: float = math.inf
    """Time after which the wall stays in place [s]. Default: the motion has no end."""
    mass: float = 0.0
    """Mass of a free wall, which the forces on it move along z, too, from rest [kg]; 0: it is not free."""
    force: float = 0.0
    """Force on a free wall along z besides that of the grains, its weight included [N]."""

    def __post_init__(self) -> None:
        for name in ("velocity", "spin", "amplitude"):
            value = getattr(self, name)
            if np.shape(value) != (3,) or not np.all(np.isfinite(value)):
                raise ValueError(f"Motion.{name}: must be three finite numbers, got {value!r}")
        Parameter("Hz", at_least=0.0).check("Motion.frequency", self.frequency)
        Parameter("kg", at_least=0.0).check("Motion.mass", self.mass)
        Parameter("N").check("Motion.force", self.force)
        if self.force and not self.mass:
            raise ValueError(f"Motion.mass: must be positive with a force {self.force!r} N, got 0")
        if not self.duration > 0:
            raise ValueError(f"Motion.duration: must be positive [s], got {self.duration!r}")
        if any(self.amplitude) and self.frequency == 0:
            raise ValueError(f"Motion.frequency: must be positive with amplitude {self.amplitude!r}, got 0")


class _Oriented:
    """Surface with a point and a direction."""

    point: Vector
    oriented_by: ClassVar[str] = "direction"
    """Name of the field with the direction."""
    triangle_count: ClassVar[int] = 0

    def __post_init__(self) -> None:
        check_parameters(self)
        kind, vector = type(self).__name__, self._direction
        if np.shape(self.point) != (3,) or not np.all(np.isfinite(self.point)):
            raise ValueError(f"{kind}.point: must be three finite numbers [m], got {self.point!r}")
        if np.shape(vector) != (3,) or not 0 < float(np.linalg.norm(vector)) < math.inf:
            rule = "must be a finite vector of non-zero length"
            raise ValueError(f"{kind}.{self.oriented_by}: {rule}, got {vector!r}")

    @property
    def _direction(self) -> Vector:
        vector: Vector = getattr(self, self.oriented_by)
        return vector

    @property
    def axis(self) -> Vector:
        x, y, z = (
            float(c) for c in np.asarray(self._direction, dtype=float) / np.linalg.norm(self._direction)
        )
        return x, y, z


_Length = Annotated[float, Parameter("m", above=0.0)]
_Radius = Annotated[float, Parameter("m", at_least=0.0)]


@dataclass(frozen=True)
class Plane(_Oriented):
    """Infinite plane; grains are on the side of its normal."""

    point: Vector = (0.0, 0.0, 0.0)
    """A point of the plane [m]."""
    normal: Vector = (0.0, 0.0, 1.0)
    """Direction of the normal; scaled to unit length on the device."""

    kind = PLANE
    oriented_by = "normal"
    radius = upper_radius = length = 0.0
    reach = math.inf


@dataclass(frozen=True)
class Disc(_Oriented):
    """Thin round plate, touched from both sides and at its rim, with an optional round hole."""

    point: Vector
    """Centre [m]."""
    normal: Vector
    radius: _Length
    inner_radius: _Radius = 0.0
    """Radius of the hole in the middle [m]."""

    kind = CONE
    oriented_by = "normal"
    length = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.inner_radius >= self.radius:
            rule = f"must be below the radius {self.radius!r} [m]"
            raise ValueError(f"Disc.inner_radius: {rule}, got {self.inner_radius!r}")

    @property
    def upper_radius(self) -> float:
        """Radius at the end of the profile [m]."""
        return self.inner_radius

    @property
    def reach(self) -> float:
        """Distance of its farthest point from `point` [m]."""
        return self.radius


@dataclass(frozen=True)
class Cylinder(_Oriented):
    """Open, infinitely thin cylinder surface, touched from inside, from outside and at both rims."""

    point: Vector
    """Centre of the lower rim [m]."""
    radius: _Length
    length: _Length
    """Length along the axis [m]."""
    direction: Vector = (0.0, 0.0, 1.0)
    """Direction of the axis, from the lower rim to the upper."""

    kind = CYLINDER

    @property
    def upper_radius(self) -> float:
        """Radius at the end of the profile [m]."""
        return self.radius

    @property
    def reach(self) -> float:
        """Distance of its farthest point from `point` [m]."""
        return math.hypot(self.radius, self.length)


@dataclass(frozen=True)
class Cone(_Oriented):
    """Open, infinitely thin frustum of a cone, touched from inside, from outside and at both rims.

    A sphere touches it at its nearest point only: a sphere too large for the narrow end, which in reality
    touches all around, is held from one side at a time.
    """

    point: Vector
    """Centre of the lower rim [m]."""
    radius: _Radius
    upper_radius: _Radius
    """Radii of the lower and the upper rim [m]; one of them may be 0, a tip."""
    length: _Length
    """Height along the axis [m]."""
    direction: Vector = (0.0, 0.0, 1.0)
    """Direction of the axis, from the lower rim to the upper."""

    kind = CONE

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.radius == self.upper_radius == 0:
            raise ValueError("Cone.radius, upper_radius: must not both be 0 [m]")

    @property
    def reach(self) -> float:
        """Distance of its farthest point from `point` [m]."""
        return max(self.radius, math.hypot(self.upper_radius, self.length))


@dataclass(frozen=True, eq=False)
class Mesh:
    """Thin surface of triangles, touched from both sides, at its edges and at its corners.

    Triangles are joined where they share vertices of equal coordinates. A contact is counted once wherever
    the surface comes nearest to a sphere, so in a concave corner there are several.
    """

    vertices: np.ndarray
    """Corners [m], read-only, shape (n, 3)."""
    faces: np.ndarray
    """Three vertices of each triangle, in either order, read-only, shape (m, 3)."""
    point: Vector = (0.0, 0.0, 0.0)
    """Point that the mesh turns about [m]."""

    kind = MESH
    axis = (0.0, 0.0, 1.0)
    radius = upper_radius = length = 0.0

    def __post_init__(self) -> None:
        vertices, faces = np.array(self.vertices, dtype=float), np.array(self.faces)
        if vertices.ndim != 2 or vertices.shape[1] != 3 or not np.isfinite(vertices).all():
            raise ValueError(f"Mesh.vertices: must be finite, shape (n, 3) [m], got shape {vertices.shape}")
        if faces.ndim != 2 or faces.shape[1] != 3 or not len(faces) or faces.dtype.kind not in "iu":
            raise ValueError(
                f"Mesh.faces: must be integers, shape (m, 3), got {faces.dtype} of shape {faces.shape}"
            )
        if bad := np.flatnonzero(((faces < 0) | (faces >= len(vertices))).any(axis=1)).tolist():
            raise ValueError(
                f"Mesh.faces: must be from 0 to {len(vertices) - 1}, got others in triangles {bad[:5]}"
            )
        a, b, c = np.moveaxis(vertices[faces], 1, 0)
        area, side = (
            np.linalg.norm(np.cross(b - a, c - a), axis=1),
            np.linalg.norm([b - a, c - a, c - b], axis=2),
        )
        if bad := np.flatnonzero(area <= THINNEST * side.max(axis=0) ** 2).tolist():
            raise ValueError(f"Mesh.faces: each must have an area, got triangles {bad[:5]} without")
        for name, array in (("vertices", vertices), ("faces", faces)):
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    @classmethod
    def tube(cls, radius: float, height: float, segments: int) -> "Mesh":
        """Return an upright open tube about the origin with the cross-section of a circle of a radius [m]."""
        if segments < 3:
            raise ValueError(f"Mesh.tube.segments: must be 3 or more, got {segments!r}")
        turn = 2.0 * np.pi / segments
        corner = radius * np.sqrt(turn / np.sin(turn))
        lower = np.arange(segments)
        ring = corner * np.column_stack([np.cos(turn * lower), np.sin(turn * lower)])
        vertices = np.vstack([np.insert(ring, 2, z, axis=1) for z in (0.0, height)])
        after = (lower + 1) % segments
        faces = [[lower, after, lower + segments], [after, after + segments, lower + segments]]
        return cls(vertices, np.concatenate(faces, axis=1).T)

    @classmethod
    def plates(cls, corners: ArrayLike) -> "Mesh":
        """Return flat plates of four corners each, (k, 4, 3) in the order around them [m]."""
        vertices = np.asarray(corners, dtype=float)
        if vertices.ndim != 3 or vertices.shape[1:] != (4, 3):
            raise ValueError(f"Mesh.plates.corners: must have shape (k, 4, 3), got {vertices.shape}")
        first = 4 * np.arange(len(vertices))[:, None]
        faces = np.hstack([first + np.array(triangle) for triangle in ((0, 1, 2), (0, 2, 3))])
        return cls(vertices.reshape(-1, 3), faces.reshape(-1, 3))

    @property
    def triangle_count(self) -> int:
        return len(self.faces)

    @property
    def reach(self) -> float:
        """Distance of its farthest point from `point` [m]."""
        return float(np.linalg.norm(self.vertices - np.array(self.point), axis=1).max())


Wall = Plane | Disc | Cylinder | Cone | Mesh
