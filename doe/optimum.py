"""Where a surface meets a target: contour, nearest point, compatible region; and its stationary point."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import contourpy
import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import optimize, stats

from doe.compare import Sample
from doe.errors import DesignError, TargetError
from doe.factors import Factor, natural_points

if TYPE_CHECKING:
    from doe.surface import Surface

LINE_BUDGET = 4_000
"""Lines parallel to the axes that a contour in three or more factors is sampled on."""

CURVE_RESOLUTION = 201
"""Grid lines along each factor that a contour curve of two factors is traced through."""

CELL_BUDGET = 160_000
"""Cells that a region is sampled on."""

NEAREST_STARTS = 8
"""Points of the contour from which the nearest one is refined."""

FLAT_RATIO = 1e-9
"""Curvature relative to the largest one (or to the slopes) below which a direction counts as straight."""


@dataclass(frozen=True)
class StationaryPoint:
    """Where the gradient of a quadratic surface vanishes."""

    coded: pd.Series
    natural: pd.Series
    mean: float
    """Fitted response there."""
    kind: str
    """``"minimum"``, ``"maximum"`` or ``"saddle"``."""
    curvatures: NDArray[np.float64]
    """Eigenvalues of the quadratic form in coded units, ascending."""

    @property
    def inside(self) -> bool:
        """Whether it lies in the coded box -1..+1."""
        return bool((self.coded.abs() <= 1.0).all())


@dataclass(frozen=True, eq=False)
class Region:
    """Cells of a regular grid over the coded box -extent..+extent and which of them belong."""

    factors: tuple[Factor, ...]
    coded: pd.DataFrame
    """Centers of all cells."""
    mask: NDArray[np.bool_]
    """Which cells belong, shape (cells,)."""
    resolution: int
    """Cells along each factor; the last factor varies fastest."""
    extent: float

    @cached_property
    def natural(self) -> pd.DataFrame:
        """Centers of all cells in natural units."""
        return natural_points(self.factors, self.coded)

    @property
    def fraction(self) -> float:
        """Share of the box that belongs."""
        return float(self.mask.mean())

    @property
    def ranges(self) -> pd.DataFrame:
        """Natural low and high of each factor over the cells that belong (edges, not centers); NaN when none does.

        A range alone does not make a setting compatible: the factors trade off against one another.
        """
        half_cell = self.extent / self.resolution
        belonging = self.coded[self.mask]
        low = natural_points(self.factors, (belonging.min() - half_cell).to_frame().T).iloc[0]
        high = natural_points(self.factors, (belonging.max() + half_cell).to_frame().T).iloc[0]
        return pd.DataFrame({"low": low, "high": high}).rename_axis("factor")


def contour(
    surface: Surface, target: float, extent: float = 1.0, resolution: int | None = None
) -> pd.DataFrame:
    """Return points where the fitted mean is the target, inside the coded box -extent..+extent.

    One factor: the roots. Two: ordered points along the curve, the index numbering its separate pieces. More: a
    cloud of the contour's crossings with lines parallel to the axes. All points solve the fitted equation exactly.

    Parameters
    ----------
    surface : Surface
    target : float
    extent : float
        Coded half width of the box.
    resolution : int, optional
        Grid lines along each factor.

    Returns
    -------
    DataFrame
        A column for each factor in natural units; empty when the target is not reached.
    """
    coded = _contour_points(surface, target, extent, resolution)
    return natural_points(surface.design.factors, coded)


def nearest(
    surface: Surface, target: float, to: Mapping[str, float] | None = None, extent: float = 1.0
) -> pd.Series:
    """Return the point of the target contour with the smallest coded distance to a point.

    Parameters
    ----------
    surface : Surface
    target : float
    to : mapping of natural values by factor, optional
        Default: the design's center.
    extent : float
        Coded half width of the box that the point must lie in.

    Returns
    -------
    Series
        Natural value by factor.

    Raises
    ------
    TargetError
        The fitted surface does not reach the target in the box.
    """
    factors = surface.design.factors
    origin = np.zeros(len(factors))
    if to is not None:
        origin = np.array([factor.to_coded(float(to[factor.name])) for factor in factors])
    starts = _contour_points(surface, target, extent, None).to_numpy()
    if not len(starts):
        mean, _ = surface.evaluate(_cells(len(factors), extent, None)[0])
        raise TargetError(
            f"the fitted surface does not reach the target {target:g}: it runs from {mean.min():.4g} to "
            f"{mean.max():.4g} inside the coded box -{extent:g}..+{extent:g}"
        )
    order = np.argsort(np.linalg.norm(starts - origin, axis=1), kind="stable")
    candidates = [_refined(surface, target, starts[i], origin, extent) for i in order[:NEAREST_STARTS]]
    best = min(candidates, key=lambda point: float(np.linalg.norm(point - origin)))
    return pd.Series({f.name: float(f.to_natural(x)) for f, x in zip(factors, best, strict=True)})


def stationary_point(surface: Surface) -> StationaryPoint:
    """Return the point of a quadratic surface where the gradient vanishes (canonical analysis, Box and Wilson).

    Raises
    ------
    DesignError
        The surface is straight along some direction, so that there is no single such point.
    """
    constant, slopes, form = quadratic_form(surface)
    curvatures, directions = np.linalg.eigh(form)
    scale = max(np.abs(curvatures).max(), np.abs(slopes).max())
    if np.abs(curvatures).min() <= FLAT_RATIO * scale:
        direction = directions[:, np.abs(curvatures).argmin()].round(3)
        raise DesignError(
            "a stationary point needs curvature in every direction; the fitted surface is straight along "
            f"{dict(zip(surface.design.names, direction.tolist(), strict=True))} (coded)"
        )
    point = np.linalg.solve(form, -0.5 * slopes)
    kind = "minimum" if curvatures.min() > 0.0 else "maximum" if curvatures.max() < 0.0 else "saddle"
    coded = pd.Series(point, index=surface.design.names)
    natural = natural_points(surface.design.factors, coded.to_frame().T).iloc[0]
    return StationaryPoint(coded, natural, float(constant + 0.5 * slopes @ point), kind, curvatures)


def compatible_region(
    surface: Surface,
    target: float | Sample,
    target_se: float = 0.0,
    target_df: float = np.inf,
    alpha: float = 0.05,
    extent: float = 1.0,
    resolution: int | None = None,
) -> Region:
    """Return the settings whose fitted mean and the measured target do not differ significantly.

    A setting belongs when |mean - target| <= t sqrt(se_fit^2 + se_target^2), with t on the Welch-Satterthwaite
    degrees of freedom of the two errors: the true setting belongs with probability 1 - alpha.

    Parameters
    ----------
    surface : Surface
    target : float or Sample
        A Sample brings its standard error and degrees of freedom.
    target_se, target_df : float
        Standard error of the target's mean and its degrees of freedom, when the target is a number.
    alpha : float
    extent : float
        Coded half width of the box.
    resolution : int, optional
        Cells along each factor.
    """
    if isinstance(target, Sample):
        target, target_se, target_df = target.mean, target.se, target.df
    if not (np.isfinite(target_se) and target_se >= 0.0):
        raise DesignError(f"target_se must be finite and not negative, received {target_se}")
    points, count = _cells(len(surface.design.factors), extent, resolution)
    mean, se = surface.evaluate(points)
    fit_variance, target_variance = se**2, target_se**2
    total = fit_variance + target_variance
    df = total**2 / (fit_variance**2 / surface.residual_df + target_variance**2 / target_df)
    mask = np.abs(mean - target) <= stats.t.isf(0.5 * alpha, df) * np.sqrt(total)
    return _region(surface, points, mask, count, extent)


def band(
    surface: Surface, target: float, half_width: float, extent: float = 1.0, resolution: int | None = None
) -> Region:
    """Return the settings whose fitted mean lies within target +- half_width."""
    points, count = _cells(len(surface.design.factors), extent, resolution)
    mean, _ = surface.evaluate(points)
    return _region(surface, points, np.abs(mean - target) <= half_width, count, extent)


def quadratic_form(surface: Surface) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
    """Return c, b, B of the fitted mean c + b'x + x'Bx in coded units; B is symmetric."""
    names = surface.design.names
    slopes, form = np.zeros(len(names)), np.zeros((len(names), len(names)))
    constant, *coefficients = surface.fit.params.to_list()
    for term, value in zip(surface.terms, coefficients, strict=True):
        index = [names.index(name) for name in term]
        if len(index) == 1:
            slopes[index[0]] = value
        else:
            form[index[0], index[1]] += 0.5 * value
            form[index[1], index[0]] += 0.5 * value
    return constant, slopes, form


def _region(surface: Surface, points: NDArray, mask: NDArray, count: int, extent: float) -> Region:
    table = pd.DataFrame(points, columns=surface.design.names)
    return Region(surface.design.factors, table, mask, count, extent)


def _cells(factor_count: int, extent: float, resolution: int | None) -> tuple[NDArray[np.float64], int]:
    """Return the centers of a box's cells, shape (cells, factors), and the cells along each factor."""
    count = resolution or min(2_000, max(4, int(CELL_BUDGET ** (1.0 / factor_count))))
    centers = extent * ((2.0 * np.arange(count) + 1.0) / count - 1.0)
    return np.stack(np.meshgrid(*[centers] * factor_count, indexing="ij"), axis=-1).reshape(
        -1, factor_count
    ), count


