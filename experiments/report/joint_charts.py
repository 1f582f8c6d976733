"""Charts of several responses together: their bands in every plane of two factors, and what is left."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

from doe import JointFit
from doe.plots.palette import BLUE, GREEN, MUTED, ORANGE, PURPLE, SKY
from experiments.calibrate.results import OptimumResult, SurfaceResult, TargetResult
from experiments.report.kit.chart import Chart, add_bars, add_line, new_figure
from experiments.report.surface_charts import (
    REGION_FILL,
    Slice,
    add_design,
    add_level,
    add_region,
    add_settings,
)
from experiments.studyfile.campaign import Direct, Response

COLORS = (BLUE, ORANGE, PURPLE, SKY, MUTED)
"""Colours of the responses, in order."""

OPACITY = 0.20
"""Opacity of a response's own band."""


def joint_charts(
    surface: SurfaceResult, optimum: OptimumResult, target: TargetResult, responses: Sequence[Response]
) -> list[Chart]:
    """Draw the shares that are left, and for every pair of factors where each response agrees."""
    if optimum.joint is None:
        return []
    pairs = list(itertools.combinations(surface.design.names, 2))
    planes = [_plane_chart(optimum.joint, x, y, surface, optimum, target, responses) for x, y in pairs]
    first = [Slice(surface.leading.final, *pair, optimum.point, responses[0]) for pair in pairs[:1]]
    steps = [_steps_chart(optimum.joint, plane, target) for plane in first]
    return [_shares_chart(optimum.joint), *steps, *planes]


def _shares_chart(joint: JointFit) -> Chart:
    table = joint.shrinkage
    figure = new_figure("", "share of the region explored [%]")
    names = [str(name) if place == 0 else f"+ {name}" for place, name in enumerate(table.index)]
    for title, column, color in (("alone", "alone", MUTED), ("with those before", "share", GREEN)):
        add_bars(figure, names, 100.0 * table[column], title, color, "%{x}: %{y:.2f} %")
    figure.update_xaxes(title={"text": "response added"})
    caption = "What is compatible with each response alone, and with those before it too."
    return Chart("joint-shares", caption, figure)


def _steps_chart(joint: JointFit, plane: Slice, target: TargetResult) -> Chart:
    design = plane.surface.design
    figure = new_figure(design.factor(plane.x).label, design.factor(plane.y).label)
    names = [str(name) for name in joint.shrinkage.index]
    for count, (name, color) in enumerate(zip(names, itertools.cycle(COLORS), strict=False), start=1):
        region = joint.region(*names[:count])
        add_region(figure, plane, region, name if count == 1 else f"+ {name}", _translucent(color))
    add_settings(figure, plane, target.truth, plane.point, "chosen")
    caption = "What is compatible after each measurement, in the order of the table."
    return Chart("joint-steps", caption + plane.held_text, figure, height="tall")


def _plane_chart(
    joint: JointFit,
    x: str,
    y: str,
    surface: SurfaceResult,
    optimum: OptimumResult,
    target: TargetResult,
    responses: Sequence[Response],
) -> Chart:
    fits = [(one, surface.responses[one.name].final) for one in responses if not one.held_out]
    plane = Slice(fits[0][1], x, y, optimum.point, fits[0][0])
    figure = new_figure(surface.design.factor(x).label, surface.design.factor(y).label)
    colors = itertools.cycle(COLORS)
    for (response, fit), color in zip(fits, colors, strict=False):
        name = response.name
        level = joint.goals[name].target.mean
        add_region(figure, plane, joint.band(name), f"{name} agrees", _translucent(color))
        grid = Slice(fit, x, y, optimum.point, response).grid()
        add_level(figure, grid, f"{name} at its target", level, color, 2)
    for direct, color in zip(_readings(optimum, (x, y)), colors, strict=False):
        add_region(figure, plane, joint.band(direct.name), f"{direct.name} agrees", _translucent(color))
        along, at = joint.region().axis(y if direct.factor == x else x)[[0, -1]], [direct.measured.mean] * 2
        across, up = (at, along) if direct.factor == x else (along, at)
        add_line(figure, across, up, direct.name, color, hoverinfo="skip", showlegend=False)
    add_region(figure, plane, joint.region(), "all agree", REGION_FILL.replace("0.28", "0.75"))
    add_design(figure, plane, surface.design)
    add_settings(figure, plane, target.truth, optimum.point, "chosen")
    caption = "Where each response agrees with its target, and where all do (green)."
    return Chart(f"joint-{x}-{y}", caption + plane.held_text, figure, height="tall")


def _readings(optimum: OptimumResult, factors: tuple[str, str]) -> list[Direct]:
    """List the direct readings of the factors of a plane."""
    return [check.direct for check in optimum.direct if check.direct.factor in factors]


def _translucent(color: str) -> str:
    red, green, blue = (int(color[place : place + 2], 16) for place in (1, 3, 5))
    return f"rgba({red},{green},{blue},{OPACITY})"
