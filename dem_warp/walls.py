"""Boundary surfaces and how they move: their description on the host.

A disc, a cylinder and a cone are swept by a straight profile that goes around the axis: from `radius`, at
the point, to `upper_radius`, at `length` along the axis.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

Vector = tuple[float, float, float]

PLANE = 0
CYLINDER = 1
CONE = 2
MESH = 3

THINNEST = 1.0e-9
"""Twice a triangle's area over its longest side squared, below which it has no plane."""


@dataclass(frozen=True)
class Motion:
    """Rigid motion of a wall, which starts from wherever the wall then stands."""

    velocity: Vector = (0.0, 0.0, 0.0)
    """Velocity of the wall's own `point` [m/s]."""
    spin: Vector = (0.0, 0.0, 0.0)
    """Rotation about that point [rad/s]."""
    amplitude: Vector = (0.0, 0.0, 0.0)
    """Of a vibration amplitude * sin(2 pi frequency t) on top, t from the start of the motion [m]."""
    frequency: float = 0.0
    """Frequency of the vibration [Hz]."""
    duration: float = math.inf
    """After this time the wall stays where it then is [s]; by default the motion has no end."""

    def __post_init__(self) -> None:
        for name in ("velocity", "spin", "amplitude"):
            value = getattr(self, name)
            if np.shape(value) != (3,) or not np.all(np.isfinite(value)):
                raise ValueError(f"Motion.{name}: must be three finite numbers, got {value!r}")
        if not (math.isfinite(self.frequency) and self.frequency >= 0):
            raise ValueError(f"Motion.frequency: must be finite and not negative, got {self.frequency!r}")
        if not self.duration > 0:
            raise ValueError(f"Motion.duration: must be positive [s], got {self.duration!r}")
        if any(self.amplitude) and self.frequency == 0:
            raise ValueError(f"Motion.frequency: must be positive with amplitude {self.amplitude!r}, got 0")


@dataclass(frozen=True)
class Plane:
    """Infinite plane; grains stand on the side its normal points to."""

    point: Vector = (0.0, 0.0, 0.0)
    """A point of the plane [m]."""
    normal: Vector = (0.0, 0.0, 1.0)
    """Direction of the normal; scaled to unit length on the device."""

    kind = PLANE
    triangle_count = 0
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
    """Thin round plate, touched from both sides and at its rim, with a round hole if one is asked for."""

    point: Vector
    """Its centre [m]."""
    normal: Vector
    radius: float
    inner_radius: float = 0.0
    """Radii of the plate and of the hole in its middle [m]."""

    kind = CONE
    triangle_count = 0
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
        """End of the profile [m]."""
        return self.inner_radius

    @property
    def reach(self) -> float:
        """Distance of its farthest point from `point` [m]."""
        return self.radius


@dataclass(frozen=True)
class Cylinder:
    """Open, infinitely thin cylinder surface, touched from inside, from outside and at both rims."""

    point: Vector
    """Centre of its lower rim [m]."""
    radius: float
    length: float
    """[m]."""
    direction: Vector = (0.0, 0.0, 1.0)
    """Direction of the axis, from the lower rim to the upper."""

    kind = CYLINDER
    triangle_count = 0

    def __post_init__(self) -> None:
        _check_vectors(self, "point", "direction")
        _check_positive(self, "radius", "length")

    @property
    def axis(self) -> Vector:
        """Unit axis."""
        return _unit(self.direction)

    @property
    def upper_radius(self) -> float:
        """End of the profile [m]."""
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
    """

    point: Vector
    """Centre of its lower rim [m]."""
    radius: float
    upper_radius: float
    """Radii of the lower rim and of the upper; one of them may be 0, a tip [m]."""
    length: float
    """Height along the axis [m]."""
    direction: Vector = (0.0, 0.0, 1.0)
    """Direction of the axis, from the lower rim to the upper."""

    kind = CONE
    triangle_count = 0

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


@dataclass(frozen=True, eq=False)
class Mesh:
    """Thin surface of triangles, touched from both sides, at its edges and at its corners.

    Triangles are joined where they share vertices of equal coordinates. A contact is counted once wherever
    the surface comes nearest to a sphere, so in a concave corner there are several.
    """

    vertices: np.ndarray
    """[m], read-only, shape (n, 3)."""
    faces: np.ndarray
    """Three vertices of each triangle, either way around, read-only, shape (m, 3)."""
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
            raise ValueError(f"Mesh.faces: must span an area, triangles {bad[:5]} do not")
        for name, array in (("vertices", vertices), ("faces", faces)):
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    @classmethod
    def tube(cls, radius: float, height: float, segments: int) -> "Mesh":
        """Upright open tube about the origin, its cross-section that of a round one of this radius [m]."""
        if segments < 3:
            raise ValueError(f"Mesh.tube: must have 3 segments or more, got {segments!r}")
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
        """Flat plates of four corners each, (k, 4, 3) in the order around them [m]."""
        vertices = np.asarray(corners, dtype=float)
        if vertices.ndim != 3 or vertices.shape[1:] != (4, 3):
            raise ValueError(f"Mesh.plates: must have shape (k, 4, 3), got {vertices.shape}")
        first = 4 * np.arange(len(vertices))[:, None]
        faces = np.hstack([first + np.array(triangle) for triangle in ((0, 1, 2), (0, 2, 3))])
        return cls(vertices.reshape(-1, 3), faces.reshape(-1, 3))

    @property
    def triangle_count(self) -> int:
        """Number of triangles."""
        return len(self.faces)

    @property
    def reach(self) -> float:
        """Distance of its farthest point from `point` [m]."""
        return float(np.linalg.norm(self.vertices - np.array(self.point), axis=1).max())


Wall = Plane | Disc | Cylinder | Cone | Mesh


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
