"""Designs of experiments and their analysis.

In the order of an experiment:

factors         Factor, Category
screening       plackett_burman, definitive_screening, full_factorial, fractional_factorial
surfaces        central_composite, box_behnken, optimal_design
simulations     latin_hypercube, sobol
mixtures        simplex_lattice, simplex_centroid
more runs       foldover, add_center, add_axial, join
before it runs  alias_structure, design_quality, power_table, detectable_effect, effect_power
screened        screen, two_level_effects, steepest_path, climb_table
fitted          fit_surface, fit_formula, fit_mixture; influence, box_cox, robust_coefficients
best settings   canonical, ridge_path, stationary_region, maximize, minimize, most_desirable
compared        compare_means, agreement, noise_floor, curvature_test, joint_fit, ProfileSample
carried over    transfer, transfer_points

``doe.plots`` draws them.
"""

from doe.agreement import Agreement, Estimate, agreement
from doe.analysis.canonical import CanonicalAnalysis, canonical, ridge_path
from doe.analysis.desirability import BestSetting, Wish, maximize, minimize, most_desirable
from doe.analysis.diagnostics import BoxCox, RobustTable, box_cox, influence, robust_coefficients
from doe.analysis.effects import TwoLevelEffects, two_level_effects
from doe.analysis.formula import LinearFit, fit_formula, fit_mixture
from doe.analysis.optimum_region import stationary_region
from doe.anova import ErrorTerm, pure_error
from doe.compare import Comparison, Sample, compare_means
from doe.design import Design
from doe.designs.aliases import AliasStructure, alias_structure
from doe.designs.augment import add_axial, add_center, foldover, join
from doe.designs.box_behnken import box_behnken
from doe.designs.central_composite import central_composite
from doe.designs.definitive import definitive_screening
from doe.designs.factorial import fractional_factorial, full_factorial
from doe.designs.mixture import Mixture, simplex_centroid, simplex_lattice
from doe.designs.optimal import optimal_design
from doe.designs.plackett_burman import plackett_burman
from doe.designs.quality import DesignQuality, design_quality, power_table
from doe.designs.space_filling import latin_hypercube, sobol
from doe.errors import DesignError, TargetError
from doe.factors import Category, Factor
from doe.joint import Goal, JointFit, joint_fit
from doe.noise import (
    NoiseFloor,
    VarianceRatio,
    curvature_test,
    detectable_effect,
    effect_power,
    noise_floor,
    variance_ratio,
)
from doe.optimum import StationaryPoint
from doe.profiles import Mode, ProfileSample
from doe.region import Region
from doe.screening import ScreenResult, aliases, screen
from doe.steepest import ClimbPath, climb_table, steepest_path
from doe.surface import Surface, fit_surface
from doe.transfer import Transfer, transfer, transfer_points

__all__ = [
    "Agreement",
    "AliasStructure",
    "BestSetting",
    "BoxCox",
    "CanonicalAnalysis",
    "Category",
    "ClimbPath",
    "Comparison",
    "Design",
    "DesignError",
    "DesignQuality",
    "ErrorTerm",
    "Estimate",
    "Factor",
    "Goal",
    "JointFit",
    "LinearFit",
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