def _contour_points(surface: Surface, target: float, extent: float, resolution: int | None) -> pd.DataFrame:
    """Return coded contour points, index: piece."""
    names = surface.design.names
    if len(names) == 2:
        pieces = _traced_curves(surface, target, extent, resolution or CURVE_RESOLUTION)
    else:
        pieces = [_line_crossings(surface, target, extent, resolution)]
    index = pd.Index(np.repeat(np.arange(len(pieces)), [len(piece) for piece in pieces]), name="piece")
    stacked = np.vstack([*pieces, np.empty((0, len(names)))])
    return pd.DataFrame(stacked, columns=names, index=index)


def _traced_curves(
    surface: Surface, target: float, extent: float, resolution: int
) -> list[NDArray[np.float64]]:
    """Return the contour's curves in the square; each vertex is moved along its grid line onto the exact root."""
    grid = np.linspace(-extent, extent, resolution)
    x, y = np.meshgrid(grid, grid)
    mean, _ = surface.evaluate(np.column_stack([x.ravel(), y.ravel()]))
    lines = contourpy.contour_generator(grid, grid, mean.reshape(x.shape)).lines(target)
    form = quadratic_form(surface)
    return [np.array([_onto_root(form, target, vertex, grid) for vertex in line]) for line in lines]


def _onto_root(form: tuple, target: float, vertex: NDArray, grid: NDArray) -> NDArray[np.float64]:
    """Return a vertex of marching squares moved along the grid edge that it lies on to the nearest exact root."""
    off_grid = np.abs(vertex[:, None] - grid[None, :]).min(axis=1)
    axis = int(off_grid.argmax())
    roots = _roots_along(form, target, vertex[None, :], axis)[0]
    distance = np.abs(roots - vertex[axis])
    moved = vertex.copy()
    if np.nanmin(distance, initial=np.inf) < grid[1] - grid[0]:
        moved[axis] = roots[np.nanargmin(distance)]
    return moved


