"""Charts of the fitted surface: response surface, contours with the compatible region, residuals."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
import plotly.graph_objects as go

from doe import Design, Region, Surface, Transfer
from doe.plots.palette import BLUE, GREEN, MUTED, PURPLE, VERMILION
from doe.plots.plot_data import SurfaceGrid, normal_points, surface_grid
from experiments.calibrate.results import OptimumResult, SurfaceResult, TargetResult
from experiments.report.kit.chart import LANDSCAPE, Chart, add_line, add_points, add_target, new_figure
from experiments.report.kit.numbers import axis_title, hover, quantity
from experiments.studyfile.campaign import Response

REGION_FILL = "rgba(0,121,90,0.28)"
"""Translucent green of the compatible region."""

CURVE_POINTS = 121
"""Points of a drawn curve."""


@dataclass(frozen=True)
class Slice:
    """A plane through the surface along two factors, the others held."""

    surface: Surface | Transfer
    x: str
    y: str
    point: Mapping[str, float]
    """Natural values at which the other factors are held."""
    response: Response
    """Response that the surface is of."""

    def grid(self) -> SurfaceGrid:
        """Fitted values over a square that shows every run."""
        return surface_grid(self.surface, self.x, self.y, self.point, _extent(self.surface.design))

    @property
    def hover(self) -> str:
        """Text under the pointer, as plotly.js reads it."""
        return f"{self.x} %{{x:.4g}}<br>{self.y} %{{y:.4g}}<br>{hover('z', self.response)}<extra></extra>"

    @property
    def held_text(self) -> str:
        """Sentence on the values of the factors that are not shown."""
        held = [factor for factor in self.surface.design.factors if factor.name not in (self.x, self.y)]
        values = ", ".join(f"{f.name} = {self.point[f.name]:.4g} {f.unit}".rstrip() for f in held)
        return f" Held: {values} (points with other values are projected)." if values else ""


def surface_charts(
    result: SurfaceResult, optimum: OptimumResult | None, target: TargetResult, response: Response
) -> list[Chart]:
    """Draw the leading response's reduced surface: a curve for one factor, else a relief and all contours.

    Factors that a chart does not show are held at the chosen point, or at the centre when there is none.
    """
    design = result.design
    if len(design.names) == 1:
        return [_curve_chart(result, optimum, target, response)]
    point = optimum.point if optimum else result.center
    fit, pairs = result.leading.final, itertools.combinations(design.names, 2)
    planes = [Slice(fit, x, y, point, response) for x, y in pairs]
    contours = [_contour_chart(plane, result, optimum, target) for plane in planes]
    fit = planes[0].surface
    slopes = dict(zip(fit.design.names, np.abs(fit.quadratic_form.slopes), strict=True))
    strongest = max(planes, key=lambda plane: slopes[plane.x] + slopes[plane.y])
    return [_relief_chart(strongest, result, optimum, target), *contours]


def residual_charts(surface: Surface, response: Response) -> list[Chart]:
    """Draw the four usual checks of a fit."""
    fitted, residuals = surface.fitted, surface.studentized_residuals
    order, title = np.arange(1, len(fitted) + 1), axis_title(response)
    points, funnel = normal_points(residuals), "Against the fit: no trend, no funnel."
    ordered = points["quantile"], points["value"]
    charts = [
        _residual_chart("normal", "normal quantile", *ordered, "Normal plot: points along a line."),
        _residual_chart("fitted", f"fitted {title}", fitted, residuals, funnel),
        _residual_chart("order", "row of the design", order, residuals, "Against the row: no drift."),
    ]
    both = np.r_[fitted, surface.response]
    line = [float(both.min()), float(both.max())]
    figure = new_figure(f"simulated {title}", f"fitted {title}", legend=False)
    figure.add_scatter(x=line, y=line, mode="lines", line={"color": MUTED, "dash": "dot"}, hoverinfo="skip")
    _add_runs(figure, surface.response, fitted)
    return [*charts, Chart("residual-actual", "Fitted against simulated values.", figure)]


def _relief_chart(
    plane: Slice, result: SurfaceResult, optimum: OptimumResult | None, target: TargetResult
) -> Chart:
    grid = plane.grid()
    figure = new_figure()
    figure.add_surface(
        x=grid.x,
        y=grid.y,
        z=grid.mean,
        colorscale=LANDSCAPE,
        opacity=0.9,
        showscale=False,
        contours={"z": {"show": True, "color": "rgba(255,255,255,0.5)", "width": 1}},
        hovertemplate=plane.hover,
        name="fitted surface",
    )
    measured, values = result.leading.shown
    if len(measured.columns) == 2:
        _add_points_3d(figure, plane, measured, values, "cases", BLUE)
        if optimum is not None:
            _add_target_curve(figure, plane, optimum, target.leading.mean)
    if optimum is not None:
        chosen = pd.DataFrame([optimum.point])
        _add_points_3d(figure, plane, chosen, [optimum.prediction["mean"]], "optimum", VERMILION, "diamond")
    axis = {"backgroundcolor": "#ffffff", "gridcolor": "#dfe3e8", "tickfont": {"size": 11}}
    figure.update_layout(
        scene={
            "xaxis": axis | {"title": {"text": grid.x_factor.label}},
            "yaxis": axis | {"title": {"text": grid.y_factor.label}},
            "zaxis": axis | {"title": {"text": axis_title(plane.response)}},
            "camera": {"eye": {"x": -1.75, "y": -1.9, "z": 1.0}, "center": {"x": 0.0, "y": 0.0, "z": -0.12}},
            "dragmode": "turntable",
        },
        margin={"l": 0, "r": 0, "t": 36, "b": 0},
    )
    caption = f"Fitted {plane.response.name}; drag to turn it.{plane.held_text}"
    return Chart("surface-relief", caption, figure, height="tall")


def _contour_chart(
    plane: Slice, result: SurfaceResult, optimum: OptimumResult | None, target: TargetResult
) -> Chart:
    grid, level = plane.grid(), target.leading.mean
    figure = new_figure(grid.x_factor.label, grid.y_factor.label)
    if optimum is not None:
        add_region(figure, plane, optimum.region, "compatible region", REGION_FILL)
    lines = {"coloring": "none", "showlabels": True, "labelfont": {"size": 11, "color": MUTED}}
    name, hovered = f"fitted {plane.response.name}", {"hovertemplate": plane.hover}
    _add_contours(figure, grid, name, lines, "#9aa3af", 1, ncontours=12, **hovered)
    add_level(figure, grid, f"target {quantity(level, plane.response.unit)}", level, GREEN, 3)
    add_design(figure, plane, result.design)
    add_settings(figure, plane, target.truth, optimum.point if optimum else None, "optimum")
    shown = "target curve (reduced model) and compatible region (green, full model); "
    shown += "the dotted box is coded −1 to +1."
    caption = f"Fitted {plane.response.name}, {shown}"
    return Chart(f"contour-{plane.x}-{plane.y}", caption + plane.held_text, figure, height="tall")


def _curve_chart(
    result: SurfaceResult, optimum: OptimumResult | None, target: TargetResult, response: Response
) -> Chart:
    (factor,) = result.design.factors
    x = factor.to_natural(np.linspace(-1.0, 1.0, CURVE_POINTS) * _extent(result.design))
    fit = result.leading.final.predict(pd.DataFrame({factor.name: x}))
    figure = new_figure(factor.label, axis_title(response))
    add_target(figure, target.leading.mean, target.leading.se)
    around = np.r_[fit["confidence_low"], fit["confidence_high"][::-1]]
    shade = {"fill": "toself", "fillcolor": "rgba(0,114,178,0.15)", "hoverinfo": "skip", "line": {"width": 0}}
    figure.add_scatter(
        x=np.r_[x, x[::-1]], y=around, mode="lines", name="95 % confidence, full model", **shade
    )
    add_line(figure, x, fit["mean"], "fit, reduced model", BLUE)
    measured, values = result.leading.shown
    add_points(figure, measured[factor.name], values, "case", BLUE, size=8)
    if target.truth is not None:
        hidden = [target.truth[factor.name]], [target.leading.mean]
        add_points(figure, *hidden, "hidden truth", PURPLE, "star", 16)
    if optimum is not None:
        chosen = [optimum.point[factor.name]], [optimum.prediction["mean"]]
        add_points(figure, *chosen, "optimum", VERMILION, "diamond", 13)
    caption = "Fitted curve; the green band is the target ± its standard error."
    return Chart("surface-curve", caption, figure, height="tall")


def _add_points_3d(
    figure: go.Figure, plane: Slice, rows: pd.DataFrame, z: Any, name: str, color: str, symbol: str = "circle"
) -> None:
    marker = {"size": 4, "color": color, "symbol": symbol, "line": {"color": "#ffffff", "width": 1}}
    figure.add_scatter3d(x=rows[plane.x], y=rows[plane.y], z=z, mode="markers", name=name, marker=marker)


def _add_target_curve(figure: go.Figure, plane: Slice, optimum: OptimumResult, level: float) -> None:
    for piece, (_, points) in enumerate(optimum.contour.groupby(level=0)):
        figure.add_scatter3d(
            x=points[plane.x],
            y=points[plane.y],
            z=np.full(len(points), level),
            mode="lines",
            name="target",
            line={"color": GREEN, "width": 7},
            showlegend=piece == 0,
        )


def add_level(figure: go.Figure, grid: SurfaceGrid, name: str, level: float, color: str, width: int) -> None:
    """Draw the line along which the fitted response has one value."""
    lines = {"coloring": "none", "start": level, "end": level, "size": 1.0}
    _add_contours(figure, grid, name, lines, color, width, hoverinfo="skip")


def _add_contours(
    figure: go.Figure, grid: SurfaceGrid, name: str, lines: dict, color: str, width: int, **more: Any
) -> None:
    more |= {"showscale": False, "showlegend": True, "line": {"color": color, "width": width}}
    figure.add_contour(x=grid.x, y=grid.y, z=grid.mean, name=name, contours=lines, **more)


def add_region(figure: go.Figure, plane: Slice, region: Region, name: str, fill: str) -> None:
    """Fill the cells of a region in the plane."""
    figure.add_heatmap(
        x=region.axis(plane.x),
        y=region.axis(plane.y),
        z=region.section(plane.x, plane.y, plane.point).T.astype(np.uint8),  # rows are y
        zmin=0,
        zmax=1,
        colorscale=[[0.0, "rgba(0,0,0,0)"], [1.0, fill]],
        showscale=False,
        hoverinfo="skip",
    )
    square = {"symbol": "square", "size": 13, "color": fill}
    figure.add_scatter(x=[None], y=[None], mode="markers", name=name, marker=square)


def add_design(figure: go.Figure, plane: Slice, design: Design) -> None:
    """Draw the runs, and the box of the coded -1 to +1."""
    runs = design.natural.drop_duplicates([plane.x, plane.y])
    add_points(figure, runs[plane.x], runs[plane.y], "design", BLUE, "circle-open")
    x, y = design.factor(plane.x), design.factor(plane.y)
    border = {"color": MUTED, "dash": "dot", "width": 1}
    figure.add_shape(type="rect", x0=x.low, x1=x.high, y0=y.low, y1=y.high, line=border)


def add_settings(
    figure: go.Figure,
    plane: Slice,
    truth: Mapping[str, float] | None,
    chosen: Mapping[str, float] | None,
    name: str,
) -> None:
    """Draw the hidden truth and the chosen point, as far as they are known; `name` is that of the latter."""
    if truth is not None:
        add_points(figure, [truth[plane.x]], [truth[plane.y]], "hidden truth", PURPLE, "star", 16)
    if chosen is not None:
        add_points(figure, [chosen[plane.x]], [chosen[plane.y]], name, VERMILION, "diamond", 13)


def _residual_chart(name: str, x_title: str, x: Any, y: pd.Series, caption: str) -> Chart:
    figure = new_figure(x_title, "studentized residual", legend=False)
    figure.add_hline(y=0.0, line={"color": MUTED, "width": 1})
    _add_runs(figure, x, y)
    return Chart(f"residual-{name}", caption, figure)


def _add_runs(figure: go.Figure, x: Any, y: pd.Series) -> None:
    labels = [f"run {run}" for run in y.index]
    add_points(
        figure, x, y, "run", BLUE, text=labels, hovertemplate="%{text}: %{x:.4g}, %{y:.2f}<extra></extra>"
    )


def _extent(design: Design) -> float:
    return max(1.0, float(design.points.abs().to_numpy().max())) * 1.05
