"""Figures of a fitted surface: contours, perspective, residuals."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from doe.arguments import checked_kind, checked_number
from doe.design.design import checked_setting
from doe.errors import DesignError
from doe.plots.palette import BLUE, MUTED, VERMILION
from doe.plots.plot_data import normal_points, surface_grid
from doe.plots.style import WIDTH, canvas, key, plain
from doe.response.analysis.formula import LinearFit
from doe.response.region import Region
from doe.response.response_surface import Surface


def residual_plots(surface: Surface | LinearFit, axes: tuple[Axes, Axes] | None = None) -> Figure:
    """Draw the studentized residuals: normal plot, and against the fitted response (two axes)."""
    if not isinstance(surface, Surface | LinearFit):
        raise DesignError(f"surface must be a Surface or LinearFit, got {surface!r}")
    residuals = surface.studentized_residuals.dropna()
    points = normal_points(residuals)
    if axes is None:
        axes = tuple(Figure(figsize=(WIDTH, 3.1), layout="constrained").subplots(1, 2))
    left, right = axes
    figure, _ = canvas(left, 3.1)
    reach = 1.1 * max(points.abs().to_numpy().max(), 1.0)
    left.plot([-reach, reach], [-reach, reach], color=MUTED, linewidth=1.0)
    left.scatter(points["value"], points["quantile"], color=BLUE, zorder=3)
    left.set(xlabel="studentized residual", ylabel="normal quantile")
    right.axhline(0.0, color=MUTED, linewidth=1.0)
    for limit in (-3.0, 3.0):
        right.axhline(limit, color=VERMILION, linestyle="--", linewidth=1.0)
    right.scatter(surface.fitted[surface.studentized_residuals.notna()], residuals, color=BLUE, zorder=3)
    right.set(xlabel="fitted response", ylabel="studentized residual")
    plain(left)
    plain(right)
    return figure


def contour_plot(
    surface: Surface,
    target: float | None = None,
    point: pd.Series | None = None,
    region: Region | None = None,
    x: str | None = None,
    y: str | None = None,
    at: Mapping[str, float] | None = None,
    extent: float = 1.0,
    response_label: str = "response",
    axes: Axes | None = None,
) -> Figure:
    """Draw the fitted surface as contours over two factors.

    Further parts: the target's curve, a chosen point (natural values by factor), a compatible region (in more
    than two factors: its shadow on the plane of the axes) and the design's runs. ``x``, ``y``, ``at``,
    ``extent`` are those of ``doe.plots.plot_data.surface_grid``; factors off the axes are held at the point
    if there is one.
    """
    checked_kind("surface", surface, Surface)
    if point is not None:
        point = checked_setting("point", point, surface.design.factors)
    if region is not None:
        checked_kind("region", region, Region)
    if target is not None:
        checked_number("target", target)
    held = at if point is None or at is not None else point
    grid = surface_grid(surface, x, y, held, extent, resolution=121)
    x_name, y_name = grid.x_factor.name, grid.y_factor.name
    given = axes is not None
    figure, axes = canvas(axes, 4.8)
    filled = axes.contourf(grid.x, grid.y, grid.mean, levels=14, cmap="cividis", alpha=0.75)
    figure.colorbar(filled, ax=axes, label=response_label)
    legend: list[Line2D | Patch] = []
    if region is not None and region.mask.any():
        legend.append(_draw_region(axes, region, x_name, y_name))
    if target is not None and grid.mean.min() < target < grid.mean.max():
        axes.contour(grid.x, grid.y, grid.mean, levels=[target], colors=[VERMILION], linewidths=2.0)
        legend.append(Line2D([], [], color=VERMILION, linewidth=2.0, label=f"target {target:g}"))
    runs = surface.design.natural
    axes.plot(runs[x_name], runs[y_name], "o", color="black", markersize=4, clip_on=True)
    legend.append(Line2D([], [], marker="o", color="black", markersize=4, linestyle="", label="runs"))
    if point is not None:
        star = axes.plot(
            point[x_name], point[y_name], "*", color="white", markersize=14.0, label="chosen point"
        )
        star[0].set_markeredgecolor("black")
        legend.extend(star)
    axes.set(xlabel=grid.x_factor.label, ylabel=grid.y_factor.label)
    axes.set(xlim=(grid.x[0], grid.x[-1]), ylim=(grid.y[0], grid.y[-1]))
    key(figure, axes, given, legend, 4)
    return figure


def surface_plot(
    surface: Surface,
    target: float | None = None,
    x: str | None = None,
    y: str | None = None,
    at: Mapping[str, float] | None = None,
    extent: float = 1.0,
    response_label: str = "response",
    axes: Axes | None = None,
) -> Figure:
    """Draw the fitted surface over two factors in perspective (3d axes), with the target's curve."""
    if target is not None:
        checked_number("target", target)
    grid = surface_grid(surface, x, y, at, extent, resolution=41)
    if axes is None:
        figure = Figure(figsize=(WIDTH, 5.0), layout="constrained")
        axes = figure.add_subplot(projection="3d", computed_zorder=False)
    figure, _ = canvas(axes, 5.0)
    solid: Any = axes  # the projection has further methods, unknown to the types of matplotlib
    solid.plot_surface(*np.meshgrid(grid.x, grid.y), grid.mean, cmap="cividis", alpha=0.85, linewidth=0.2)
    if target is not None and grid.mean.min() < target < grid.mean.max():
        curve = {"levels": [target], "colors": [VERMILION], "linewidths": 3.0}
        solid.contour(*np.meshgrid(grid.x, grid.y), grid.mean, **curve)
    solid.set(xlabel=grid.x_factor.label, ylabel=grid.y_factor.label, zlabel=response_label)
    solid.view_init(elev=24.0, azim=-128.0)
    for axis in (solid.xaxis, solid.yaxis, solid.zaxis):
        axis.set_major_locator(MaxNLocator(4))
        axis.labelpad = 8.0
    solid.set_box_aspect(None, zoom=0.85)
    return figure


def _draw_region(axes: Axes, region: Region, x: str, y: str) -> Patch:
    """Hatch the region's shadow on the plane of two factors; return its key."""
    drawn = (region.axis(x), region.axis(y), region.projection(x, y).T.astype(float))
    axes.contourf(*drawn, levels=[0.5, 1.5], colors=["white"], alpha=0.35)
    axes.contour(*drawn, levels=[0.5], colors=["white"], linewidths=1.5)
    return Patch(facecolor="white", edgecolor=MUTED, label=f"compatible: {100.0 * region.fraction:.0f} %")
