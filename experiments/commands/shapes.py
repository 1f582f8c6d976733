"""Clumps from what a person has: a file of spheres, a mesh, or a few measured dimensions."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dem_warp import ClumpShape
from dem_warp.clump_fitting import ClumpFit, fit_clump
from dem_warp.solids import parse_solid, read_mesh
from experiments.errors import InputError
from experiments.files import replacing
from experiments.sphere_files import format_of, length_unit, read_clump
from experiments.sphere_files.clump_file import check_grain_size

if TYPE_CHECKING:
    from trimesh import Trimesh

MESH_FILES = (".stl", ".obj", ".ply", ".off", ".3mf", ".glb", ".gltf", ".dae", ".stp", ".step")
"""Endings of meshes; any other file may hold spheres, and its content tells."""


@dataclass(frozen=True)
class Clump:
    """A clump, and how well it fills the solid that it was made for."""

    shape: ClumpShape
    """The spheres."""
    fit: ClumpFit | None
    """Quality of the fit; None for spheres that were given."""
    told: str = ""
    """Format and unit of a file of spheres."""

    def to_dict(self, density: float | None = None) -> dict[str, Any]:
        """Describe the clump as JSON-able data, in mm and mg; with a density [kg/m3], its mass too."""
        shape, fit = self.shape, self.fit
        spheres = [
            [1e3 * value for value in (*center, radius)]
            for center, radius in zip(shape.centers.tolist(), shape.radii.tolist(), strict=True)
        ]
        return {
            "sphere_count": shape.sphere_count,
            "volume_mm3": 1e9 * shape.volume,
            "mass_mg": None if density is None else 1e6 * density * shape.volume,
            "inertia_over_mass_mm2": [1e6 * moment for moment in shape.inertia_over_mass.tolist()],
            "bounding_radius_mm": 1e3 * shape.bounding_radius,
            "coverage": fit.coverage if fit else None,
            "overshoot": fit.overshoot if fit else None,
            "spheres_mm": spheres,
        }


def make_clump(
    source: str, sphere_count: int | None = None, protrusion: float = 0.0, unit: str | None = None
) -> Clump:
    """Read a clump from a file of spheres, or fit one to a solid.

    A solid is a mesh file, or named by its dimensions in mm (``tri-pyramid:5.90x3.93``). A sphere may pass
    its surface by the ``protrusion`` [m]. A file's ``unit`` is the one that it names, or mm.

    Raises
    ------
    InputError
        When the source is none of these, or the sphere count is missing or not needed.
    """
    named = ":" in source and not Path(source).is_file()
    given = not named and _holds_spheres(Path(source))
    if given != (sphere_count is None):
        rule = "a solid is filled with a number of spheres"
        rule = "spheres that are given are not fitted" if given else rule
        raise InputError(rule, sphere_count or "none", "--spheres")
    if named and unit is not None:
        raise InputError("the dimensions of a solid are in mm", unit, "--unit")
    if unit is not None:
        _check_unit(unit)
    if sphere_count is None:
        read = read_clump(Path(source), unit)
        return Clump(read.shape, None, read.told)
    try:
        solid = parse_solid(source) if named else _mesh(Path(source), unit)
        fit = fit_clump(solid, sphere_count, protrusion)
    except InputError:
        raise
    except (ValueError, OSError) as error:
        raise InputError(str(error), source, "SHAPE") from None
    return Clump(fit.shape, fit)


def _holds_spheres(path: Path) -> bool:
    return path.suffix.lower() not in MESH_FILES and (not path.is_file() or format_of(path) is not None)


def _check_unit(unit: str) -> None:
    try:
        length_unit(unit)
    except ValueError as error:
        raise InputError(str(error), unit, "--unit") from None


def _mesh(path: Path, unit: str | None) -> Trimesh:
    """Read one closed body of a grain's size."""
    mesh = read_mesh(path, length_unit(unit or "mm"))
    if mesh.body_count > 1:
        raise InputError("a grain is one closed body", f"{mesh.body_count} bodies in the mesh", str(path))
    if unit is None:
        check_grain_size(float(mesh.extents.max()), str(path), "read in mm")
    return mesh


def write_clump(shape: ClumpShape, path: Path) -> None:
    """Write a clump's file of spheres.

    Raises
    ------
    InputError
        When the file exists.
    """
    if path.exists():
        raise InputError("a clump never overwrites a file", "one that exists", str(path))
    with replacing(path) as temporary:
        shape.write(temporary)
