"""Grain contours: closed triangle meshes from files or from measured dimensions."""

import inspect
import io
import math
from collections.abc import Callable
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from dem_warp.parameters import Parameter

if TYPE_CHECKING:
    from trimesh import Trimesh

_FACETS = 48  # sides of a round section: its area is 0.3 % short of the circle's
MILLIMETER = 1e-3

MESH_KINDS = ("stl", "obj", "ply", "off")
"""Endings of readable mesh files: each holds one surface, without references to other files."""

LARGEST_MESH = 50_000_000
"""Largest mesh file that is read [bytes]."""


def read_mesh(path: str | Path, unit: float = MILLIMETER) -> "Trimesh":
    """Read a closed surface from an STL, OBJ, PLY or OFF file, in metres, with its faces turned outward.

    `unit` is the length of the file's unit [m]. A ValueError says what is wrong with the file;
    FileNotFoundError is raised without a file.
    """
    Parameter("m", above=0.0).check("read_mesh.unit", unit)
    kind = Path(path).suffix.lower().removeprefix(".")
    if not Path(path).is_file():
        raise FileNotFoundError(f"{path}: no such file")
    if kind not in MESH_KINDS:
        raise ValueError(f"{path}: must end in {', '.join(MESH_KINDS)}, got {kind or 'no ending'}")
    if (size := Path(path).stat().st_size) > LARGEST_MESH:
        raise ValueError(f"{path}: must have at most {LARGEST_MESH:,} bytes, got {size:,}")
    try:
        mesh = _surface(Path(path).read_bytes(), kind)
    except Exception as error:  # the readers of trimesh raise many kinds of errors
        raise ValueError(f"{path}: not a readable mesh: {error!r}") from error
    if mesh is None:
        raise ValueError(f"{path}: the surface must be closed, got open or doubled edges")
    if not (np.isfinite(mesh.vertices).all() and np.isfinite(mesh.volume) and mesh.volume > 0.0):
        raise ValueError(f"{path}: the corners must be finite, and the volume positive, got {mesh.volume!r}")
    return mesh.apply_scale(unit)


def _surface(content: bytes, kind: str) -> "Trimesh | None":
    """Return the surface of a file with its faces turned outward; None if it is not closed."""
    import trimesh

    # from memory, so that a file cannot refer to other files
    mesh = trimesh.load_mesh(io.BytesIO(content), file_type=kind)
    if not isinstance(mesh, trimesh.Trimesh):
        raise TypeError(f"a {type(mesh).__name__}")
    if not mesh.is_watertight:
        return None
    mesh.faces = _turned_outward(np.asarray(mesh.vertices), np.array(mesh.faces))
    return mesh


def _turned_outward(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return the faces of closed bodies, all in the direction that makes each body's volume positive."""
    edges = faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    twins = np.lexsort(np.sort(edges, axis=1).T).reshape(-1, 2)  # each edge occurs twice
    partner = np.empty(len(edges), dtype=int)
    partner[twins] = twins[:, ::-1]
    upward = edges[:, 0] < edges[:, 1]
    agrees = (upward != upward[partner]).tolist()  # consistent faces pass their edge in opposite directions
    neighbour = (partner // 3).tolist()
    body, turned = [-1] * len(faces), [False] * len(faces)
    for first in range(len(faces)):
        if body[first] >= 0:
            continue
        body[first], waiting = first, [first]
        while waiting:
            face = waiting.pop()
            for edge in range(3 * face, 3 * face + 3):
                if body[other := neighbour[edge]] < 0:
                    body[other], turned[other] = first, turned[face] == agrees[edge]
                    waiting.append(other)
    faces[turned] = faces[turned, ::-1]
    volumes = np.bincount(body, np.linalg.det(vertices[faces]), minlength=len(faces))
    inverted = volumes[body] < 0.0
    faces[inverted] = faces[inverted, ::-1]
    return faces


def sphere_mesh(diameter: float) -> "Trimesh":
    """Return a sphere [m]."""
    return ellipsoid_mesh(diameter, diameter, diameter)


def ellipsoid_mesh(length: float, width: float, thickness: float) -> "Trimesh":
    """Return an ellipsoid by its three axes [m], along x, y and z, e.g. wheat, beans, soy."""
    import trimesh

    _check_lengths(length=length, width=width, thickness=thickness)
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.5)
    return ball.apply_scale([length, width, thickness])


def cylinder_mesh(length: float, diameter: float) -> "Trimesh":
    """Return a cylinder along z [m], e.g. pellets, cut straw."""
    import trimesh

    _check_lengths(length=length, diameter=diameter)
    return trimesh.creation.cylinder(radius=0.5 * diameter, height=length, sections=_FACETS)


def capsule_mesh(length: float, diameter: float) -> "Trimesh":
    """Return a cylinder along z with round ends, by its total length [m], e.g. rice, oats."""
    import trimesh

    _check_lengths(length=length, diameter=diameter)
    if length <= diameter:
        raise ValueError(f"length: must be above the diameter {diameter!r} of a capsule, got {length!r}")
    # unit diameter first, as trimesh merges vertices within 1e-8
    slender = trimesh.creation.capsule(length / diameter - 1.0, radius=0.5, count=[_FACETS, _FACETS])
    return slender.apply_scale(diameter)


def tri_pyramid_mesh(height: float, base_edge: float) -> "Trimesh":
    """Return a pyramid over an equilateral triangle with its tip along z [m], e.g. buckwheat."""
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
"""Solids from dimensions, by the name for `parse_solid`."""


def parse_solid(text: str) -> "Trimesh":
    """Make a solid [m] from a name of `SOLIDS` and its dimensions in mm, e.g. ``tri-pyramid:5.90x3.93``."""
    name, _, dimensions = text.partition(":")
    if name not in SOLIDS:
        raise ValueError(f"solid: must be one of {', '.join(map(describe_solid, SOLIDS))} [mm], got {text!r}")
    try:
        lengths = [MILLIMETER * float(word) for word in dimensions.split("x")]
        if len(lengths) != len(inspect.signature(SOLIDS[name]).parameters):
            raise ValueError(f"got {len(lengths)} dimensions")
        return SOLIDS[name](*lengths)
    except ValueError as error:
        raise ValueError(f"{text!r}: must be {describe_solid(name)} in mm: {error}") from error


def describe_solid(name: str) -> str:
    """Return the pattern of a solid's text, e.g. ``cylinder:LENGTHxDIAMETER``."""
    dimensions = inspect.signature(SOLIDS[name]).parameters
    return f"{name}:{'x'.join(dimension.upper() for dimension in dimensions)}"


def _check_lengths(**lengths: float) -> None:
    for name, value in lengths.items():
        Parameter("m", above=0.0).check(name, value)
