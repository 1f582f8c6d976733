"""Figures for print (matplotlib): every function returns a Figure and shows nothing."""

from collections.abc import Mapping, Sequence
from itertools import cycle

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from numpy.typing import ArrayLike

from doe.agreement import Agreement
from doe.palette import BLUE, GREEN, MUTED, ORANGE, VERMILION
from doe.plot_data import (
    half_normal_points,
    normal_points,
    pareto_points,
    surface_grid,
)
from doe.region import Region
from doe.screening import ScreenResult
from doe.steepest import ClimbPath, climb_table
from doe.surface import Surface

WIDTH = 6.3
"""Inches: the text width of an A4 page."""


def pareto_chart(
    result: ScreenResult, alphas: Sequence[float] = (0.10, 0.05), bonferroni: float | None = 0.05
) -> Figure:
    """Draw the absolute t of every factor, largest first, with the critical values of some levels."""
    points = pareto_points(result)
    figure = Figure(figsize=(WIDTH, 3.6), layout="constrained")
    axes = figure.subplots()
    colors = [BLUE if effect > 0.0 else ORANGE for effect in points["effect"]]
    axes.bar(points.index, points["abs_t"], color=colors, width=0.7)
    levels = [(result.critical_t(alpha), f"p = {alpha:.2f}") for alpha in alphas]
    if bonferroni is not None:
        levels.append((result.critical_t(bonferroni, bonferroni=True), f"p = {bonferroni:.2f} (Bonferroni)"))
    for (height, label), style in zip(levels, ("--", "-", "-.", ":"), strict=False):
        axes.axhline(height, color="black", linestyle=style, linewidth=1.0)
        axes.annotate(
            f"{label}: {height:.2f}",
            (1.0, height),
            xycoords=("axes fraction", "data"),
            xytext=(-3, 2),
            textcoords="offset points",
            ha="right",
            va="bottom",
            fontsize=8,
        )
    signs = [Patch(color=BLUE, label="raises the response"), Patch(color=ORANGE, label="lowers it")]
    figure.legend(handles=signs, frameon=False, loc="outside upper right", ncols=2)
    axes.set(xlabel="factor", ylabel=f"|t| of the effect ({result.error_df:g} df)")
    axes.margins(y=0.12)
    return _plain(figure)


def half_normal_plot(result: ScreenResult, response_label: str = "response") -> Figure:
    """Draw the half-normal plot of all effects; hollow points are dummies, the line is the test's error."""
    points = half_normal_points(result.effects)
    figure = Figure(figsize=(WIDTH, 3.8), layout="constrained")
    axes = figure.subplots()
    dummy = points.index.isin(result.design.dummies)
    for chosen, fill, label in ((~dummy, BLUE, "factor"), (dummy, "white", "dummy")):
        if chosen.any():
            part = points[chosen]
            axes.scatter(part["abs_effect"], part["quantile"], c=fill, edgecolors=BLUE, zorder=3, label=label)
    for name, row in points.iterrows():
        axes.annotate(
            str(name), (row["abs_effect"], row["quantile"]), xytext=(6, -3), textcoords="offset points"
        )
    top = float(points["quantile"].max())
    error = float(result.standard_error.median())
    axes.plot([0.0, error * top], [0.0, top], color=MUTED, linewidth=1.0, label="error alone")
    axes.set(xlabel=f"|effect| on the {response_label}", ylabel="half-normal quantile")
    axes.set_xlim(left=0.0)
    axes.set_ylim(bottom=0.0)
    axes.margins(x=0.1)
    axes.legend(frameon=False, loc="lower right")
    return _plain(figure)


def climb_plot(
    path: ClimbPath,
    response: ArrayLike,
    target: float,
    target_sd: float | None = None,
    response_label: str = "response",
) -> Figure:
    """Draw the mean response along a path against the model's prediction and the target, its sd as a band."""
    table = climb_table(path, response, target)
    figure = Figure(figsize=(WIDTH, 3.8), layout="constrained")
    axes = figure.subplots()
    axes.axhline(target, color=VERMILION, linewidth=1.2, label=f"target {target:g}")
    if target_sd is not None:
        axes.axhspan(target - target_sd, target + target_sd, color=VERMILION, alpha=0.15, linewidth=0.0)
    steps = np.arange(len(table))
    axes.plot(steps, path.predicted, color=MUTED, linestyle="--", label="predicted")
    axes.plot(steps, table["response"], color=BLUE, marker="o", label="run")
    settings = ["\n".join(f"{row[name]:.4g}" for name in path.names) for _, row in path.natural.iterrows()]
    axes.set_xticks(steps, settings)
    axes.set(xlabel=", ".join(factor.label for factor in path.factors), ylabel=response_label)
    axes.legend(frameon=False)
    return _plain(figure)


