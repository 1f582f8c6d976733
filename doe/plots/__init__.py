"""Figures (matplotlib): each is drawn on given axes or in a figure of its own and returned, never shown."""

from doe.palette import BLUE, GREEN, MUTED, ORANGE, VERMILION
from doe.plots.comparison import agreement_plot, climb_plot
from doe.plots.effects import cube_plot, interaction_plot, level_means, main_effects_plot, profile_plot
from doe.plots.overlay import overlay_plot
from doe.plots.screening import half_normal_plot, pareto_chart
from doe.plots.style import WIDTH
from doe.plots.surface import contour_plot, residual_plots, surface_plot

__all__ = [
    "BLUE",
    "GREEN",
    "MUTED",
    "ORANGE",
    "VERMILION",
    "WIDTH",
    "agreement_plot",
    "climb_plot",
    "contour_plot",
    "cube_plot",
    "half_normal_plot",
    "interaction_plot",
    "level_means",
    "main_effects_plot",
    "overlay_plot",
    "pareto_chart",
    "profile_plot",
    "residual_plots",
    "surface_plot",
]
