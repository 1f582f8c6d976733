"""The points of a shear test, shear stress against normal stress, and what Mohr's circles make of them."""

import math
from collections.abc import Sequence

import numpy as np

from dem_warp.scenes.scene import Observable

LOADS = (0.2, 0.4, 0.6, 0.8)
"""Normal stresses at which grains are sheared, over that of the pre-shear."""

SHEAR_OBSERVABLES = {
    "sheared_density": Observable(
        "kg/m^3", "mass of the grains over the volume below the lid, in steady flow under the whole stress"
    ),
    **{
        f"shear_stress_{number}": Observable(
            "Pa",
            f"largest shear stress at {100 * part:g} % of the stress after a pre-shear, a mean over a travel "
            "of half a grain's size; the steady one on a smooth base",
        )
        for number, part in enumerate(LOADS, 1)
    },
    f"shear_stress_{len(LOADS) + 1}": Observable(
        "Pa", "shear stress at the whole stress in steady flow, mean of all pre-shears"
    ),
    "friction_angle": Observable(
        "deg",
        "angle of internal friction, the slope of the yield locus: the least-squares line through the four "
        "largest shear stresses; absent on a smooth base, as are the next five",
    ),
    "cohesion": Observable("Pa", "shear stress of the yield locus without normal stress"),
    "steady_angle": Observable("deg", "angle whose tangent is shear over normal stress in steady flow"),
    "consolidation_stress": Observable(
        "Pa",
        "major principal stress of the pre-shear: the smaller Mohr circle through its point that touches the "
        "yield locus",
    ),
    "unconfined_strength": Observable(
        "Pa",
        "major principal stress of the Mohr circle through the origin that touches the yield locus; below 0 "
        "where chance makes the cohesion so",
    ),
    "flow_ratio": Observable(
        "1", "consolidation stress over unconfined strength; absent unless this is above 0"
    ),
    "wall_friction_angle": Observable(
        "deg", "angle of the least-squares line from the origin through all points; on a smooth base alone"
    ),
}
"""Observables of a shear test."""

Point = tuple[float, float]
"""Normal and shear stress [Pa]."""


def yield_locus(points: Sequence[Point]) -> Point:
    """Return slope [1] and cohesion [Pa] of the least-squares line through points."""
    normal, shear = np.array(points).T
    slope, cohesion = np.polyfit(normal, shear, 1)
    return float(slope), float(cohesion)


def unconfined_strength(slope: float, cohesion: float) -> float:
    """Return the major stress [Pa] of the circle through the origin that touches a yield locus."""
    return 2 * cohesion * (slope + math.hypot(1.0, slope))


def consolidation_stress(slope: float, cohesion: float, steady: Point) -> float:
    """Return the major stress [Pa] of the smaller circle through a point that touches a yield locus.

    A point above the line is taken as on it, at its normal stress.

    Source: D. Schulze, Powders and Bulk Solids (2021), section 3.1.4; ASTM D6773.
    """
    normal, shear = steady
    sine, cosine = slope / math.hypot(1.0, slope), 1 / math.hypot(1.0, slope)
    along = normal + cohesion * sine * cosine
    apart = along**2 - cosine**2 * (normal**2 + shear**2 - (cohesion * cosine) ** 2)
    middle = (along - math.sqrt(max(apart, 0.0))) / cosine**2
    return middle + cohesion * cosine + middle * sine


def strengths(points: Sequence[Point], steady: Point) -> dict[str, float]:
    """Return the observables of a yield locus and of the point of steady flow."""
    slope, cohesion = yield_locus(points)
    strength, stress = unconfined_strength(slope, cohesion), consolidation_stress(slope, cohesion, steady)
    return {
        "friction_angle": math.degrees(math.atan(slope)),
        "cohesion": cohesion,
        "steady_angle": math.degrees(math.atan2(steady[1], steady[0])),
        "consolidation_stress": stress,
        "unconfined_strength": strength,
    } | ({"flow_ratio": stress / strength} if strength > 0.0 else {})


def wall_friction(points: Sequence[Point]) -> dict[str, float]:
    """Return the observable of points of a smooth base."""
    normal, shear = np.array(points).T
    return {"wall_friction_angle": math.degrees(math.atan(float(normal @ shear / (normal @ normal))))}
