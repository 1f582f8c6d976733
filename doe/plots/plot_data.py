"""The numbers behind the figures, for any plotting library."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import stats

from doe.arguments import checked_count, checked_kind, checked_map, checked_number
from doe.design.design import checked_setting, coded_points
from doe.design.factors import Factor
from doe.errors import DesignError
from doe.response.response_surface import Surface
from doe.response.transfer import Transfer
from doe.screen.screened_effects import ScreenResult

MOST_POINTS = 2_000
"""Largest number of points along an axis of a figure."""


@dataclass(frozen=True, eq=False)
class SurfaceGrid:
    """Fitted means over a rectangle of two factors, the others held."""

    x_factor: Factor
    y_factor: Factor
    x: NDArray[np.float64]
    """Natural values of the first factor, shape (resolution,)."""
    y: NDArray[np.float64]
    """Natural values of the second factor, shape (resolution,)."""
    mean: NDArray[np.float64]
    """Fitted means, shape (resolution of y, resolution of x)."""
    se: NDArray[np.float64]
    """Standard errors of the means, same shape."""


def pareto_points(result: ScreenResult) -> pd.DataFrame:
    """Return abs_t, effect and percent of every factor, largest first."""
    table = result.table.sort_values("rank")
    return pd.DataFrame({"abs_t": table["t"].abs(), "effect": table["effect"], "percent": table["percent"]})


def half_normal_points(effects: pd.Series) -> pd.DataFrame:
    """Return abs_effect and half-normal quantile of every effect, ascending (Daniel 1959).

    Inert effects are on a line through the origin, active ones on the large side of it. The quantile of the
    i-th of m is that of (i - 1/2) / m.
    """
    ordered = effects.abs().sort_values()
    share = (np.arange(1, len(ordered) + 1) - 0.5) / len(ordered)
    return pd.DataFrame({"abs_effect": ordered, "quantile": stats.halfnorm.ppf(share)})


def normal_points(values: pd.Series) -> pd.DataFrame:
    """Return value and normal quantile of every value, ascending; the i-th of n has that of (i - 1/2) / n."""
    ordered = values.sort_values()
    share = (np.arange(1, len(ordered) + 1) - 0.5) / len(ordered)
    return pd.DataFrame({"value": ordered, "quantile": stats.norm.ppf(share)})


def surface_grid(
    surface: Surface | Transfer,
    x: str | None = None,
    y: str | None = None,
    at: Mapping[str, float] | None = None,
    extent: float = 1.0,
    resolution: int = 61,
) -> SurfaceGrid:
    """Return the fitted surface over two factors.

    Parameters
    ----------
    x, y : str, optional
        Names of the factors on the axes. Default: the first two.
    at : mapping of natural values by factor, optional
        Settings of the other factors. Default: their centers.
    extent : float
        Coded half width of the rectangle.
    resolution : int
        Points along each axis.
    """
    fit = surface if isinstance(surface, Transfer) else checked_kind("surface", surface, Surface)
    design = fit.design
    checked_number("extent", extent, above=0.0)
    resolution = checked_count("resolution", resolution, least=2, most=MOST_POINTS)
    if len(design.factors) < 2:
        raise DesignError(f"a surface is drawn over two factors, the design has only {design.names[0]!r}")
    x_factor, y_factor = (
        design.factor(fallback if name is None else name)
        for name, fallback in zip((x, y), design.names, strict=False)
    )
    if x_factor == y_factor:
        raise DesignError(f"x and y must be different factors, got {x_factor.name!r} twice")
    centers = {factor.name: factor.center for factor in design.factors}
    held = checked_setting("at", centers | ({} if at is None else checked_map("at", at)), design.factors)
    line = np.linspace(-extent, extent, resolution)
    x_values, y_values = x_factor.to_natural(line), y_factor.to_natural(line)
    points = pd.DataFrame(held, index=range(resolution**2))
    points[x_factor.name] = np.tile(x_values, resolution)
    points[y_factor.name] = np.repeat(y_values, resolution)
    mean, se = surface.evaluate(coded_points(design.factors, points))
    shape = (resolution, resolution)
    return SurfaceGrid(x_factor, y_factor, x_values, y_values, mean.reshape(shape), se.reshape(shape))
