"""Clumps from what a person has: a file of spheres, a mesh, or a few measured dimensions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from dem_warp import ClumpShape
from dem_warp.clump_fitting import ClumpFit, fit_clump
from dem_warp.solids import parse_solid, read_mesh
from experiments.grains.clumps.clump_picture import draw_clump
from experiments.grains.clumps.clump_search import Trial, fit_by_volume, fit_within
from experiments.grains.spheres import format_of, length_unit, read_clump
from experiments.grains.spheres.clump_file import GRAIN_SIZES, check_grain_size
from experiments.io.errors import InputError
from experiments.io.files import replacing, require_new_file

if TYPE_CHECKING:
    from trimesh import Trimesh

MESH_FILES = (".stl", ".obj", ".ply", ".off", ".3mf", ".glb", ".gltf", ".dae", ".stp", ".step")
"""Endings of meshes; any other file may hold spheres, and its content tells."""
LARGEST_VOLUME_ERROR = 0.1
"""Error of a clump's volume over which a person is told."""


@dataclass(frozen=True)
class ClumpRequest:
    """Options that a person gives for a clump."""

    source: str
    """A file of spheres, a mesh, or a solid by its dimensions in mm (``tri-pyramid:5.90x3.93``)."""
    sphere_count: int | None = None
    """Spheres to fill a solid with."""
    tolerance: float | None = None
    """Instead: largest error of volume, inertia and surface, see `fit_within`."""
    protrusion: float | None = 0.0
    """Distance by which a sphere may pass the surface [m]; None: the one that keeps the volume."""
    unit: str | None = None
    """Unit of a file; None: the one that it names, or mm."""


@dataclass(frozen=True)
class Clump:
    """A clump, and how well it fills the solid that it was made for."""

    shape: ClumpShape
    """The spheres."""
    fit: ClumpFit | None = None
    """Quality of the fit; None for spheres that were given."""
    told: str = ""
    """Format and unit of a file of spheres."""
    solid: Trimesh | None = None
    """The solid; None for spheres that were given."""
    trials: tuple[Trial, ...] = ()
    """Numbers of spheres that were tried, the last one taken; empty for spheres that were given."""

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
            "trials": [trial.to_dict() for trial in self.trials],
            "spheres_mm": spheres,
        }

    @property
    def advice(self) -> str:
        """Say that the clump's mass is far from the solid's; empty where it is not, or no solid is known."""
        if self.fit is None or abs(self.fit.volume_error) <= LARGEST_VOLUME_ERROR:
            return ""
        share, more = 100.0 * abs(self.fit.volume_error), self.fit.volume_error > 0.0
        told = f"the clump has {share:.0f} % {'more' if more else 'less'} volume, and mass, than the solid"
        return f"{told}: --protrusion auto keeps the volume, --tolerance finds the number of spheres too"

    @property
    def doubt(self) -> str:
        """Say that it is longer or shorter than any grain, whatever unit was named; empty where it is not."""
        size = self.solid.extents.max() if self.solid is not None else 2.0 * self.shape.bounding_radius
        low, high = GRAIN_SIZES
        if low <= size <= high:
            return ""
        usual = f"{1e3 * low:g} to {1e3 * high:g} mm"
        return f"the grain is {1e3 * size:.4g} mm long, and grains are {usual}: see to --unit"

    def draw(self, path: Path) -> None:
        """Draw the clump, beside its solid; see `draw_clump`."""
        own = np.column_stack([self.shape.centers, self.shape.radii])
        draw_clump(path, self.fit.spheres if self.fit else own, self.solid)


def make_clump(request: ClumpRequest, watch: Callable[[Trial], None] = lambda trial: None) -> Clump:
    """Read a clump from a file of spheres, or fit one to a solid.

    Raises
    ------
    InputError
        When the source is neither, the number of spheres is missing or not needed, or no clump is within the
        tolerance.
    """
    source, unit = request.source, request.unit
    named = ":" in source and not Path(source).is_file()
    wanted = [each for each in (request.sphere_count, request.tolerance) if each is not None]
    given = not named and _holds_spheres(Path(source), bool(wanted))
    if given and wanted:
        raise InputError(
            "--spheres, --tolerance", "expected spheres that are given are not fitted", wanted[0]
        )
    if not given and len(wanted) != 1:
        rule = "expected a solid is filled with a number of spheres, or within a tolerance"
        raise InputError("--spheres, --tolerance", rule, "both" if wanted else "none")
    if named and unit is not None:
        raise InputError("--unit", "expected the dimensions of a solid are in mm", unit)
    if unit is not None:
        _check_unit(unit)
    if given:
        read = read_clump(Path(source), unit)
        return Clump(read.shape, told=read.told)
    try:
        solid = parse_solid(source) if named else _mesh(Path(source), unit)
        fit, trials = _fitted(solid, request, watch)
    except InputError:
        raise
    except (ValueError, OSError) as error:
        raise InputError("SHAPE", str(error), source) from None
    return Clump(fit.shape, fit, solid=solid, trials=tuple(trials))


def _fitted(
    solid: Trimesh, request: ClumpRequest, watch: Callable[[Trial], None]
) -> tuple[ClumpFit, list[Trial]]:
    if request.tolerance is not None:
        return fit_within(solid, request.tolerance, request.protrusion, watch)
    count, reach = request.sphere_count or 1, request.protrusion
    if reach is None:
        fit, reach = fit_by_volume(solid, count)
    else:
        fit = fit_clump(solid, count, reach)
    return fit, [Trial.of(fit, reach)]


def _holds_spheres(path: Path, to_fit: bool) -> bool:
    """Tell by ending and content that a file holds spheres; in doubt, what is to be fitted is a mesh."""
    if path.suffix.lower() in MESH_FILES:
        return False
    return not to_fit or (path.is_file() and format_of(path) is not None)


def _check_unit(unit: str) -> None:
    try:
        length_unit(unit)
    except ValueError as error:
        raise InputError("--unit", str(error), unit) from None


def _mesh(path: Path, unit: str | None) -> Trimesh:
    """Read one closed body of a grain's size."""
    try:
        mesh = read_mesh(path, length_unit(unit or "mm"))
    except ValueError as error:
        if error.__cause__ is None:
            raise
        # the reader's own words, without the class of its error
        cause = error.__cause__
        found = f"a file without {cause}" if isinstance(cause, KeyError) else str(cause) or "another file"
        raise InputError(str(path), "must be a mesh that can be read", found) from error
    if mesh.body_count > 1:
        raise InputError(
            str(path), "expected a grain is one closed body", f"{mesh.body_count} bodies in the mesh"
        )
    if unit is None:
        check_grain_size(float(mesh.extents.max()), str(path), "read in mm")
    return mesh


def write_clump(shape: ClumpShape, path: Path) -> None:
    """Write a clump's file of spheres; errors as by `require_new_file`."""
    require_new_file(path, "a clump")
    with replacing(path) as temporary:
        shape.write(temporary)
