"""Grain shapes: rigid sets of spheres with the mass properties of their union."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import permutations
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from dem_warp.parameters import Parameter
from dem_warp.reading import read_text
from dem_warp.sphere_union import DEFAULT_RESOLUTION, Array, union_moments

MOST_SPHERES = 256
"""Most spheres of a clump in a file."""

_MILLIMETER = 1e-3
_LARGEST, _SMALLEST = 1e6, 1e-6  # [mm] in a file: volume and moments stay within the range of floats
_MOMENT_TOLERANCE = 1e-4  # of the largest moment: smaller differences and products of inertia count as 0


@dataclass(frozen=True, eq=False)
class ClumpShape:
    """Rigid set of spheres in its principal frame, the centre of mass of their union at the origin.

    `from_spheres`, `read` and `sphere` compute the mass properties and the frame. Two shapes are equal when
    their spheres are.
    """

    centers: Array
    """Sphere centres [m], shape (S, 3), read-only."""
    radii: Array
    """Sphere radii [m], shape (S,), read-only."""
    volume: float
    """Volume of the union [m3]."""
    inertia_over_mass: Array
    """Principal moments of inertia over the mass [m2], shape (3,), read-only."""

    def __post_init__(self) -> None:
        centers, radii = _checked_spheres(self.centers, self.radii)
        moments = np.array(self.inertia_over_mass, dtype=np.float64)
        if moments.shape != (3,) or not (np.isfinite(moments) & (moments > 0.0)).all():
            rule = "must be three positive moments [m2]"
            raise ValueError(f"ClumpShape.inertia_over_mass: {rule}, got {moments.tolist()}")
        Parameter("m^3", above=0.0).check("ClumpShape.volume", self.volume)
        for name, array in (("centers", centers), ("radii", radii), ("inertia_over_mass", moments)):
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, ClumpShape):
            return NotImplemented
        return np.array_equal(self.centers, other.centers) and np.array_equal(self.radii, other.radii)

    def __hash__(self) -> int:
        return hash((self.centers.tobytes(), self.radii.tobytes()))

    @property
    def sphere_count(self) -> int:
        return len(self.radii)

    @property
    def bounding_radius(self) -> float:
        """Radius of the smallest sphere about the centre of mass that holds the clump [m]."""
        return float((np.linalg.norm(self.centers, axis=1) + self.radii).max())

    def to_dict(self) -> dict[str, Any]:
        """Return the spheres, which determine the shape, as plain lists [m]."""
        return {"centers": self.centers.tolist(), "radii": self.radii.tolist()}

    @classmethod
    def sphere(cls, radius: float) -> "ClumpShape":
        """Return the shape of one sphere of a radius [m]."""
        return cls.from_spheres(np.zeros((1, 3)), [radius])

    @classmethod
    def from_spheres(
        cls, centers: ArrayLike, radii: ArrayLike, resolution: int = DEFAULT_RESOLUTION
    ) -> "ClumpShape":
        """Build a shape from spheres in any frame, (S, 3) and (S,) [m]; their order stays.

        They are moved and turned into the principal frame of their union that is nearest to the given frame:
        axes are not sorted, and principal axes stay, within 1e-4 of the largest moment. `resolution` is that
        of `sphere_union.union_moments`; 64 gives a relative error below 1e-4.

        Raises
        ------
        ValueError
            If the arrays do not fit, or a value is not finite, or a radius not positive.
        """
        centers, radii = _checked_spheres(centers, radii)
        moments = union_moments(centers, radii, resolution)
        axes = _principal_axes(moments.inertia_over_mass)
        principal = np.einsum("ia,ij,ja->a", axes, moments.inertia_over_mass, axes)
        return cls((centers - moments.center) @ axes, radii, moments.volume, principal)

    def elongated(self, elongation: float) -> "ClumpShape":
        """Return the shape stretched along its longest principal axis, with the same volume.

        `elongation` is the relative stretch of the centres; it must be 0 for a single sphere.
        """
        Parameter("1", at_least=0.0).check("elongation", elongation)
        if elongation == 0.0:
            return self
        if self.sphere_count == 1:
            raise ValueError(f"elongation: must be 0 for a shape of one sphere, got {elongation!r}")
        stretch = np.ones(3)
        stretch[np.argmin(self.inertia_over_mass)] += elongation
        drawn = ClumpShape.from_spheres(self.centers * stretch, self.radii)
        scale = np.cbrt(self.volume / drawn.volume)
        return ClumpShape(
            drawn.centers * scale, drawn.radii * scale, self.volume, drawn.inertia_over_mass * scale**2
        )

    def scaled(self, scale: float) -> "ClumpShape":
        """Return the shape scaled by a factor, in the same frame."""
        moments = self.inertia_over_mass * scale**2
        return ClumpShape(self.centers * scale, self.radii * scale, self.volume * scale**3, moments)

    @classmethod
    def read(cls, path: str | Path) -> "ClumpShape":
        """Read spheres in any frame, one per line: ``x y z r`` in mm; ``#`` starts a comment.

        A ValueError names the file and the line; FileNotFoundError is raised without a file.
        """
        rows = []
        for number, line in enumerate(read_text(path).splitlines(), start=1):
            words = line.partition("#")[0].split()
            if words:
                rows.append(_parse_sphere(words, f"{path}, line {number}"))
            if len(rows) > MOST_SPHERES:
                raise ValueError(f"{path}: must have at most {MOST_SPHERES} spheres, got more")
        if not rows:
            raise ValueError(f"{path}: must have at least one line 'x y z r' [mm]")
        spheres = np.array(rows) * _MILLIMETER
        return cls.from_spheres(spheres[:, :3], spheres[:, 3])

    def write(self, path: str | Path) -> None:
        """Write the spheres for `read`, with the mass properties in comments; replace an existing file."""
        moments = " ".join(f"{moment / _MILLIMETER**2:.6g}" for moment in self.inertia_over_mass)
        lines = [
            "# Clump: x y z r of each sphere in mm, origin at the centre of mass, principal axes.",
            f"# Union: volume {self.volume / _MILLIMETER**3:.6g} mm3, inertia over mass {moments} mm2.",
        ]
        for (x, y, z), r in zip(self.centers / _MILLIMETER, self.radii / _MILLIMETER, strict=True):
            lines.append(f"{x:.9f} {y:.9f} {z:.9f} {r:.9f}")
        Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")


def stack_spheres(shapes: Sequence[ClumpShape]) -> Array:
    """Return local centres and radii of the spheres of several shapes [m], (shapes, S, 4).

    S is the largest number of spheres of a shape; the others are padded with zeros.
    """
    spheres = np.zeros((len(shapes), max(shape.sphere_count for shape in shapes), 4))
    for row, shape in zip(spheres, shapes, strict=True):
        row[: shape.sphere_count] = np.column_stack([shape.centers, shape.radii])
    return spheres


def _checked_spheres(centers: ArrayLike, radii: ArrayLike) -> tuple[Array, Array]:
    """Copy spheres into float64 arrays (S, 3) and (S,) or say which one breaks which rule."""
    centers, radii = np.array(centers, dtype=np.float64), np.array(radii, dtype=np.float64)
    if radii.ndim != 1 or radii.size == 0 or centers.shape != (radii.size, 3):
        raise ValueError(
            "ClumpShape.centers, radii: must have shapes (S, 3) and (S,) with S >= 1, "
            f"got {centers.shape} and {radii.shape}"
        )
    for index, (center, radius) in enumerate(zip(centers, radii, strict=True)):
        if not np.isfinite(center).all():
            raise ValueError(f"ClumpShape.centers[{index}]: must be finite [m], got {center.tolist()}")
        Parameter("m", above=0.0).check(f"ClumpShape.radii[{index}]", float(radius))
    return centers, radii


def _parse_sphere(words: list[str], place: str) -> list[float]:
    try:
        row = [float(word) for word in words]
    except ValueError:
        row = []
    if len(row) != 4 or not np.isfinite(row).all() or row[3] <= 0.0:
        rule = "must be four finite numbers 'x y z r' [mm] with r > 0"
        raise ValueError(f"{place}: {rule}, got {' '.join(words)!r}")
    if max(map(abs, row)) > _LARGEST or row[3] < _SMALLEST:
        rule = f"must be within {_LARGEST:g} mm, with r at least {_SMALLEST:g} mm"
        raise ValueError(f"{place}: {rule}, got {' '.join(words)!r}")
    return row


def _principal_axes(inertia: Array) -> Array:
    """Return the principal axes nearest to the present ones as the columns of a rotation matrix."""
    moments, vectors = np.linalg.eigh(inertia)
    products = inertia - np.diag(np.diag(inertia))
    if np.abs(products).max() <= _MOMENT_TOLERANCE * moments[-1]:
        return np.eye(3)
    apart = np.diff(moments) > _MOMENT_TOLERANCE * moments[-1]
    groups = np.concatenate([[0], np.cumsum(apart)])  # a number for each set of equal moments
    projectors = [vectors[:, groups == g] @ vectors[:, groups == g].T for g in range(groups[-1] + 1)]
    # slots[a] is the moment of axis a: the assignment that turns the axes least; by rounding, the first of a
    # tie wins whatever the last bits
    slots = max(
        permutations(range(3)),
        key=lambda slots: round(float(sum(projectors[groups[s]][a, a] for a, s in enumerate(slots))), 9),
    )
    axes = np.empty((3, 3))
    for group, projector in enumerate(projectors):
        taken = [a for a, s in enumerate(slots) if groups[s] == group]
        left, _, right = np.linalg.svd(projector[:, taken], full_matrices=False)
        axes[:, taken] = left @ right  # the orthonormal basis of the eigenspace nearest to the axes taken
    if np.linalg.det(axes) < 0.0:
        axes[:, np.argmin(np.diag(axes))] *= -1.0
    return axes
