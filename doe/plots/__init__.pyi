"""The public names: each is loaded with its module when it is first used."""

from .agreement_plots import agreement_plot, climb_plot
from .effect_plots import cube_plot, interaction_plot, level_means, main_effects_plot, profile_plot
from .overlay_plots import overlay_plot
from .palette import BLUE, GREEN, MUTED, ORANGE, VERMILION
from .screening_plots import half_normal_plot, pareto_chart
from .style import WIDTH
from .surface_plots import contour_plot, residual_plots, surface_plot

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
