"""Clumps from what a person has: a file of spheres, a mesh, or a few measured dimensions."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dem_warp import ClumpShape
from dem_warp.clump_fitting import ClumpFit, fit_clump
from dem_warp.solids import parse_solid, read_mesh
from experiments.errors import InputError
from experiments.files import replacing

SPHERE_FILES = (".txt", ".csv", ".dat")
"""Endings of files that hold spheres; any other file is a mesh."""


@dataclass(frozen=True)
class Clump:
    """A clump, and how well it fills the solid that it was made for."""

    shape: ClumpShape
    """The spheres."""
    fit: ClumpFit | None
    """Quality of the fit; None for spheres that were given."""

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


def make_clump(source: str, sphere_count: int | None = None, protrusion: float = 0.0) -> Clump:
    """Read a clump from a file of spheres (``x y z r`` in mm), or fit one to a solid.

    A solid is a mesh file in mm, or named by its dimensions in mm (``tri-pyramid:5.90x3.93``). A sphere may
    pass its surface by the ``protrusion`` [m].

    Raises
    ------
    InputError
        When the source is none of these, or the sphere count is missing or not needed.
    """
    given = ":" not in source and Path(source).suffix.lower() in SPHERE_FILES
    if given != (sphere_count is None):
        rule = "a solid is filled with a number of spheres"
        rule = "spheres that are given are not fitted" if given else rule
        raise InputError(rule, sphere_count or "none", "--spheres")
    try:
        if sphere_count is None:
            return Clump(ClumpShape.read(source), None)
        solid = parse_solid(source) if ":" in source else read_mesh(source)
        fit = fit_clump(solid, sphere_count, protrusion)
    except (ValueError, OSError) as error:
        raise InputError(str(error), source, "SHAPE") from None
    return Clump(fit.shape, fit)


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
