"""Designs of experiments and their analysis: screening, climbing, response surfaces, comparison of means."""

from doe.agreement import Agreement, Estimate, agreement
from doe.anova import ErrorTerm, pure_error
from doe.compare import Comparison, Sample, compare_means
from doe.design import Design
from doe.designs.central_composite import central_composite
from doe.designs.plackett_burman import plackett_burman
from doe.errors import DesignError, TargetError
from doe.factors import Factor
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
from doe.region import Region
from doe.screening import ScreenResult, aliases, screen
from doe.steepest import ClimbPath, climb_table, steepest_path
from doe.surface import Surface, fit_surface

__all__ = [
    "Agreement",
    "ClimbPath",
    "Comparison",
    "Design",
    "DesignError",
    "ErrorTerm",
    "Estimate",
    "Factor",
    "Goal",
    "JointFit",
    "NoiseFloor",
    "Region",
    "Sample",
    "ScreenResult",
    "StationaryPoint",
    "Surface",
    "TargetError",
    "VarianceRatio",
    "agreement",
    "aliases",
    "central_composite",
    "climb_table",
    "compare_means",
    "curvature_test",
    "detectable_effect",
    "effect_power",
    "fit_surface",
    "joint_fit",
    "noise_floor",
    "plackett_burman",
    "pure_error",
    "screen",
    "steepest_path",
    "variance_ratio",
]
