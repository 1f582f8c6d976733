"""The public names: each is loaded with its module when it is first used."""

from .agreement_plots import agreement_plot as agreement_plot
from .agreement_plots import climb_plot as climb_plot
from .effect_plots import cube_plot as cube_plot
from .effect_plots import interaction_plot as interaction_plot
from .effect_plots import level_means as level_means
from .effect_plots import main_effects_plot as main_effects_plot
from .effect_plots import profile_plot as profile_plot
from .overlay_plots import overlay_plot as overlay_plot
from .palette import BLUE as BLUE
from .palette import GREEN as GREEN
from .palette import MUTED as MUTED
from .palette import ORANGE as ORANGE
from .palette import VERMILION as VERMILION
from .screening_plots import half_normal_plot as half_normal_plot
from .screening_plots import pareto_chart as pareto_chart
from .screening_plots import precision_plot as precision_plot
from .style import WIDTH as WIDTH
from .surface_plots import contour_plot as contour_plot
from .surface_plots import residual_plots as residual_plots
from .surface_plots import surface_plot as surface_plot
