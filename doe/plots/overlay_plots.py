"""Contours of several responses in one figure, and the settings that all of them allow."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from doe.arguments import checked_map, checked_number
from doe.design.design import checked_setting
from doe.errors import DesignError
from doe.plots.palette import BLUE, GREEN, MUTED, ORANGE, VERMILION
from doe.plots.plot_data import surface_grid
from doe.plots.style import canvas, key
from doe.response.analysis.desirability import checked_surfaces
from doe.response.response_surface import Surface

COLORS = (BLUE, VERMILION, GREEN, ORANGE, MUTED)


def overlay_plot(
    surfaces: Mapping[str, Surface],
    limits: Mapping[str, tuple[float | None, float | None]],
    x: str | None = None,
    y: str | None = None,
    at: Mapping[str, float] | None = None,
    point: Mapping[str, float] | None = None,
    extent: float = 1.0,
    axes: Axes | None = None,
) -> Figure:
    """Draw each response's limits over two factors, and shade where every fitted mean keeps them.

    Parameters
    ----------
    surfaces : mapping of Surface by response
        Up to five, over the same factors.
    limits : mapping of (low, high) by response
        None on an open side.
    x, y, at, extent
        As in ``doe.plots.plot_data.surface_grid``.
    point : mapping of natural values by factor, optional
        A setting to mark; factors off the axes are held there unless ``at`` is given.
    """
    design = checked_surfaces(surfaces)
    if set(checked_map("limits", limits)) != set(surfaces) or len(surfaces) > len(COLORS):
        raise DesignError(
            f"limits for each of one to {len(COLORS)} surfaces: {sorted(surfaces)} and {sorted(limits)}"
        )
    for name, pair in limits.items():
        if not isinstance(pair, tuple | list) or len(pair) != 2:
            raise DesignError(f"the limits of {name!r} must be (low, high), None where free, got {pair!r}")
        for limit in pair:
            if limit is not None:
                checked_number(f"a limit of {name!r}", limit)
    if point is not None:
        point = checked_setting("point", point, design.factors)
    given = axes is not None
    figure, axes = canvas(axes, 4.8)
    held = at if at is not None or point is None else point
    handles: list[Line2D | Patch] = []
    inside = None
    for (name, surface), color in zip(surfaces.items(), COLORS, strict=False):
        grid = surface_grid(surface, x, y, held, extent, resolution=161)
        low, high = limits[name]
        keeps = np.ones_like(grid.mean, dtype=bool)
        for limit, kept in ((low, lambda mean, at: mean >= at), (high, lambda mean, at: mean <= at)):
            if limit is None:
                continue
            keeps &= kept(grid.mean, limit)
            if grid.mean.min() < limit < grid.mean.max():
                lines = axes.contour(
                    grid.x, grid.y, grid.mean, levels=[limit], colors=[color], linewidths=1.5
                )
                axes.clabel(lines, fmt=f"{limit:g}", fontsize=8)
        inside = keeps if inside is None else inside & keeps
        handles.append(Line2D([], [], color=color, label=f"{name} {_limits_text(low, high)}"))
    if inside is not None and inside.any():
        axes.contourf(grid.x, grid.y, inside.astype(float), levels=[0.5, 1.5], colors=[MUTED], alpha=0.3)
        handles.append(Patch(color=MUTED, alpha=0.3, label="all kept"))
    if point is not None:
        names = (grid.x_factor.name, grid.y_factor.name)
        axes.plot(
            point[names[0]], point[names[1]], "*", color="white", markeredgecolor="black", markersize=13.0
        )
    axes.set(xlabel=grid.x_factor.label, ylabel=grid.y_factor.label)
    key(figure, axes, given, handles, 3)
    return figure


def _limits_text(low: float | None, high: float | None) -> str:
    if low is None or high is None:
        return "free" if low is high else f"at most {high:g}" if low is None else f"at least {low:g}"
    return f"{low:g} to {high:g}"
