"""Figures of measured against expected values: along a path, and against a reference."""

from collections.abc import Sequence
from itertools import cycle

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from doe.arguments import checked_kind, checked_list, checked_number
from doe.errors import DesignError
from doe.plots.palette import BLUE, GREEN, MUTED, ORANGE, VERMILION
from doe.plots.style import canvas, plain
from doe.samples.agreement import Agreement
from doe.screen.steepest import ClimbPath, climb_table


def climb_plot(
    path: ClimbPath,
    response: ArrayLike,
    target: float,
    target_sd: float | None = None,
    response_label: str = "response",
    axes: Axes | None = None,
) -> Figure:
    """Draw the mean response along a path, the model's prediction and the target with its sd as a band."""
    table = climb_table(path, response, target)
    figure, axes = canvas(axes, 3.8)
    axes.axhline(target, color=VERMILION, linewidth=1.2, label=f"target {target:g}")
    if target_sd is not None:
        checked_number("target_sd", target_sd, least=0.0)
        axes.axhspan(target - target_sd, target + target_sd, color=VERMILION, alpha=0.15, linewidth=0.0)
    steps = np.arange(len(table))
    axes.plot(steps, path.predicted, color=MUTED, linestyle="--", label="predicted")
    axes.plot(steps, table["response"], color=BLUE, marker="o", label="run")
    settings = ["\n".join(f"{row[name]:.4g}" for name in path.names) for _, row in path.natural.iterrows()]
    axes.set_xticks(steps, settings)
    axes.set(xlabel=", ".join(factor.label for factor in path.factors), ylabel=response_label)
    axes.legend(frameon=False)
    plain(axes)
    return figure


def agreement_plot(
    result: Agreement,
    groups: Sequence[str],
    value_label: str = "value",
    reference_label: str = "reference",
    axes: Axes | None = None,
) -> Figure:
    """Draw values against their reference, one colour per group, with the noise (+- 1 sd) of both."""
    checked_kind("result", result, Agreement)
    groups = checked_list("groups", groups)
    if len(groups) != result.runs:
        raise DesignError(f"groups must be a name for each of {result.runs} runs, got {len(groups)}")
    figure, axes = canvas(axes, 4.6)
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
    plain(axes)
    return figure