def residual_plots(surface: Surface) -> Figure:
    """Draw the studentized residuals: normal plot, and against the fitted response."""
    residuals = surface.studentized_residuals.dropna()
    points = normal_points(residuals)
    figure = Figure(figsize=(WIDTH, 3.1), layout="constrained")
    left, right = figure.subplots(1, 2)
    reach = 1.1 * max(points.abs().to_numpy().max(), 1.0)
    left.plot([-reach, reach], [-reach, reach], color=MUTED, linewidth=1.0)
    left.scatter(points["value"], points["quantile"], color=BLUE, zorder=3)
    left.set(xlabel="studentized residual", ylabel="normal quantile")
    right.axhline(0.0, color=MUTED, linewidth=1.0)
    for limit in (-3.0, 3.0):
        right.axhline(limit, color=VERMILION, linestyle="--", linewidth=1.0)
    right.scatter(surface.fitted[surface.studentized_residuals.notna()], residuals, color=BLUE, zorder=3)
    right.set(xlabel="fitted response", ylabel="studentized residual")
    return _plain(figure)


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
) -> Figure:
    """Draw the fitted surface as contours over two factors.

    With the target's curve, a chosen point (natural values by factor), a compatible region (in more than two
    factors: its shadow on the plane of the axes) and the design's runs. ``x``, ``y``, ``at``, ``extent`` as
    in ``doe.plot_data.surface_grid``; factors off the axes are held at the point when there is one.
    """
    held = at if point is None or at is not None else {name: point[name] for name in surface.design.names}
    grid = surface_grid(surface, x, y, held, extent, resolution=121)
    x_name, y_name = grid.x_factor.name, grid.y_factor.name
    figure = Figure(figsize=(WIDTH, 4.8), layout="constrained")
    axes = figure.subplots()
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
    figure.legend(handles=legend, loc="outside upper center", ncols=4, frameon=False)
    return figure


def surface_plot(
    surface: Surface,
    target: float | None = None,
    x: str | None = None,
    y: str | None = None,
    at: Mapping[str, float] | None = None,
    extent: float = 1.0,
    response_label: str = "response",
) -> Figure:
    """Draw the fitted surface over two factors in perspective, with the target's curve on it."""
    grid = surface_grid(surface, x, y, at, extent, resolution=41)
    figure = Figure(figsize=(WIDTH, 5.0), layout="constrained")
    axes = figure.add_subplot(projection="3d", computed_zorder=False)
    axes.plot_surface(*np.meshgrid(grid.x, grid.y), grid.mean, cmap="cividis", alpha=0.85, linewidth=0.2)
    if target is not None and grid.mean.min() < target < grid.mean.max():
        curve = {"levels": [target], "colors": [VERMILION], "linewidths": 3.0}
        axes.contour(*np.meshgrid(grid.x, grid.y), grid.mean, **curve)
    axes.set(xlabel=grid.x_factor.label, ylabel=grid.y_factor.label, zlabel=response_label)
    axes.view_init(elev=24.0, azim=-128.0)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_major_locator(MaxNLocator(4))
        axis.labelpad = 8.0
    axes.set_box_aspect(None, zoom=0.85)
    return figure


def agreement_plot(
    result: Agreement,
    groups: Sequence[str],
    value_label: str = "value",
    reference_label: str = "reference",
) -> Figure:
    """Draw values against their reference, one colour a group, with the noise (+- 1 sd) of both.

    Parameters
    ----------
    result : Agreement
    groups : sequence of str, one a run
    value_label, reference_label : str
    """
    figure = Figure(figsize=(WIDTH, 4.6), layout="constrained")
    axes = figure.subplots()
    ends = [
        min(result.response.min(), result.reference.min()),
        max(result.response.max(), result.reference.max()),
    ]
    axes.plot(ends, ends, color=MUTED, linewidth=1.0, linestyle="--", label="equal")
    names = list(dict.fromkeys(groups))
    for name, color in zip(names, cycle((BLUE, VERMILION, GREEN, ORANGE)), strict=False):
        rows = np.flatnonzero(np.asarray(groups) == name)
        axes.errorbar(
            result.reference[rows],
            result.response[rows],
            xerr=np.sqrt(result.reference_variance),
            yerr=np.sqrt(result.value_variance[rows]),
            fmt="o",
            markersize=5,
            color=color,
            elinewidth=0.8,
            label=name,
        )
    axes.set(xlabel=reference_label, ylabel=value_label)
    axes.set_aspect("equal", adjustable="datalim")
    axes.legend(frameon=False, fontsize=8, loc="upper left")
    return _plain(figure)


def _draw_region(axes: Axes, region: Region, x: str, y: str) -> Patch:
    """Hatch the region's shadow on the plane of two factors; return its key."""
    drawn = (region.axis(x), region.axis(y), region.projection(x, y).T.astype(float))
    axes.contourf(*drawn, levels=[0.5, 1.5], colors=["white"], alpha=0.35)
    axes.contour(*drawn, levels=[0.5], colors=["white"], linewidths=1.5)
    return Patch(facecolor="white", edgecolor=MUTED, label=f"compatible: {100.0 * region.fraction:.0f} %")


def _plain(figure: Figure) -> Figure:
    for axes in figure.axes:
        axes.spines[["top", "right"]].set_visible(False)
    return figure
