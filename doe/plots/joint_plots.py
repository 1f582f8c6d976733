"""Several responses for print (matplotlib): where each of them agrees with its target, and where all do."""

from collections.abc import Mapping, Sequence
from itertools import combinations, cycle
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from doe.arguments import checked_kind, checked_list
from doe.design.design import checked_setting
from doe.errors import DesignError
from doe.plots.palette import BLUE, GREEN, MUTED, ORANGE, PURPLE, VERMILION
from doe.plots.style import canvas, key
from doe.response.joint_fit import JointFit
from doe.response.region import Region

COLORS = (BLUE, ORANGE, PURPLE, MUTED)
"""Colours of the responses, in order."""

SIZES = {"D": 6.0, "*": 13.0}
"""Sizes of the markers [points]."""

PANEL = 3.4
"""Side of one plane [inches]."""


def joint_plot(
    fit: JointFit, truth: Mapping[str, float] | None = None, axes: Sequence[Axes] | None = None
) -> Figure:
    """Draw the bands of every response and their common region, a panel for each pair of factors.

    A panel cuts the regions where the other factors have the values of the smallest chi2.

    Parameters
    ----------
    truth : mapping of natural values by factor, optional
        Known true setting behind the responses.
    axes : sequence of Axes, optional
        Axes to draw on, one for each pair of factors. Default: a figure of its own.

    Raises DesignError: only one factor, or a true setting that lacks one.
    """
    checked_kind("fit", fit, JointFit)
    names = [factor.name for factor in fit.factors]
    pairs = list(combinations(names, 2))
    if not pairs:
        raise DesignError(f"responses are drawn over two factors, the design has only {names[0]!r}")
    if truth is not None:
        truth = checked_setting("the true setting", truth, fit.factors)
    if axes is None:
        figure = Figure(figsize=(PANEL * len(pairs), PANEL + 0.7), layout="constrained")
        panels = list(figure.subplots(1, len(pairs), squeeze=False)[0])
    else:
        panels = checked_list("axes", axes)
        if len(panels) != len(pairs):
            raise DesignError(
                f"axes must be one for each of {len(pairs)} pairs of factors, got {len(panels)}"
            )
        figure, _ = canvas(panels[0], 0.0)
    bands = {name: fit.band(name) for name in fit.goals}
    for panel, (x, y) in zip(panels, pairs, strict=True):
        for band, color in zip(bands.values(), cycle(COLORS), strict=False):
            _fill(panel, band, (x, y), fit.point, color, 0.25)
        _fill(panel, fit.region(), (x, y), fit.point, GREEN, 0.8)
        panel.plot(
            fit.point[x], fit.point[y], "D", color=VERMILION, markersize=SIZES["D"], markeredgecolor="white"
        )
        if truth is not None:
            panel.plot(truth[x], truth[y], "*", color="black", markersize=SIZES["*"], markeredgecolor="white")
        labels = {factor.name: factor.label for factor in fit.factors}
        panel.set(xlabel=labels[x], ylabel=labels[y])
        panel.spines[["top", "right"]].set_visible(False)
    keys: list[Patch | Line2D] = [
        Patch(color=color, alpha=0.25, label=f"{name} agrees")
        for name, color in zip(bands, cycle(COLORS), strict=False)
    ]
    keys += [Patch(color=GREEN, alpha=0.8, label="all agree"), _marker("D", VERMILION, "smallest chi²")]
    keys += [_marker("*", "black", "hidden truth")] if truth is not None else []
    key(figure, panels[0], axes is not None, keys, min(len(keys), 2 * len(pairs)))
    return figure


def _fill(
    axes: Axes, region: Region, plane: tuple[str, str], at: Mapping[str, float], color: str, alpha: float
) -> None:
    """Fill a region's cut by a plane; the axes cover the searched region."""
    x, y = plane
    cells = region.section(x, y, at).T.astype(float)
    axes.contourf(region.axis(x), region.axis(y), cells, levels=[0.5, 1.5], colors=[color], alpha=alpha)
    axes.set(xlim=np.take(region.axis(x), [0, -1]), ylim=np.take(region.axis(y), [0, -1]))


def _marker(symbol: str, color: str, label: str) -> Line2D:
    look: dict[str, Any] = {
        "marker": symbol,
        "markersize": SIZES[symbol],
        "color": color,
        "markeredgecolor": "white",
    }
    return Line2D([], [], linestyle="", label=label, **look)
