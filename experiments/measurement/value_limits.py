"""Limits of measured values, from the size and duration of the test.

A wrong unit changes a value by a factor of ten or more, so wide limits find it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from dem_warp import Compression, Drum, LiftedCylinder, Penetration, PouredScene, Shear
from dem_warp.model import GRAVITY
from experiments.io.errors import InputError
from experiments.studyfile import Study
from experiments.studyfile.campaign import TARGET_SCENE
from experiments.studyfile.observables import (
    BY_NAME,
    CURVE_PROFILE,
    FORCE_PROFILE,
    OBSERVABLES,
    OUTLINE_PROFILE,
    SHEAR_PROFILE,
    SURFACE_PROFILE,
    Observable,
)

PATIENCE = 10.0
"""Longest time for a heap to come to rest after the lift [s]."""

STEEPEST = 3.0
"""Largest shear stress over the normal stress of a pre-shear: that of powders is below one."""

FIRMEST = 2000.0
"""Largest pressure on a tool over that of the grains above: that of a footing in dense sand is some 200."""

LOOSEST = 0.01
"""Smallest part of a container that grains fill: straw fills some 0.05."""


@dataclass(frozen=True)
class ValueLimits:
    """Limits of the values of a test."""

    grain: float
    """Radius of the smallest sphere of a grain [m]: no heap is lower."""
    length: float
    """Radius of the flattest heap of the grains in the tube, or the extent of another test [m]."""
    time: float
    """Time from the start of the lift until long after its end [s]; infinite for another test."""
    density: float
    """Density of the grain [kg/m3]."""
    radius: float | None = None
    """Radius of a drum [m]."""
    stress: float | None = None
    """Largest stress of a compression, or normal stress of a pre-shear [Pa]."""
    depth: float = 0.0
    """Depth of a penetration [m]."""
    force: float = math.inf
    """Largest force on its tool [N]."""
    profile: str = ""
    """Profile that the test has; empty for none."""

    def limits(self, observable: Observable) -> tuple[float, float]:
        """Return the smallest and largest possible value of an observable, in its unit."""
        by_unit = {"deg": (0.0, 90.0), "m": (self.grain, self.length), "s": (0.0, self.time)}
        by_unit["kg/m^3"] = (LOOSEST * self.density, self.density)
        if observable.part_of == CURVE_PROFILE:
            return 0.0, 1.0
        if observable.part_of == SHEAR_PROFILE and self.stress:
            return 0.0, STEEPEST * self.stress
        if observable.part_of not in ("", FORCE_PROFILE):
            # the height beyond a heap's foot is 0; a drum's axis is in its middle
            return (0.0 if self.radius is None else -self.length), self.length
        masses = {"kg": (0.0, math.inf), "kg/s": (0.0, math.inf)}
        masses |= {"N": (-self.force, self.force), "J": (0.0, self.force * self.depth)}
        return observable.limits or (by_unit | masses).get(observable.unit, (-math.inf, math.inf))

    def require_height(self, height: float, hint: str, source: str, place: str) -> None:
        """Refuse the outline of a heap, from a ``source``, whose greatest height [m] is impossible."""
        low, high = self.limits(BY_NAME["height"])
        if not low <= height <= high:
            problem = f"the outline must be {1e3 * low:.3g} to {1e3 * high:.3g} mm high in this test"
            raise InputError(place, problem, f"{1e3 * height:.6g} mm{source}", hint)


def limits_of_test(study: Study, scene: str = TARGET_SCENE) -> ValueLimits:
    """Return the limits of a study's test, or of another of its scenes."""
    case = study.case({}, 0, scene)
    test, density = case.scene, case.grain_material.density
    if not isinstance(test, LiftedCylinder):
        half_x, half_y, bottom = test.room(case.grains.grain_reach)
        high = test.brim - bottom if isinstance(test, PouredScene) else 0.0
        room = max(2.0 * half_x, 2.0 * half_y, high)
        radius = test.diameter / 2 if isinstance(test, Drum) else None
        stress = test.stress if isinstance(test, Compression | Shear) else None
        profile = OUTLINE_PROFILE if test.leaves_a_heap else SURFACE_PROFILE if radius else ""
        own = {Compression.name: CURVE_PROFILE, Shear.name: SHEAR_PROFILE, Penetration.name: FORCE_PROFILE}
        profile, depth, force = own.get(test.name, profile), 0.0, math.inf
        if isinstance(test, Penetration):
            depth = test.depth
            force = FIRMEST * density * GRAVITY * depth * max(test.width, case.grains.grain_reach) ** 2
        smallest = case.grains.smallest_sphere
        return ValueLimits(smallest, room, math.inf, density, radius, stress, depth, force, profile=profile)
    reach, time = 4.0 * test.diameter + 2.0 * test.height, PATIENCE + 10.0 * test.height / test.lift_speed
    return ValueLimits(case.grains.smallest_sphere, reach, time, density, profile=OUTLINE_PROFILE)


def inversions(heap: Mapping[str, float]) -> Iterable[tuple[str, str]]:
    """Find pairs of observables of one heap of which the smaller one is larger."""
    for small in OBSERVABLES:
        large = small.never_above
        if small.name in heap and large in heap and not heap[small.name] <= heap[large]:
            yield small.name, large
