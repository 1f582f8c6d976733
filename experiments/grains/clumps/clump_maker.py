"""Clumps from a file of spheres, a mesh, or measured dimensions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from dem_warp import ClumpShape
from dem_warp.clump_fitting import ClumpFit
from dem_warp.solids import parse_solid
from experiments.grains.clumps.clump_picture import draw_clump
from experiments.grains.clumps.clump_search import Trial, fit_with, fit_within
from experiments.grains.clumps.mesh_file import read_surface
from experiments.grains.spheres import format_of, length_unit, read_clump
from experiments.grains.spheres.clump_file import GRAIN_SIZES, check_grain_size, unit_option
from experiments.io.errors import InputError
from experiments.io.files import replacing, require_new_file

if TYPE_CHECKING:
    from trimesh import Trimesh

MESH_FILES = (".stl", ".obj", ".ply", ".off", ".3mf", ".glb", ".gltf", ".dae", ".stp", ".step")
"""Endings of meshes; any other file may have spheres, depending on its content."""
LARGEST_VOLUME_ERROR = 0.1
"""Error of a clump's volume above which advice is given."""


@dataclass(frozen=True)
class ClumpRequest:
    """Options of a clump."""

    source: str
    """A file of spheres, a mesh, or a solid by its dimensions in mm (``tri-pyramid:5.90x3.93``)."""
    sphere_count: int | None = None
    """Number of spheres to fill a solid with."""
    tolerance: float | None = None
    """Or the largest error of volume, inertia and surface, see `fit_within`."""
    protrusion: float | None = 0.0
    """Distance by which a sphere may pass the surface [m]; None: the one that keeps the volume."""
    unit: str | None = None
    """Unit of a file; None: the file's own, or mm."""


@dataclass(frozen=True)
class Clump:
    """A clump, and its fit to a solid unless its spheres were read from a file."""

    shape: ClumpShape
    fit: ClumpFit | None = None
    description: str = ""
    """Format and unit of a file of spheres."""
    solid: Trimesh | None = None
    trials: tuple[Trial, ...] = ()
    """Tried numbers of spheres; the last one is the clump's."""

    def to_dict(self, density: float | None = None) -> dict[str, Any]:
        """Return the clump as data for JSON, in mm and mg; its mass needs a density [kg/m3]."""
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
            "trials": [asdict(trial) for trial in self.trials],
            "spheres_mm": spheres,
        }

    @property
    def advice(self) -> str:
        """Advice about a mass far from the solid's, or an empty text."""
        if self.fit is None or abs(self.fit.volume_error) <= LARGEST_VOLUME_ERROR:
            return ""
        share, more = 100.0 * abs(self.fit.volume_error), self.fit.volume_error > 0.0
        finding = f"the clump has {share:.0f} % {'more' if more else 'less'} volume and mass than the solid"
        return f"{finding}: --protrusion auto keeps the volume, --tolerance also finds the number of spheres"

    @property
    def doubt(self) -> str:
        """Doubt about a length that no grain has, or an empty text."""
        size = self.solid.extents.max() if self.solid is not None else 2.0 * self.shape.bounding_radius
        low, high = GRAIN_SIZES
        if low <= size <= high:
            return ""
        usual = f"{1e3 * low:g} to {1e3 * high:g} mm"
        return f"the grain is {1e3 * size:.4g} mm long, but grains are {usual}: check --unit"

    def draw(self, path: Path) -> None:
        """Draw the clump and its solid; see `draw_clump`."""
        own = np.column_stack([self.shape.centers, self.shape.radii])
        draw_clump(path, self.fit.spheres if self.fit else own, self.solid)


def make_clump(request: ClumpRequest, watch: Callable[[Trial], None] = lambda trial: None) -> Clump:
    """Read a clump from a file of spheres, or fit one to a solid."""
    source, unit = request.source, request.unit
    path, named = Path(source), ":" in source and not Path(source).is_file()
    if not named and not path.is_file():
        raise InputError(source, "is a folder" if path.is_dir() else "no such file")
    wanted = [each for each in (request.sphere_count, request.tolerance) if each is not None]
    given = not named and _holds_spheres(path, bool(wanted))
    if given and wanted:
        raise InputError("--spheres, --tolerance", "spheres of a file are not fitted: leave both out")
    if not given and len(wanted) != 1:
        raise InputError(
            "--spheres, --tolerance", "a solid needs one of the two", "both" if wanted else "neither"
        )
    if named and unit is not None:
        raise InputError("--unit", "the dimensions of a solid are always in mm", unit)
    if unit is not None:
        unit_option(unit)
    if given:
        read = read_clump(path, unit)
        return Clump(read.shape, description=read.description)
    try:
        solid = parse_solid(source) if named else _mesh(path, unit)
        fit, trials = _fitted(solid, request, watch)
    except InputError:
        raise
    except (ValueError, OSError) as error:
        place, _, problem = str(error).partition(": ")
        raise InputError(place, problem) if problem else InputError(source, place) from None
    return Clump(fit.shape, fit, solid=solid, trials=tuple(trials))


def _fitted(
    solid: Trimesh, request: ClumpRequest, watch: Callable[[Trial], None]
) -> tuple[ClumpFit, list[Trial]]:
    if request.tolerance is not None:
        return fit_within(solid, request.tolerance, request.protrusion, watch)
    fit, reach = fit_with(solid, request.sphere_count or 1, request.protrusion)
    return fit, [Trial.of(fit, reach)]


def _holds_spheres(path: Path, to_fit: bool) -> bool:
    """Return True if a file has spheres, by ending and content; an unclear file to fit is a mesh."""
    if path.suffix.lower() in MESH_FILES:
        return False
    return not to_fit or (path.is_file() and format_of(path) is not None)


def _mesh(path: Path, unit: str | None) -> Trimesh:
    """Read one closed body of a grain's size."""
    try:
        mesh = read_surface(path, length_unit(unit or "mm"))
    except ValueError as error:
        if error.__cause__ is None:
            raise
        # the reader's own message, without the class of its error
        cause = error.__cause__
        detail = f"it has no {cause}" if isinstance(cause, KeyError) else str(cause) or "another format"
        raise InputError(str(path), f"not a readable mesh: {detail}") from error
    if mesh.body_count > 1:
        raise InputError(str(path), "must be one closed body", f"{mesh.body_count} bodies")
    if unit is None:
        check_grain_size(float(mesh.extents.max()), str(path), "read in mm")
    return mesh


def write_clump(shape: ClumpShape, path: Path) -> None:
    """Write a clump's file of spheres; it must be new."""
    require_new_file(path, "a clump")
    with replacing(path) as temporary:
        shape.write(temporary)
