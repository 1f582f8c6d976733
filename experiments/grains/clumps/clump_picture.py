"""Picture of a clump and its solid."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from experiments.io.errors import InputError
from experiments.io.files import replacing, require_new_file

if TYPE_CHECKING:
    from trimesh import Trimesh

GRAIN = (0.78, 0.60, 0.38)
"""Colour, red-green-blue."""
SUBDIVISIONS = 3
"""Subdivisions of the icosahedron of a drawn sphere."""


def require_picture(path: Path) -> None:
    """Refuse a picture with an unknown ending, and one that exists; raise `InputError`."""
    from matplotlib.figure import Figure

    known = Figure().canvas.get_supported_filetypes()
    if path.suffix.removeprefix(".").lower() not in known:
        raise InputError(str(path), f"must end in one of {', '.join(known)}", path.suffix or "no ending")
    require_new_file(path, "a picture")


def draw_clump(path: Path, spheres: np.ndarray, solid: Trimesh | None) -> None:
    """Draw spheres (n, 4) [m], and their solid from the same side where there is one."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 4.5) if solid is not None else (4.5, 4.5), dpi=150)
    figure.subplots_adjust(0.0, 0.0, 1.0, 0.92, 0.0)
    clump = _mesh_of(spheres)
    shown = [("clump", clump)] if solid is None else [("solid", solid), ("clump", clump)]
    low = np.min([mesh.bounds[0] for _, mesh in shown], axis=0)
    high = np.max([mesh.bounds[1] for _, mesh in shown], axis=0)
    for place, (title, mesh) in enumerate(shown, start=1):
        axes: Any = figure.add_subplot(1, len(shown), place, projection="3d")
        x, y, z = np.asarray(mesh.vertices).T
        axes.plot_trisurf(x, y, z, triangles=mesh.faces, color=GRAIN, linewidth=0.0, antialiased=False)
        for least, most, limits in zip(low, high, (axes.set_xlim, axes.set_ylim, axes.set_zlim), strict=True):
            limits(least, most)
        axes.set_box_aspect(high - low, zoom=1.1)
        axes.view_init(elev=20.0, azim=-60.0)
        axes.set_axis_off()
        axes.set_title(
            f"{title}, {' x '.join(f'{1e3 * side:.3g}' for side in np.ptp(mesh.bounds, axis=0))} mm"
        )
    with replacing(path) as temporary:
        figure.savefig(temporary)


def _mesh_of(spheres: np.ndarray) -> Trimesh:
    import trimesh

    unit = trimesh.creation.icosphere(subdivisions=SUBDIVISIONS)
    vertices = np.vstack([center + radius * unit.vertices for *center, radius in spheres])
    faces = np.vstack([unit.faces + n * len(unit.vertices) for n in range(len(spheres))])
    return trimesh.Trimesh(vertices, faces, process=False)
