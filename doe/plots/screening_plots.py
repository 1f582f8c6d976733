"""Figures of a screening: effects by size, and against the half-normal distribution."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from doe.arguments import checked_kind, checked_list
from doe.design.families.quality import DesignQuality
from doe.errors import DesignError
from doe.plots.palette import BLUE, MUTED, ORANGE
from doe.plots.plot_data import half_normal_points, pareto_points
from doe.plots.style import canvas, key, plain
from doe.screen.screened_effects import ScreenResult
from doe.screen.two_level_effects import TwoLevelEffects


def pareto_chart(
    result: ScreenResult,
    alphas: Sequence[float] = (0.10, 0.05),
    bonferroni: float | None = 0.05,
    axes: Axes | None = None,
) -> Figure:
    """Draw the absolute t of every factor, largest first, with the critical values of some levels."""
    checked_kind("result", result, ScreenResult)
    alphas = checked_list("alphas", alphas)
    points = pareto_points(result)
    given = axes is not None
    figure, axes = canvas(axes, 3.6)
    colors = [BLUE if effect > 0.0 else ORANGE for effect in points["effect"]]
    axes.bar(points.index, points["abs_t"], color=colors, width=0.7)
    levels = [(result.critical_t(alpha), f"p = {alpha:.2f}") for alpha in alphas]
    if bonferroni is not None:
        levels.append((result.critical_t(bonferroni, bonferroni=True), f"p = {bonferroni:.2f} (Bonferroni)"))
    handles: list[Patch | Line2D] = [
        Patch(color=BLUE, label="raises the response"),
        Patch(color=ORANGE, label="lowers it"),
    ]
    for (height, label), style in zip(levels, ("--", "-", "-.", ":"), strict=False):
        text = f"{label}: {height:.2f}"
        handles.append(axes.axhline(height, color="black", linestyle=style, linewidth=1.0, label=text))
    key(figure, axes, given, handles, 3)
    axes.set(xlabel="factor", ylabel=f"|t| of the effect ({result.error_df:g} df)")
    axes.margins(y=0.12)
    plain(axes)
    return figure


def precision_plot(quality: DesignQuality, axes: Axes | None = None) -> Figure:
    """Draw the standard error of a fitted mean, for an error of 1, that shares of the box stay below."""
    errors = np.sqrt(checked_kind("quality", quality, DesignQuality).variances)
    figure, axes = canvas(axes, 3.2)
    axes.plot(np.linspace(0.0, 100.0, len(errors)), errors, color=BLUE)
    axes.axhline(float(np.median(errors)), color=MUTED, linestyle="--", linewidth=1.0)
    axes.set(xlabel="share of the box [%]", ylabel="standard error of the mean", xlim=(0.0, 100.0))
    axes.set_ylim(bottom=0.0)
    plain(axes)
    return figure


def half_normal_plot(
    result: ScreenResult | TwoLevelEffects, response_label: str = "response", axes: Axes | None = None
) -> Figure:
    """Draw the half-normal plot of all effects; hollow points are dummies, the line is the test's error."""
    if not isinstance(result, ScreenResult | TwoLevelEffects):
        raise DesignError(f"result must be a ScreenResult or TwoLevelEffects, got {result!r}")
    points = half_normal_points(result.effects)
    figure, axes = canvas(axes, 3.8)
    dummy = points.index.isin(result.design.dummies)
    for chosen, fill, label in ((~dummy, BLUE, "effect"), (dummy, "white", "dummy")):
        if chosen.any():
            part = points[chosen]
            axes.scatter(part["abs_effect"], part["quantile"], c=fill, edgecolors=BLUE, zorder=3, label=label)
    for name, row in points.iterrows():
        axes.annotate(
            str(name), (row["abs_effect"], row["quantile"]), xytext=(6, -3), textcoords="offset points"
        )
    top = float(points["quantile"].max())
    error = (
        result.pseudo_error if isinstance(result, TwoLevelEffects) else float(result.standard_error.median())
    )
    axes.plot([0.0, error * top], [0.0, top], color=MUTED, linewidth=1.0, label="error alone")
    axes.set(xlabel=f"|effect| on the {response_label}", ylabel="half-normal quantile")
    axes.set_xlim(left=0.0)
    axes.set_ylim(bottom=0.0)
    axes.margins(x=0.1)
    axes.legend(frameon=False, loc="lower right")
    plain(axes)
    return figure
