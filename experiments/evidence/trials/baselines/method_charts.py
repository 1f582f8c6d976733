"""Pictures of the record of the methods: curves of their scores, and their power."""

from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from doe.plots.palette import GRID, SERIES
from experiments.evidence.page_figures import save_figure
from experiments.evidence.trials.baselines.method_tables import (
    Parts,
    alarm_scores,
    has_outside,
    outside_scores,
    power,
)


def draw_roc(table: pd.DataFrame, path: Path) -> None:
    """Draw the curves of the alarm, and of *unknown*, side by side."""
    figure = Figure(figsize=(9.0, 4.6), layout="constrained")
    axes = figure.subplots(1, 2, sharey=True)
    for colour, (name, rows) in zip(SERIES, table.groupby("method", sort=False), strict=False):
        parts = Parts(rows)
        _curve(axes[0], *alarm_scores(parts), colour, str(name))
        if has_outside(parts):
            _curve(axes[1], *outside_scores(parts), colour, None)
    titles = (
        ("alarms where nothing is hidden", "alarms where something is", "alarm"),
        ("unknown, though in the library", "unknown, and not in it", "unknown"),
    )
    for each, (negative, positive, title) in zip(axes, titles, strict=True):
        each.plot([0, 1], [0, 1], color=GRID, linewidth=1.0, zorder=0)
        each.spines[["top", "right"]].set_visible(False)
        each.set(xlabel=f"share: {negative}", title=title, xlim=(-0.02, 1.02), ylim=(-0.02, 1.02))
        each.set_ylabel(f"share: {positive}")
    figure.legend(frameon=False, loc="outside lower center", ncols=4)
    save_figure(figure, path)


def _curve(axes: Axes, positive: np.ndarray, negative: np.ndarray, colour: str, label: str | None) -> None:
    """Draw shares of both classes above each limit."""
    if not len(positive) or not len(negative):
        return
    limits = np.unique(np.concatenate([positive, negative]))[::-1]
    x = [0.0, *((negative >= limit).mean() for limit in limits)]
    y = [0.0, *((positive >= limit).mean() for limit in limits)]
    # the first method is drawn over the others
    axes.plot(x, y, color=colour, linewidth=1.6, label=label, zorder=3.0 - 0.1 * SERIES.index(colour))


def draw_power(table: pd.DataFrame, path: Path) -> None:
    """Draw shares of alarms, and of right names, by multiple of the detectable size."""
    figure = Figure(figsize=(9.0, 4.4), layout="constrained")
    axes = figure.subplots(1, 2, sharey=True)
    for each, column, title in zip(axes, ("alarm", "named_right"), ("alarm", "named"), strict=True):
        shares = power(table, column).drop(columns="trials")
        for number, (colour, name) in enumerate(zip(SERIES, shares.columns, strict=False)):
            aside = 0.02 * (number - len(shares.columns) / 2)
            label = str(name) if column == "alarm" else None
            places, values = shares.index.to_numpy() + aside, shares[name]
            each.plot(places, values, color=colour, marker="o", markersize=3, linewidth=1.4, label=label)
        each.spines[["top", "right"]].set_visible(False)
        each.grid(axis="y", color=GRID)
        each.set(xlabel="size [detectable ones]", title=title, ylim=(-0.03, 1.03))
    axes[0].set_ylabel("share of trials")
    figure.legend(frameon=False, loc="outside lower center", ncols=4)
    save_figure(figure, path)