def _line_crossings(
    surface: Surface, target: float, extent: float, resolution: int | None
) -> NDArray[np.float64]:
    """Return where lines parallel to each axis cross the contour inside the box."""
    count = len(surface.design.factors)
    along = resolution or max(5, int((LINE_BUDGET / count) ** (1.0 / max(count - 1, 1))))
    grid = np.linspace(-extent, extent, along)
    form = quadratic_form(surface)
    crossings = []
    for axis in range(count):
        others = np.stack(np.meshgrid(*[grid] * (count - 1), indexing="ij"), axis=-1).reshape(-1, count - 1)
        lines = np.insert(others, axis, 0.0, axis=1) if count > 1 else np.zeros((1, 1))
        roots = _roots_along(form, target, lines, axis)
        for root in roots.T:
            points = lines.copy()
            points[:, axis] = root
            crossings.append(points[np.abs(root) <= extent])
    return np.vstack(crossings)


def _roots_along(form: tuple, target: float, lines: NDArray, axis: int) -> NDArray[np.float64]:
    """Return both roots along one axis of (constant + slopes'x + x'Bx = target), shape (lines, 2); NaN if none."""
    constant, slopes, matrix = form
    base = lines.copy()
    base[:, axis] = 0.0
    c = constant - target + base @ slopes + np.einsum("ij,jk,ik->i", base, matrix, base)
    b = slopes[axis] + 2.0 * base @ matrix[:, axis]
    a = matrix[axis, axis]
    with np.errstate(invalid="ignore", divide="ignore"):
        # Citardauq form: stable for a near 0, where one root runs to infinity (NaN or inf: outside any box).
        q = -0.5 * (b + np.where(b < 0.0, -1.0, 1.0) * np.sqrt(b * b - 4.0 * a * c))
        return np.column_stack([q / a, c / q])


def _refined(
    surface: Surface, target: float, start: NDArray, origin: NDArray, extent: float
) -> NDArray[np.float64]:
    """Return the contour's point nearest to the origin, searched from a point of the contour."""
    constant, slopes, form = quadratic_form(surface)
    result = optimize.minimize(
        lambda x: (x - origin) @ (x - origin),
        start,
        jac=lambda x: 2.0 * (x - origin),
        bounds=[(-extent, extent)] * len(start),
        constraints={
            "type": "eq",
            "fun": lambda x: constant - target + slopes @ x + x @ form @ x,
            "jac": lambda x: slopes + 2.0 * form @ x,
        },
        method="SLSQP",
        options={"ftol": 1e-15, "maxiter": 200},
    )
    reached = abs(constant - target + slopes @ result.x + result.x @ form @ result.x)
    return result.x if result.success and reached <= 1e-9 * max(1.0, abs(target)) else start
