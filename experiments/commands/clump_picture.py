"""A picture of a clump beside the solid that it was made for."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from experiments.errors import InputError
from experiments.files import replacing

if TYPE_CHECKING:
    from trimesh import Trimesh

GRAIN, EDGE = (0.72, 0.53, 0.32), (0.25, 0.25, 0.25)
"""Colours."""
MERIDIANS, PARALLELS = 24, 13
"""Grid of a drawn sphere."""
MOST_EDGES = 3000
"""Faces beyond which a mesh's edges are not drawn."""


def draw_clump(path: Path, spheres: np.ndarray, solid: Trimesh | None) -> None:
    """Draw spheres (n, 4) [m], beside their solid where there is one, seen from the same side.

    Raises
    ------
    InputError
        When the file exists, or its ending names no kind of picture.
    """
    from matplotlib.figure import Figure

    if path.exists():
        raise InputError("a picture never overwrites a file", "one that exists", str(path))
    figure = Figure(figsize=(9.0, 4.5) if solid is not None else (4.5, 4.5), dpi=150)
    corners = _corners(spheres, solid)
    titles = ["clump"] if solid is None else ["solid", "clump"]
    for place, title in enumerate(titles, start=1):
        axes: Any = figure.add_subplot(1, len(titles), place, projection="3d")
        if title == "solid" and solid is not None:
            _draw_solid(axes, solid)
        else:
            _draw_spheres(axes, spheres)
        for low, high, limits in zip(*corners, (axes.set_xlim, axes.set_ylim, axes.set_zlim), strict=True):
            limits(1e3 * low, 1e3 * high)
        axes.set_box_aspect(corners[1] - corners[0])
        axes.view_init(elev=20.0, azim=-60.0)
        axes.set_title(title)
        axes.set_xlabel("mm")
    try:
        with replacing(path) as temporary:
            figure.savefig(temporary)
    except ValueError as error:
        raise InputError(
            f"must be a kind of picture that can be written: {error}", path.suffix, str(path)
        ) from None


def _corners(spheres: np.ndarray, solid: Trimesh | None) -> tuple[np.ndarray, np.ndarray]:
    """Corners of the box that holds both [m]."""
    low = (spheres[:, :3] - spheres[:, 3:]).min(axis=0)
    high = (spheres[:, :3] + spheres[:, 3:]).max(axis=0)
    if solid is None:
        return low, high
    return np.minimum(low, solid.bounds[0]), np.maximum(high, solid.bounds[1])


def _draw_solid(axes: Any, solid: Trimesh) -> None:
    x, y, z = 1e3 * np.asarray(solid.vertices).T
    width = 0.2 if len(solid.faces) <= MOST_EDGES else 0.0
    axes.plot_trisurf(x, y, z, triangles=solid.faces, color=GRAIN, edgecolor=EDGE, linewidth=width)


def _draw_spheres(axes: Any, spheres: np.ndarray) -> None:
    turn, fall = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, MERIDIANS), np.linspace(0.0, np.pi, PARALLELS))
    unit = np.stack([np.cos(turn) * np.sin(fall), np.sin(turn) * np.sin(fall), np.cos(fall)])
    for *center, radius in 1e3 * spheres:
        x, y, z = np.array(center)[:, None, None] + radius * unit
        axes.plot_surface(x, y, z, color=GRAIN, linewidth=0.0, shade=True)
