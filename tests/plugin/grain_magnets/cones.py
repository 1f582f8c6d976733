"""An engine that returns a smooth cone for every case, steeper with more friction."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from dem_warp import Case, CaseResult

RADIUS, BASE = 1e-3, 20e-3
"""Radii of a sphere and of the cone [m]."""


def simulate(cases: Sequence[Case], on_result: Any = None, **_: Any) -> list[CaseResult]:
    """Return cones of 15 degrees, 30 more for a friction of 1, and a little noise by the seed."""
    results = []
    for index, case in enumerate(cases):
        noise = 0.3 * math.sin(12.9898 * case.seed)
        results.append(cone(math.radians(15.0 + 30.0 * case.grain_grain.static_friction + noise)))
        if on_result:
            on_result(index, results[-1])
    return results


def cone(angle: float) -> CaseResult:
    x, y = (axis.ravel() for axis in np.meshgrid(*[np.arange(-BASE, BASE, RADIUS)] * 2))
    heights = math.tan(angle) * (BASE - np.hypot(x, y))
    kept = heights > 0.0
    count = np.count_nonzero(kept)
    return CaseResult(
        status="finished",
        reason="",
        positions=np.column_stack([x, y, heights])[kept],
        orientations=np.tile([0.0, 0.0, 0.0, 1.0], (count, 1)),
        sizes=np.ones(count),
        shapes=np.zeros(count, dtype=int),
        clumps=np.array([[[0.0, 0.0, 0.0, RADIUS]]]),
        observables={"grain_count": float(count)},
        phases=[],
        provenance={"engine": "cones"},
    )
