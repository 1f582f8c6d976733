"""Grain contours to fill with spheres: closed triangle meshes from files or from measured dimensions."""

import inspect
import io
import math
from collections.abc import Callable
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from trimesh import Trimesh

_FACETS = 48  # sides of a round section: its area is 0.3 % short of the circle's
MILLIMETER = 1e-3

MESH_KINDS = ("stl", "obj", "ply", "off")
"""Endings of mesh files that are read: each holds one surface, and no other file."""

LARGEST_MESH = 50_000_000
"""Bytes of the largest mesh file that is read."""


def read_mesh(path: str | Path, unit: float = MILLIMETER) -> "Trimesh":
    """Read a closed surface from a mesh file.

    Parameters
    ----------
    path
        STL, OBJ, PLY or OFF, of at most `LARGEST_MESH` bytes.
    unit
        Length of the file's unit [m].

    Returns
    -------
    Trimesh
        The surface [m], its faces turned outward.

    Raises
    ------
    ValueError
        If the unit is not positive, the file is not a mesh, or the surface is not closed.
    FileNotFoundError
        If there is no such file.
    """
    if not (math.isfinite(unit) and unit > 0.0):
        raise ValueError(f"unit must be finite and positive [m], got {unit!r}")
    kind = Path(path).suffix.lower().removeprefix(".")
    if not Path(path).is_file():
        raise FileNotFoundError(f"no mesh file {path}")
    if kind not in MESH_KINDS:
        raise ValueError(f"{path}: a mesh file is one of {', '.join(MESH_KINDS)}, got {kind or 'no ending'}")
    if (size := Path(path).stat().st_size) > LARGEST_MESH:
        raise ValueError(f"{path}: a mesh file has at most {LARGEST_MESH:,} bytes, got {size:,}")
    try:
        mesh = _surface(Path(path).read_bytes(), kind)
    except Exception as error:  # each reader of trimesh raises what it likes
        raise ValueError(f"{path}: a mesh file that trimesh reads is needed, got {error!r}") from error
    if mesh is None:
        raise ValueError(f"{path}: the surface must be closed, got one with open or doubled edges")
    if not (np.isfinite(mesh.vertices).all() and np.isfinite(mesh.volume) and mesh.volume > 0.0):
        raise ValueError(f"{path}: the corners must be finite, and the volume positive, got {mesh.volume!r}")
    return mesh.apply_scale(unit)


def _surface(content: bytes, kind: str) -> "Trimesh | None":
    """Return the surface of a file with its faces turned outward; None where it is not closed."""
    import trimesh

    # from memory, so that a file names no other files to be read
    mesh = trimesh.load_mesh(io.BytesIO(content), file_type=kind)
    if not isinstance(mesh, trimesh.Trimesh):
        raise TypeError(f"a {type(mesh).__name__}")
    if not mesh.is_watertight:
        return None
    mesh.fix_normals()
    return mesh


def sphere_mesh(diameter: float) -> "Trimesh":
    """Return a sphere [m]."""
    return ellipsoid_mesh(diameter, diameter, diameter)


def ellipsoid_mesh(length: float, width: float, thickness: float) -> "Trimesh":
    """Return an ellipsoid by its three axes [m], along x, y and z: wheat, beans, soy."""
    import trimesh

    _check_lengths(length=length, width=width, thickness=thickness)
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.5)
    return ball.apply_scale([length, width, thickness])


def cylinder_mesh(length: float, diameter: float) -> "Trimesh":
    """Return a cylinder along z [m]: pellets, cut straw."""
    import trimesh

    _check_lengths(length=length, diameter=diameter)
    return trimesh.creation.cylinder(radius=0.5 * diameter, height=length, sections=_FACETS)


def capsule_mesh(length: float, diameter: float) -> "Trimesh":
    """Return a cylinder along z with round ends, by its length over all [m]: rice, oats."""
    import trimesh

    _check_lengths(length=length, diameter=diameter)
    if length <= diameter:
        raise ValueError(f"length must exceed the diameter {diameter!r} of a capsule, got {length!r}")
    # Of unit diameter first: trimesh merges vertices that are 1e-8 apart.
    slender = trimesh.creation.capsule(length / diameter - 1.0, radius=0.5, count=[_FACETS, _FACETS])
    return slender.apply_scale(diameter)


def tri_pyramid_mesh(height: float, base_edge: float) -> "Trimesh":
    """Return a pyramid over an equilateral triangle, its tip up z [m]: buckwheat and other achenes."""
    import trimesh

    _check_lengths(height=height, base_edge=base_edge)
    turns = np.array([0.25, 0.25 + 1.0 / 3.0, 0.25 + 2.0 / 3.0]) * 2.0 * math.pi
    ring = np.stack([np.cos(turns), np.sin(turns), np.zeros(3)], axis=1) * base_edge / math.sqrt(3.0)
    vertices = np.vstack([ring, [[0.0, 0.0, height]]])
    return trimesh.Trimesh(vertices, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])


SOLIDS: MappingProxyType[str, Callable[..., "Trimesh"]] = MappingProxyType(
    {
        "sphere": sphere_mesh,
        "ellipsoid": ellipsoid_mesh,
        "cylinder": cylinder_mesh,
        "capsule": capsule_mesh,
        "tri-pyramid": tri_pyramid_mesh,
    }
)
"""Solids that dimensions describe, by the name that `parse_solid` takes."""


def parse_solid(text: str) -> "Trimesh":
    """Make a solid from a name and its dimensions in mm, as in ``tri-pyramid:5.90x3.93``.

    Parameters
    ----------
    text
        ``NAME:A[xB[xC]]`` with a name of `SOLIDS` and the dimensions of its function, in that order.

    Returns
    -------
    Trimesh
        The solid [m].

    Raises
    ------
    ValueError
        If the name is unknown, or a dimension is missing, too many, or not a positive number.
    """
    name, _, dimensions = text.partition(":")
    if name not in SOLIDS:
        raise ValueError(f"a solid is one of {', '.join(map(describe_solid, SOLIDS))} [mm], got {text!r}")
    try:
        lengths = [MILLIMETER * float(word) for word in dimensions.split("x")]
        if len(lengths) != len(inspect.signature(SOLIDS[name]).parameters):
            raise ValueError(f"got {len(lengths)} dimensions")
        return SOLIDS[name](*lengths)
    except ValueError as error:
        raise ValueError(f"{text!r} must be {describe_solid(name)} in mm: {error}") from error


def describe_solid(name: str) -> str:
    """Return the pattern of a solid's text, such as ``cylinder:LENGTHxDIAMETER``."""
    dimensions = inspect.signature(SOLIDS[name]).parameters
    return f"{name}:{'x'.join(dimension.upper() for dimension in dimensions)}"


def _check_lengths(**lengths: float) -> None:
    for name, value in lengths.items():
        if not (math.isfinite(value) and value > 0.0):
            raise ValueError(f"{name} must be finite and positive [m], got {value!r}")
