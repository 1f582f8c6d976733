"""The public names: each is loaded with its module when it is first used."""

from .curves.curve_emulator import CurveEmulator
from .curves.curve_fit import CurveFit, Forecast, MeasuredCurve, fit_curves
from .curves.profile_sample import Mode, ProfileSample, scatter_of_views
from .design.anova import ErrorTerm, pure_error
from .design.design import Design
from .design.factors import Category, Factor
from .design.families.aliases import AliasStructure, alias_structure
from .design.families.augment import add_axial, add_center, foldover, join
from .design.families.box_behnken import box_behnken
from .design.families.central_composite import central_composite
from .design.families.definitive import definitive_screening
from .design.families.factorial import fractional_factorial, full_factorial
from .design.families.mixture import Mixture, simplex_centroid, simplex_lattice
from .design.families.optimal import optimal_design
from .design.families.plackett_burman import plackett_burman
from .design.families.quality import DesignQuality, design_quality, power_table
from .design.families.space_filling import latin_hypercube, sobol
from .errors import DesignError, TargetError
from .response.analysis.canonical import CanonicalAnalysis, canonical, ridge_path
from .response.analysis.desirability import BestSetting, Wish, maximize, minimize, most_desirable
from .response.analysis.diagnostics import BoxCox, RobustTable, box_cox, influence, robust_coefficients
from .response.analysis.formula import LinearFit, fit_formula, fit_mixture
from .response.analysis.optimum_region import stationary_region
from .response.joint_fit import Goal, JointFit, joint_fit
from .response.region import Region
from .response.response_surface import Surface, fit_surface
from .response.surface_points import StationaryPoint
from .response.transfer import Transfer, transfer, transfer_points
from .samples.agreement import Agreement, Estimate, agreement
from .samples.noise_floor import (
    NoiseFloor,
    VarianceRatio,
    curvature_test,
    detectable_effect,
    effect_power,
    noise_floor,
    variance_ratio,
)
from .samples.sample import Sample
from .samples.two_means import Comparison, compare_means
from .screen.screened_effects import ScreenResult, aliases, screen
from .screen.steepest import ClimbPath, climb_table, steepest_path
from .screen.two_level_effects import TwoLevelEffects, two_level_effects

__all__ = [
    "Agreement",
    "AliasStructure",
    "BestSetting",
    "BoxCox",
    "CanonicalAnalysis",
    "Category",
    "ClimbPath",
    "Comparison",
    "CurveEmulator",
    "CurveFit",
    "Design",
    "DesignError",
    "DesignQuality",
    "ErrorTerm",
    "Estimate",
    "Factor",
    "Forecast",
    "Goal",
    "JointFit",
    "LinearFit",
    "MeasuredCurve",
    "Mixture",
    "Mode",
    "NoiseFloor",
    "ProfileSample",
    "Region",
    "RobustTable",
    "Sample",
    "ScreenResult",
    "StationaryPoint",
    "Surface",
    "TargetError",
    "Transfer",
    "TwoLevelEffects",
    "VarianceRatio",
    "Wish",
    "add_axial",
    "add_center",
    "agreement",
    "alias_structure",
    "aliases",
    "box_behnken",
    "box_cox",
    "canonical",
    "central_composite",
    "climb_table",
    "compare_means",
    "curvature_test",
    "definitive_screening",
    "design_quality",
    "detectable_effect",
    "effect_power",
    "fit_curves",
    "fit_formula",
    "fit_mixture",
    "fit_surface",
    "foldover",
    "fractional_factorial",
    "full_factorial",
    "influence",
    "join",
    "joint_fit",
    "latin_hypercube",
    "maximize",
    "minimize",
    "most_desirable",
    "noise_floor",
    "optimal_design",
    "plackett_burman",
    "power_table",
    "pure_error",
    "ridge_path",
    "robust_coefficients",
    "scatter_of_views",
    "screen",
    "simplex_centroid",
    "simplex_lattice",
    "sobol",
    "stationary_region",
    "steepest_path",
    "transfer",
    "transfer_points",
    "two_level_effects",
    "variance_ratio",
]
