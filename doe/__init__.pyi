"""The public names: each is loaded with its module when it is first used."""

from .agreement import Agreement, Estimate, agreement
from .analysis.canonical import CanonicalAnalysis, canonical, ridge_path
from .analysis.desirability import BestSetting, Wish, maximize, minimize, most_desirable
from .analysis.diagnostics import BoxCox, RobustTable, box_cox, influence, robust_coefficients
from .analysis.effects import TwoLevelEffects, two_level_effects
from .analysis.formula import LinearFit, fit_formula, fit_mixture
from .analysis.optimum_region import stationary_region
from .anova import ErrorTerm, pure_error
from .compare import Comparison, compare_means
from .curve_fit import CurveFit, Forecast, MeasuredCurve, fit_curves
from .curves import CurveEmulator
from .design import Design
from .designs.aliases import AliasStructure, alias_structure
from .designs.augment import add_axial, add_center, foldover, join
from .designs.box_behnken import box_behnken
from .designs.central_composite import central_composite
from .designs.definitive import definitive_screening
from .designs.factorial import fractional_factorial, full_factorial
from .designs.mixture import Mixture, simplex_centroid, simplex_lattice
from .designs.optimal import optimal_design
from .designs.plackett_burman import plackett_burman
from .designs.quality import DesignQuality, design_quality, power_table
from .designs.space_filling import latin_hypercube, sobol
from .errors import DesignError, TargetError
from .factors import Category, Factor
from .joint import Goal, JointFit, joint_fit
from .noise import (
    NoiseFloor,
    VarianceRatio,
    curvature_test,
    detectable_effect,
    effect_power,
    noise_floor,
    variance_ratio,
)
from .optimum import StationaryPoint
from .profiles import Mode, ProfileSample, scatter_of_views
from .region import Region
from .sample import Sample
from .screening import ScreenResult, aliases, screen
from .steepest import ClimbPath, climb_table, steepest_path
from .surface import Surface, fit_surface
from .transfer import Transfer, transfer, transfer_points

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
