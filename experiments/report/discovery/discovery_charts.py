"""Charts of a discovery: maps of residuals, shares, confounding, the gap, predicted against measured."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from doe.discrepancy import Confounding, Discovery, Fit
from doe.plots.palette import BLUE, GREEN, INK, MUTED, ORANGE, VERMILION
from experiments.report.discovery.discovery_tables import shown_candidates
from experiments.report.discovery.terms import Terms, condition_name, spaced
from experiments.report.kit.chart import Chart, add_bars, add_points, new_figure
from experiments.report.kit.numbers import MISSING, capital, fixed
from experiments.report.kit.sentences import say
from experiments.report.kit.theme import DIVERGING

MAP_REACH = 6.0
"""Residual at which the colours of a map end [standard deviations]."""

SIGNIFICANT = 0.05
"""Adjusted p value below which a residual is marked."""

MANY_BARS = 5
"""Bars beyond which a chart is taller."""

DODGE = 0.16
"""Distance of the points of a condition from each other."""

MEASURED, BASE, ADDED = INK, VERMILION, BLUE
"""Colours of the data, of the base, and of the model with the mechanism."""


def residual_maps(found: Discovery, terms: Terms) -> list[Chart]:
    """Draw the residuals of the base and of the chosen model, observable by condition."""
    maps = []
    if found.base:
        caption = "Before: measured less the calibrated base, in standard deviations of that difference."
        maps.append(_residual_map("residuals-before", found, found.base, caption))
    if found.chosen:
        title = terms.titles(found.chosen.mechanisms)
        caption = f"After: measured less the model with {title}, factors and size fitted together."
        maps.append(_residual_map("residuals-after", found, found.chosen, caption))
    if found.closest:
        title = terms.titles(found.closest.mechanisms)
        caption = f"The closest model: measured less that with {title}, factors and size fitted together."
        maps.append(_residual_map("residuals-closest", found, found.closest, caption))
    return maps


def explained_chart(found: Discovery, terms: Terms) -> Chart:
    """Draw what each candidate explains of the excess."""
    figure = new_figure("share of the excess explained [%]")
    ordered = shown_candidates(found)[::-1]
    names = [terms.titles(candidate.mechanisms) for candidate in ordered]
    for label, color, wanted in (("admitted", BLUE, True), ("refused", ORANGE, False)):
        rows = [at for at, candidate in enumerate(ordered) if candidate.admitted is wanted]
        if not rows:
            continue
        shares, titles = [100.0 * max(ordered[at].explained, 0.0) for at in rows], [names[at] for at in rows]
        add_bars(figure, shares, titles, label, color, "%{y}: %{x:.1f} %", orientation="h")
    figure.update_yaxes(categoryorder="array", categoryarray=names, ticks="", ticklabelstandoff=6)
    figure.update_xaxes(range=[0.0, 100.0])
    figure.update_layout(bargap=0.35)
    caption = "Share of the base's excess that each candidate removes."
    return Chart("explained-chart", caption, figure, "tall" if len(names) > MANY_BARS else "")


def confounding_chart(confounding: Confounding, terms: Terms) -> Chart:
    """Draw how much alike the mechanisms look after calibration."""
    names = [terms.title(name) for name in confounding.mechanisms]
    figure = new_figure(legend=False)
    _add_map(figure, confounding.correlations, names, names, 1.0, _texts(confounding.correlations, 2))
    figure.update_xaxes(tickangle=-40)
    return Chart("confounding-chart", say("note.confounding"), figure, "tall", columns=len(names))


def gap_chart(found: Discovery) -> Chart:
    """Draw the gap of fresh runs before and after, with its intervals."""
    figure = new_figure("Q of fresh runs (noise alone: the green line)")
    rows = ["held-out conditions" if both.held_out else "training conditions" for both in found.before_after]
    for name, label, color, aside in (
        ("before", "base", BASE, 0.5 * DODGE),
        ("after", "with the mechanism", ADDED, -0.5 * DODGE),
    ):
        places = [at + aside for at in range(len(rows))]
        ends = [getattr(both, name) for both in found.before_after]
        values = [end.value for end in ends]
        up, down = [end.high - end.value for end in ends], [end.value - end.low for end in ends]
        error = {"type": "data", "symmetric": False, "array": up, "arrayminus": down, "color": color}
        add_points(figure, values, places, label, color, size=11, error_x=error)
    for at, both in enumerate(found.before_after):
        df = both.degrees_of_freedom
        line = {"color": GREEN, "width": 3}
        figure.add_shape(type="line", x0=df, x1=df, y0=at - 0.35, y1=at + 0.35, line=line)
    span = [end for both in found.before_after for end in (both.before.high, both.after.low) if end > 0.0]
    figure.update_xaxes(type="log", dtick=1 if span and max(span) > 10.0 * min(span) else "D2")
    figure.update_yaxes(
        ticks="",
        ticklabelstandoff=6,
        tickvals=list(range(len(rows))),
        ticktext=rows,
        range=[len(rows) - 0.4, -0.6],
        showgrid=False,
    )
    caption = "The gap before and after, from fresh direct runs, with 90 % bootstrap intervals."
    return Chart("gap-chart", caption, figure, height="low")


def comparison_charts(found: Discovery, terms: Terms) -> list[Chart]:
    """Draw predicted against measured, one chart an observable that was measured."""
    measured = np.isfinite(found.data.means).any(axis=0)
    return [_comparison(found, terms, int(column)) for column in np.flatnonzero(measured)]


def _comparison(found: Discovery, terms: Terms, column: int) -> Chart:
    data = found.data
    observable = data.observables[column]
    factor = terms.scale(observable)[0]
    rows = np.flatnonzero(np.isfinite(data.means[:, column]))
    figure = new_figure("", terms.axis(observable), legend=False)
    series = [("measured", MEASURED, "circle", data.means, data.standard_errors)]
    if found.base:
        series.append(("base", BASE, "diamond", found.base.predicted, found.base.predicted_se))
    if found.chosen:
        fit = found.chosen
        series.append(("with the mechanism", ADDED, "square", fit.predicted, fit.predicted_se))
    for position, (name, color, symbol, values, errors) in enumerate(series):
        place = np.arange(len(rows)) + DODGE * (position - 0.5 * (len(series) - 1))
        shown, reach = factor * values[rows, column], 1.96 * factor * errors[rows, column]
        bars = {"type": "data", "array": reach, "color": color, "thickness": 1.5}
        hover = f"{name}: %{{y:.4g}}<extra></extra>"
        add_points(figure, place, shown, name, color, symbol, 8, error_y=bars, hovertemplate=hover)
    for at, row in enumerate(rows):
        if data.held_out[row]:
            ends = {"x0": at - 0.45, "x1": at + 0.45}
            figure.add_vrect(**ends, fillcolor=MUTED, opacity=0.10, line_width=0, layer="below")
    figure.update_xaxes(
        tickvals=list(range(len(rows))),
        ticktext=[data.conditions[row] for row in rows],
        tickangle=-35,
        range=[-0.6, len(rows) - 0.4],
        showgrid=False,
    )
    shown = terms.observables[observable]
    caption = f"{capital(shown.title)}: {shown.definition.rstrip('.')}."
    return Chart(f"compared-{observable}", caption, figure, height="low")


def _residual_map(name: str, found: Discovery, fit: Fit, caption: str) -> Chart:
    data = found.data
    conditions = [condition_name(c, out) for c, out in zip(data.conditions, data.held_out, strict=True)]
    observables = [spaced(observable) for observable in data.observables]
    marks = np.where(np.nan_to_num(fit.adjusted_p, nan=1.0) < SIGNIFICANT, "*", "")
    texts = np.char.add(_texts(fit.residuals, 1), marks)
    figure = new_figure(legend=False)
    _add_map(figure, fit.residuals, conditions, observables, MAP_REACH, texts)
    figure.update_xaxes(tickangle=-40)
    caption += f" * : beyond chance after Holm's adjustment (p < {SIGNIFICANT})."
    return Chart(name, caption, figure, columns=len(observables))


def _add_map(
    figure: go.Figure,
    values: np.ndarray,
    rows: list[str],
    columns: list[str],
    reach: float,
    texts: np.ndarray,
) -> None:
    figure.add_heatmap(
        z=np.where(np.isfinite(values), values, np.nan),
        x=columns,
        y=rows,
        zmin=-reach,
        zmax=reach,
        colorscale=list(zip(np.linspace(0.0, 1.0, len(DIVERGING)), DIVERGING, strict=True)),
        text=texts,
        texttemplate="%{text}",
        hovertemplate="%{y}, %{x}: %{z:.2f}<extra></extra>",
        xgap=2,
        ygap=2,
        colorbar={"thickness": 12, "outlinewidth": 0},
    )
    figure.update_yaxes(autorange="reversed", showgrid=False, ticks="", showline=False, ticklabelstandoff=4)
    figure.update_xaxes(showgrid=False, ticks="", showline=False)


def _texts(values: np.ndarray, decimals: int) -> np.ndarray:
    texts = [fixed(value, decimals) if np.isfinite(value) else MISSING for value in values.ravel()]
    return np.array(texts, dtype=np.str_).reshape(values.shape)
