"""Regions of a surface: the settings that a measured target does not contradict."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from doe.arguments import checked_count, checked_df, checked_number
from doe.design.design import natural_points
from doe.design.factors import Factor
from doe.errors import DesignError
from doe.response.quadratic import FittedSurface, unselected
from doe.samples.sample import Sample
from doe.samples.two_errors import TwoErrors

CELL_BUDGET = 160_000
"""Number of cells of a region, over all factors."""

CELLS_MOST = 20_000_000
"""Largest number of cells that may be requested: they are held in memory at once."""

CELLS_PER_FACTOR = 2_000
"""Largest number of cells along one factor."""

NEAR_EDGE = 2
"""Cells from the edge of what was explored at which a region ends there: the edge is a staircase of cells."""


@dataclass(frozen=True, eq=False)
class Region:
    """Cells of a regular grid over the coded box -extent..+extent, with their membership."""

    factors: tuple[Factor, ...]
    coded: pd.DataFrame
    """Centers of all cells; the last factor varies fastest."""
    mask: NDArray[np.bool_]
    """True for cells of the region, shape (cells,)."""
    resolution: int
    """Cells along each factor."""
    extent: float
    explored: NDArray[np.bool_] | None = None
    """True for the cells that were tested; None: the whole box."""

    @cached_property
    def natural(self) -> pd.DataFrame:
        """Centers of all cells in natural units."""
        return natural_points(self.factors, self.coded)

    @property
    def fraction(self) -> float:
        """Share of the tested cells that belongs."""
        explored = self.mask.size if self.explored is None else np.count_nonzero(self.explored)
        return float(np.count_nonzero(self.mask) / explored)

    def projection(self, x: str, y: str) -> NDArray[np.bool_]:
        """Return the region's projection on the plane of two factors, shape (cells of x, cells of y)."""
        box, names = self._box(x, y)
        others = tuple(axis for axis, name in enumerate(names) if name not in (x, y))
        shadow = np.asarray(box.any(axis=others))
        return shadow if names.index(x) < names.index(y) else shadow.T

    def section(self, x: str, y: str, at: Mapping[str, float]) -> NDArray[np.bool_]:
        """Return the region's cut by the plane of two factors, the others held near ``at``."""
        box, names = self._box(x, y)
        held = {}
        for name in (name for name in names if name not in (x, y)):
            if name not in at:
                raise DesignError(f"a section must hold every other factor: no {name!r} in {dict(at)}")
            value = checked_number(f"the section's value of {name!r}", at[name])
            held[name] = int(np.abs(self.axis(name) - value).argmin())
        cut = np.asarray(box[tuple(slice(None) if name in (x, y) else held[name] for name in names)])
        return cut if names.index(x) < names.index(y) else cut.T

    def axis(self, name: str) -> NDArray[np.float64]:
        """Return the centers of the cells along one factor in natural units."""
        centers = self.extent * ((2.0 * np.arange(self.resolution) + 1.0) / self.resolution - 1.0)
        for factor in self.factors:
            if factor.name == name:
                return factor.to_natural(centers)
        raise DesignError(
            f"no axis is named {name!r}; the region has {', '.join(f.name for f in self.factors)}"
        )

    def _box(self, x: str, y: str) -> tuple[NDArray[np.bool_], list[str]]:
        """Return the mask with an axis for each factor, and the factors' names."""
        names = [factor.name for factor in self.factors]
        unknown = [name for name in (x, y) if name not in names]
        if unknown or x == y:
            raise DesignError(f"factors of a plane must be two of {', '.join(names)}, got {x!r} and {y!r}")
        return self.mask.reshape((self.resolution,) * len(names)), names

    @property
    def ranges(self) -> pd.DataFrame:
        """Natural low and high of each factor over the cells that belong, to their edges; NaN without cells.

        A range alone does not make a setting compatible: the factors trade off against one another.
        """
        half_cell = self.extent / self.resolution
        belonging = self.coded[self.mask]
        edges = pd.DataFrame({"low": belonging.min() - half_cell, "high": belonging.max() + half_cell}).T
        return natural_points(self.factors, edges).T.rename_axis("factor")

    @property
    def open_ends(self) -> pd.DataFrame:
        """True for each low and high end of ``ranges`` at the edge of what was tested: it may go on there."""
        shape = (self.resolution,) * len(self.factors)
        explored = np.ones_like(self.mask) if self.explored is None else self.explored
        ends = {}
        for axis, factor in enumerate(self.factors):
            inside, seen = (np.moveaxis(cells.reshape(shape), axis, 0) for cells in (self.mask, explored))
            seen = np.pad(seen.reshape(self.resolution, -1), ((NEAR_EDGE, NEAR_EDGE), (0, 0)))
            inside = inside.reshape(self.resolution, -1)
            layers = np.flatnonzero(inside.any(axis=1))[[0, -1]] if inside.any() else ()
            ends[factor.name] = [
                # of a straight band fewer of the last cells are near the edge
                bool(np.mean(~seen[layer + shift, inside[layer]]) >= 0.25)
                for layer, shift in zip(layers, (0, 2 * NEAR_EDGE), strict=False)
            ] or [False, False]
        return pd.DataFrame.from_dict(ends, orient="index", columns=["low", "high"]).rename_axis("factor")


