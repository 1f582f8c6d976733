"""Figures of the effect of each factor: main effects, interactions, the cube, the prediction profiler."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from doe.arguments import checked_kind, checked_list, checked_map
from doe.design.design import Design, checked_setting, observations
from doe.design.factors import Category, Factor
from doe.errors import DesignError
from doe.plots.palette import BLUE, MUTED, ORANGE, VERMILION
from doe.plots.style import WIDTH, canvas, plain
from doe.response.analysis.desirability import Wish, checked_surfaces
from doe.response.response_surface import Surface

DASHES = ("-", "--", ":", "-.")
GAP = 0.6
"""Room between two factors, in level widths."""


def level_means(
    design: Design, response: Sequence[float] | np.ndarray | pd.Series, *names: str
) -> pd.DataFrame:
    """Return mean, count and se by the levels of one or two factors, the index natural.

    The se of a mean takes the spread within its own runs, other factors' effects included; NaN for one run.
    """
    _, values = observations(design, response)
    natural = design.natural.loc[values.index, [design.factor(name).name for name in names]]
    groups = values.groupby([natural[name].to_numpy() for name in names], sort=True)
    table = pd.DataFrame({"mean": groups.mean(), "count": groups.count(), "se": groups.sem()})
    return table.rename_axis(list(names))


def main_effects_plot(
    design: Design,
    response: Sequence[float] | np.ndarray | pd.Series,
    response_label: str = "response",
    axes: Axes | None = None,
) -> Figure:
    """Draw the mean response at each level of every factor, on one scale; the dashed line is the mean."""
    figure, axes = canvas(axes, 3.6)
    _, values = observations(design, response)
    axes.axhline(values.mean(), color=MUTED, linestyle="--", linewidth=1.0)
    ticks: list[float] = []
    labels: list[str] = []
    start = 0.0
    for factor in design.factors:
        table = level_means(design, response, factor.name)
        places = start + np.arange(len(table)) / max(len(table) - 1, 1)
        axes.plot(places, table["mean"], color=BLUE, marker="o")
        ticks.extend(places.tolist())
        labels.extend(_level_text(factor, level) for level in table.index)
        axes.annotate(
            factor.label, (start + 0.5, 1.0), xycoords=("data", "axes fraction"), ha="center", va="bottom"
        )
        start += 1.0 + GAP
    axes.set_xticks(ticks, labels, rotation=90 if len(ticks) > 16 else 0, fontsize="small")
    axes.set(ylabel=f"mean {response_label}")
    axes.set_xlim(-0.5 * GAP, start - 0.5 * GAP)
    plain(axes)
    return figure


def interaction_plot(
    design: Design,
    response: Sequence[float] | np.ndarray | pd.Series,
    x: str,
    trace: str,
    response_label: str = "response",
    axes: Axes | None = None,
) -> Figure:
    """Draw the mean response against one factor, a line for each level of another."""
    if checked_kind("x", x, str) == checked_kind("trace", trace, str):
        raise DesignError(f"factors of an interaction must differ, got {x!r} twice")
    figure, axes = canvas(axes, 3.6)
    table = level_means(design, response, x, trace).reset_index().pivot_table("mean", x, trace)
    numeric = not isinstance(design.factor(x), Category)
    places = table.index.to_numpy(dtype=float) if numeric else np.arange(len(table))
    if len(table.columns) > len(DASHES):
        raise DesignError(
            f"up to {len(DASHES)} lines can be distinguished, but {trace!r} has {len(table.columns)} levels"
        )
    for level, dash, color in zip(table, DASHES, (BLUE, ORANGE, VERMILION, MUTED), strict=False):
        label = f"{trace} = {_level_text(design.factor(trace), level)}"
        line = table[level].notna().to_numpy()
        axes.plot(places[line], table[level][line], color=color, linestyle=dash, marker="o", label=label)
    axes.set_xticks(places, [_level_text(design.factor(x), level) for level in table.index])
    axes.set(xlabel=design.factor(x).label, ylabel=f"mean {response_label}")
    axes.legend(frameon=False, fontsize="small")
    plain(axes)
    return figure


def cube_plot(
    surface: Surface,
    factors: Sequence[str] | None = None,
    at: Mapping[str, float] | None = None,
    response_label: str = "response",
    axes: Axes | None = None,
) -> Figure:
    """Draw the fitted response at the corners of three factors (default: the first), the others at ``at``."""
    checked_kind("surface", surface, Surface)
    names = surface.design.names[:3] if factors is None else checked_list("factors", factors)
    chosen = [surface.design.factor(name) for name in names]
    if len(set(names)) != 3 or len(names) != 3:
        raise DesignError(f"factors of a cube must be three different ones, got {names}")
    centers = {
        factor.name: factor.to_natural(factor.codes[0] if isinstance(factor, Category) else 0.0)
        for factor in surface.design.factors
    }
    chosen_at = {} if at is None else checked_map("at", at)
    held = checked_setting("at", centers | chosen_at, surface.design.factors)
    figure, axes = canvas(axes, 4.2)
    corners = np.array([[a, b, c] for c in (0, 1) for b in (0, 1) for a in (0, 1)], dtype=float)
    points = pd.DataFrame([held] * 8)
    for place, factor in enumerate(chosen):
        points[factor.name] = [factor.to_natural(2.0 * corner - 1.0) for corner in corners[:, place]]
    means = surface.predict(points)["mean"].to_numpy()
    flat = corners[:, :2] + corners[:, [2]] * np.array([[0.45, 0.38]])
    for i in range(8):
        for j in range(i + 1, 8):
            if np.abs(corners[i] - corners[j]).sum() == 1.0:
                hidden = 4 in (i, j)
                axes.plot(
                    *flat[[i, j]].T, color=MUTED, linewidth=1.0, linestyle=":" if hidden else "-", zorder=1
                )
    for place, mean in zip(flat, means, strict=True):
        box = {"boxstyle": "round,pad=0.25", "facecolor": "white", "edgecolor": BLUE}
        axes.annotate(f"{mean:.4g}", place, ha="center", va="center", bbox=box, zorder=3)
    ends = [[_level_text(factor, factor.to_natural(sign)) for sign in (-1.0, 1.0)] for factor in chosen]
    axes.annotate(f"{chosen[0].label}: {ends[0][0]} to {ends[0][1]}", (0.5, -0.14), ha="center", va="top")
    axes.annotate(
        f"{chosen[1].label}: {ends[1][0]} to {ends[1][1]}", (-0.16, 0.5), ha="right", va="center", rotation=90
    )
    axes.annotate(
        f"{chosen[2].label}: {ends[2][0]} to {ends[2][1]}", (1.3, 0.1), ha="left", va="center", rotation=40
    )
    axes.set_xlim(-0.35, 1.75)
    axes.set_ylim(-0.3, 1.55)
    axes.set_axis_off()
    axes.set_title(f"fitted {response_label}", fontsize="medium")
    return figure


def profile_plot(
    surfaces: Mapping[str, Surface],
    at: Mapping[str, float],
    wishes: Mapping[str, Wish] | None = None,
    alpha: float = 0.05,
    axes: np.ndarray | None = None,
) -> Figure:
    """Draw the prediction profiler: each response against each factor, the others held at a setting.

    The bands hold the mean response with probability 1 - alpha, the dashed lines the setting. With wishes a
    last row shows the overall desirability.

    Parameters
    ----------
    surfaces : mapping of Surface by response
        Surfaces over the same factors.
    at : mapping of natural values by factor
        The setting, e.g. that of ``most_desirable``.
    axes : array of Axes, shape (responses, factors), optional
        One row more with wishes.
    """
    design = checked_surfaces(surfaces)
    at = checked_setting("the setting of the profiler", at, design.factors)
    if wishes is not None and set(checked_map("wishes", wishes)) != set(surfaces):
        raise DesignError(f"wishes must be for every surface, got {sorted(surfaces)} and {sorted(wishes)}")
    for name, wish in ({} if wishes is None else wishes).items():
        checked_kind(f"wish of {name!r}", wish, Wish)
    rows = len(surfaces) + (wishes is not None)
    if axes is None:
        figure = Figure(figsize=(WIDTH, 0.6 + 1.7 * rows), layout="constrained")
        axes = figure.subplots(rows, len(design.factors), squeeze=False, sharex="col", sharey="row")
    axes = np.asarray(axes, dtype=object).reshape(rows, -1)
    if axes.shape != (rows, len(design.factors)):
        raise DesignError(f"a profiler takes axes in the shape {(rows, len(design.factors))}: {axes.shape}")
    figure, _ = canvas(axes[0, 0], 0.0)
    for column, factor in enumerate(design.factors):
        points, places = _line(design, at, factor)
        for row, (name, surface) in enumerate(surfaces.items()):
            _draw_profile(axes[row, column], places, surface.predict(points, alpha))
            if column == 0:
                axes[row, 0].set_ylabel(name)
        if wishes is not None:
            total = sum(wish.importance for wish in wishes.values())
            shares = [
                wish.of(surfaces[name].predict(points)["mean"].to_numpy()) ** (wish.importance / total)
                for name, wish in wishes.items()
            ]
            axes[-1, column].plot(places, np.prod(shares, axis=0), color=BLUE)
            axes[-1, column].set_ylim(-0.03, 1.03)
            axes[-1, 0].set_ylabel("desirability")
        value = at[factor.name]
        mark = factor.to_coded(value) if isinstance(factor, Category) else value
        for place in axes[:, column]:
            place.axvline(mark, color=VERMILION, linestyle="--", linewidth=1.0)
            plain(place)
        axes[-1, column].set_xlabel(factor.label)
        if isinstance(factor, Category):
            axes[-1, column].set_xticks(factor.codes, factor.levels)
    return figure


def _line(design: Design, at: Mapping[str, float], factor: Factor) -> tuple[pd.DataFrame, np.ndarray]:
    """Return the points along one factor through a setting, and where they are drawn."""
    coded = np.array(factor.codes) if isinstance(factor, Category) else np.linspace(-1.0, 1.0, 61)
    points = pd.DataFrame([{name: at[name] for name in design.names}] * len(coded))
    points[factor.name] = [factor.to_natural(value) for value in coded]
    return points, coded if isinstance(factor, Category) else points[factor.name].to_numpy()


def _draw_profile(axes: Axes, places: np.ndarray, predicted: pd.DataFrame) -> None:
    axes.fill_between(
        places,
        predicted["confidence_low"],
        predicted["confidence_high"],
        color=BLUE,
        alpha=0.2,
        linewidth=0.0,
    )
    axes.plot(places, predicted["mean"], color=BLUE)


def _level_text(factor: Factor, level: object) -> str:
    return str(level) if isinstance(factor, Category) else f"{level:.4g}"
