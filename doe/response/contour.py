"""The contour of a surface at a target: roots, a traced curve, or a cloud of crossings."""

import contourpy
import numpy as np
import pandas as pd
from numpy.typing import NDArray

from doe.arguments import checked_count, checked_number
from doe.design.design import natural_points
from doe.response.quadratic import FittedSurface, QuadraticForm

CURVE_RESOLUTION = 201
"""Grid lines along each factor for a curve of two factors."""

MOST_LINES = 10_000
"""Largest number of grid lines along a factor."""

LINE_BUDGET = 4_000
"""Lines parallel to the axes that sample a contour in three or more factors."""


def contour(
    surface: FittedSurface, target: float, extent: float = 1.0, resolution: int | None = None
) -> pd.DataFrame:
    """Return points where the fitted mean is the target, inside the coded box -extent..+extent.

    One factor: the roots. Two: ordered points along the curve, the index numbering its separate pieces. More:
    crossings of the contour with lines parallel to the axes, ``resolution`` along each factor. Every point
    solves the fitted equation. The table has a column for each factor in natural units; it is empty when the
    target is not reached.

    Raises DesignError: a target, an extent or a resolution out of its range.
    """
    checked_number("target", target)
    checked_number("extent, the coded half width of the box,", extent, above=0.0)
    if resolution is not None:
        checked_count("resolution", resolution, least=2, most=MOST_LINES)
    return natural_points(surface.design.factors, contour_points(surface, target, extent, resolution))


def contour_points(
    surface: FittedSurface, target: float, extent: float, resolution: int | None
) -> pd.DataFrame:
    """Return the points of ``contour`` in coded units."""
    names = surface.design.names
    form = surface.quadratic_form
    if len(names) == 2:
        pieces = _traced_curves(form, target, extent, resolution or CURVE_RESOLUTION)
    else:
        pieces = [_line_crossings(form, target, extent, resolution)]
    index = pd.Index(np.repeat(np.arange(len(pieces)), [len(piece) for piece in pieces]), name="piece")
    stacked = np.vstack([*pieces, np.empty((0, len(names)))])
    return pd.DataFrame(stacked, columns=names, index=index)


def _traced_curves(
    form: QuadraticForm, target: float, extent: float, resolution: int
) -> list[NDArray[np.float64]]:
    """Return the curves in the square: marching squares, each vertex moved to its edge's exact root."""
    grid = np.linspace(-extent, extent, resolution)
    values = form.value(np.stack(np.meshgrid(grid, grid), axis=-1))
    lines = contourpy.contour_generator(grid, grid, values).lines(target)
    return [
        np.array([_onto_root(form, target, vertex, grid) for vertex in np.asarray(line)]) for line in lines
    ]


def _onto_root(
    form: QuadraticForm, target: float, vertex: NDArray[np.float64], grid: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return a vertex moved along its grid edge to the nearest root within one cell."""
    off_grid = np.abs(vertex[:, None] - grid[None, :]).min(axis=1)
    axis = int(off_grid.argmax())
    roots = form.roots_along(axis, vertex[None, :], target)[0]
    near = roots[np.abs(roots - vertex[axis]) < grid[1] - grid[0]]
    moved = vertex.copy()
    if near.size:
        moved[axis] = near[np.abs(near - vertex[axis]).argmin()]
    return moved


def _line_crossings(
    form: QuadraticForm, target: float, extent: float, resolution: int | None
) -> NDArray[np.float64]:
    """Return crossings of lines parallel to each axis with the contour, shape (points, factors)."""
    count = len(form.slopes)
    along = resolution or max(5, int((LINE_BUDGET / count) ** (1.0 / max(count - 1, 1))))
    grid = np.linspace(-extent, extent, along)
    if count == 1:
        lines = np.zeros((1, 0))
    else:
        lines = np.stack(np.meshgrid(*[grid] * (count - 1), indexing="ij"), axis=-1).reshape(-1, count - 1)
    crossings = []
    for axis in range(count):
        points = np.insert(lines, axis, 0.0, axis=1)
        for root in form.roots_along(axis, points, target).T:
            crossing = points.copy()
            crossing[:, axis] = root
            crossings.append(crossing[np.abs(root) <= extent])
    return np.unique(np.vstack(crossings), axis=0)
