"""Charts of the noise floor, the screening, the climb and the verification."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import plotly.graph_objects as go

from doe import ScreenResult
from doe.plots.palette import BLUE, GREEN, INK, MUTED, ORANGE, VERMILION
from doe.plots.plot_data import half_normal_points, pareto_points
from experiments.calibrate.cases import measured
from experiments.calibrate.results import ClimbResult, NoiseFloorResult, TargetResult, VerificationResult
from experiments.report.kit.chart import Chart, add_bars, add_line, add_points, add_target, new_figure
from experiments.report.kit.numbers import axis_title, capital, hover, quantity
from experiments.studyfile.campaign import Response


def noise_floor_chart(result: NoiseFloorResult, target: TargetResult, response: Response) -> Chart:
    """Draw the replicates at the centre, their mean and spread, and the target."""
    figure = new_figure("case", axis_title(response), legend=False)
    add_target(figure, target.leading.mean, target.leading.sd)
    cases = measured(result.cases, response)
    add_points(figure, cases["replicate"], cases[response.observable], "case", BLUE)
    figure.add_hline(y=result.leading.mean, line={"color": BLUE, "dash": "dot"})
    figure.update_xaxes(dtick=1)
    caption = "Cases with every factor at its middle, their mean (dotted), and the target ± 1 sd (green)."
    return Chart("noise-chart", caption, figure)


def pareto_chart(screen: ScreenResult, alpha: float, response: Response) -> Chart:
    """Draw |t| of every effect, largest first, with the critical values."""
    points = pareto_points(screen)[::-1]
    rises = points["effect"] >= 0.0
    figure, effect = new_figure("|t| of the effect"), hover("customdata[0]", response)
    for name, color, rows in (
        (f"raises the {response.name}", BLUE, points[rises]),
        (f"lowers the {response.name}", ORANGE, points[~rises]),
    ):
        sizes, shown = rows["abs_t"], f"%{{y}}: effect {effect}, |t| = %{{x:.2f}}"
        more = {"orientation": "h", "customdata": rows[["effect"]]}
        add_bars(figure, sizes, rows.index, name, color, shown, **more)
    ends = [points.index[0], points.index[-1]]
    levels = {f"p = {level:g}": screen.critical_t(level) for level in sorted({alpha, 0.05}, reverse=True)}
    levels["Bonferroni 0.05"] = screen.critical_t(0.05, bonferroni=True)
    for (name, value), dash in zip(levels.items(), ("dot", "dash", "solid"), strict=False):
        # Entries of the legend, as labels at near lines would run into one another.
        add_line(figure, [value, value], ends, f"{name}: {value:.2f}", INK, dash)
    figure.update_yaxes(
        categoryorder="array", categoryarray=list(points.index), dtick=1, ticks="", ticklabelstandoff=6
    )
    figure.update_xaxes(range=[0.0, 1.06 * max(points["abs_t"].max(), *levels.values())])
    figure.update_layout(bargap=0.35)
    caption = "Pareto chart: effects in standard errors, with the critical values."
    return Chart("pareto-chart", caption, figure)


def half_normal_chart(screen: ScreenResult, alpha: float, response: Response) -> Chart:
    """Draw the ordered sizes of all effects against half-normal quantiles, with the line of pure noise."""
    points = half_normal_points(screen.effects)
    figure = new_figure("half-normal quantile", f"|effect| on {axis_title(response)}")
    top = float(points["quantile"].max()) * 1.08
    noise = [0.0, top * float(screen.standard_error.mean())]
    add_line(figure, [0.0, top], noise, "noise alone", MUTED, "dot")
    dummy = points.index.isin(screen.design.dummies)
    active = points.index.isin(screen.significant(alpha))
    for name, rows, symbol, color in (
        ("significant", active, "diamond", VERMILION),
        ("not significant", ~active & ~dummy, "circle", BLUE),
        ("dummy column", dummy, "circle-open", MUTED),
    ):
        if rows.any():
            _add_effects(figure, points[rows], name, symbol, color, response)
    caption = "Half-normal plot: effects of pure noise lie along the dotted line, real ones stand above it."
    return Chart("half-normal-chart", caption, figure)


def climb_chart(climb: ClimbResult, target: TargetResult, response: Response) -> Chart:
    """Draw the leading response along the climb, the target and where the path crosses it."""
    path = climb.path
    figure = new_figure("step of the climb", axis_title(response))
    add_target(figure, target.leading.mean, target.leading.sd)
    add_line(figure, path.index, path["predicted"], "predicted by the screening", MUTED, "dot")
    cases = measured(climb.cases, response)
    add_points(figure, cases["run"], cases[response.observable], "case", BLUE, size=7, opacity=0.6)
    kept = "<br>".join(f"{name} = %{{customdata[{i}]:.4g}}" for i, name in enumerate(climb.kept))
    line: dict[str, Any] = {"mode": "lines+markers", "line": {"color": BLUE, "width": 2}}
    line["hovertemplate"] = f"step %{{x}}: {hover('y', response)}<br>{kept}<extra></extra>"
    line["customdata"] = path[list(climb.kept)]
    add_points(figure, path.index, path["mean"], "mean of the step", BLUE, **line)
    if climb.crossing_step is not None:
        crossing = [climb.crossing_step], [target.leading.mean]
        add_points(figure, *crossing, "crosses the target", VERMILION, "diamond", 13)
    figure.update_xaxes(dtick=1)
    caption = f"{capital(response.name)} along the climb; the green band is the target ± 1 sd."
    return Chart("climb-chart", caption, figure)


def verification_chart(result: VerificationResult, response: Response) -> Chart:
    """Draw the interval of the difference from the target between the equivalence margins."""
    comparison, margin = result.leading, result.leading.margin or 0.0
    low, high = comparison.interval
    values = measured(result.cases, response)[response.observable].to_numpy()
    deviations = values - (comparison.a.mean - comparison.difference)
    figure = new_figure(f"fresh cases less target, {axis_title(response)}")
    figure.add_vrect(x0=-margin, x1=margin, fillcolor=GREEN, opacity=0.13, line_width=0, layer="below")
    figure.add_vline(x=0.0, line={"color": GREEN, "width": 2})
    heights = np.full(len(deviations), "cases")
    add_points(figure, deviations, heights, "single case", BLUE, opacity=0.7)
    mean, name = comparison.difference, f"mean and its {100.0 * (1.0 - comparison.alpha):g} % interval"
    sides = {"symmetric": False, "array": [high - mean], "arrayminus": [mean - low]}
    error = {"type": "data", "thickness": 2, **sides}
    add_points(figure, [mean], ["mean"], name, VERMILION, "diamond", 12, error_x=error)
    reach = 1.2 * max(margin, abs(low), abs(high), float(np.abs(deviations).max()))
    figure.update_xaxes(range=[-reach, reach])
    figure.update_yaxes(ticks="", ticklabelstandoff=6, range=[-0.7, 1.7])
    caption = f"Fresh cases less target; the green band is the margin of ± {quantity(margin, response.unit)}."
    return Chart("verification-chart", caption, figure)


def _add_effects(
    figure: go.Figure, points: pd.DataFrame, name: str, symbol: str, color: str, response: Response
) -> None:
    """Draw effects; those that matter carry their names, the others tell them under the pointer."""
    more: dict[str, Any] = {"text": list(points.index)}
    more["hovertemplate"] = f"%{{text}}: {hover('y', response)}<extra></extra>"
    if name == "significant":
        more |= {"mode": "markers+text", "textposition": "middle left", "textfont": {"color": color}}
    add_points(figure, points["quantile"], points["abs_effect"], name, color, symbol, **more)