def compatible_region(
    surface: FittedSurface,
    target: float | Sample,
    target_se: float = 0.0,
    target_df: float = np.inf,
    alpha: float = 0.05,
    extent: float = 1.0,
    resolution: int | None = None,
    radius: float | None = None,
) -> Region:
    """Return the settings whose fitted mean and the measured target do not differ significantly.

    A setting belongs when ``abs(mean - target) <= c sqrt(se_fit^2 + se_target^2)``, with c from the degrees
    of freedom of both errors and their shares (``doe.samples.two_errors``). So the true setting belongs with
    probability 1 - alpha, where the model holds: .94 to .96 for .95 with 3 measurements or more; with 2 at
    least .94, up to .98. For a surface whose terms the data chose (``doe.Surface.reduce``) the model before
    the choice counts.

    Parameters
    ----------
    target : float or Sample
        A Sample has its standard error and degrees of freedom.
    target_se, target_df : float
        Standard error of the target's mean and its degrees of freedom, when the target is a number.
    extent : float
        Coded half width of the box.
    resolution : int, optional
        Cells along each factor.
    radius : float, optional
        Coded distance from the centre beyond which nothing is tested, e.g. that of the farthest run.

    Raises DesignError: a target, an error, a level, an extent or a radius out of its range.
    """
    goal = _goal(target, target_se, target_df)
    points, count = box_cells(len(surface.design.factors), extent, resolution)
    difference, error, share, errors = misfit(surface, points, *goal)
    reach = np.inf if radius is None else checked_number("radius", radius, above=0.0)
    explored = np.linalg.norm(points, axis=1) <= reach
    mask = explored & (np.abs(difference) <= errors.critical(share, alpha) * error)
    return replace(_region(surface, points, mask, count, extent), explored=explored)


def agrees(surface: FittedSurface, coded: ArrayLike, target: Sample, alpha: float = 0.05) -> bool:
    """Return True if a target does not contradict the fitted mean at one coded point, by that rule."""
    difference, error, share, errors = misfit(surface, coded, *_goal(target, 0.0, np.inf))
    return bool(np.abs(difference[0]) <= errors.critical(share, alpha)[0] * error[0])


def misfit(
    surface: FittedSurface, coded: ArrayLike, goal: float, goal_se: float, goal_df: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], TwoErrors]:
    """Return fitted mean less target at coded points, its error, the target's share of it, and the rule.

    The share is that of the error's square; the rule gives the significance of such a difference.
    """
    basis = unselected(surface)
    mean, se = basis.evaluate(coded)
    total = se**2 + goal_se**2
    share = np.where(total > 0.0, goal_se**2 / np.where(total > 0.0, total, 1.0), 0.0)
    return mean - goal, np.sqrt(total), share, TwoErrors(float(basis.residual_df), float(goal_df))


def _goal(target: float | Sample, target_se: float, target_df: float) -> tuple[float, float, float]:
    """Return the target's mean, its standard error and its degrees of freedom."""
    if isinstance(target, Sample):
        return target.mean, target.se, float(target.df)
    return (
        checked_number("target", target),
        checked_number("target_se", target_se, least=0.0),
        checked_df("target_df", target_df),
    )


def band(
    surface: FittedSurface,
    target: float,
    half_width: float,
    extent: float = 1.0,
    resolution: int | None = None,
) -> Region:
    """Return the settings whose fitted mean is within target +- half_width, the fit taken as exact."""
    goal = checked_number("target", target)
    reach = checked_number("half_width", half_width, least=0.0)
    points, count = box_cells(len(surface.design.factors), extent, resolution)
    mean, _ = surface.evaluate(points)
    return _region(surface, points, np.abs(mean - goal) <= reach, count, extent)


def box_cells(
    factor_count: int, extent: float, resolution: int | None = None
) -> tuple[NDArray[np.float64], int]:
    """Return the centers of a coded box's cells, shape (cells, factors), and the cells along each factor."""
    checked_number("extent, the coded half width of the box,", extent, above=0.0)
    if resolution is None:
        count = min(CELLS_PER_FACTOR, max(3, int(CELL_BUDGET ** (1.0 / factor_count))))
    else:
        count = checked_count("resolution", resolution)
    if count**factor_count > CELLS_MOST:
        raise DesignError(
            f"a region must have at most {CELLS_MOST} cells, got {count} along each of {factor_count} factors"
        )
    centers = extent * ((2.0 * np.arange(count) + 1.0) / count - 1.0)
    cells = np.stack(np.meshgrid(*[centers] * factor_count, indexing="ij"), axis=-1)
    return cells.reshape(-1, factor_count), count


def _region(
    surface: FittedSurface, points: NDArray[np.float64], mask: NDArray[np.bool_], count: int, extent: float
) -> Region:
    table = pd.DataFrame(points, columns=surface.design.names)
    return Region(surface.design.factors, table, mask, count, extent)
