"""Heap in three dimensions: its packed spheres, and a picture for paper."""

from __future__ import annotations

import base64
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pandas as pd

from dem_warp import CaseResult
from experiments.calibrate.campaign import Campaign
from experiments.report.pictures import HeapPicture
from imaging import snapshot

MOST_SPHERES = 40_000
"""Spheres of a heap beyond which the page shows its picture alone: a phone draws no more."""

STEPS = 65_535
"""Steps of a packed number of 16 bits."""

PIXELS = 1000
"""Width of the picture."""


@dataclass(frozen=True)
class SolidHeap:
    """The spheres of a heap, in 10 bytes each: at most 0.6 MB of a page."""

    caption: str
    picture: HeapPicture
    """The same heap from the side."""
    low: tuple[float, float, float]
    """Corner of the box of the sphere centres [m]."""
    span: float
    """Largest edge of that box [m]."""
    largest: float
    """Largest radius [m]."""
    spheres: str
    """Centres and radii, 16 bits each, over `span` and `largest`; base64 of (n, 4), little-endian."""
    grains: str
    """Grain of each sphere, 16 bits; base64."""

    @classmethod
    def of(cls, caption: str, result: CaseResult) -> SolidHeap | None:
        """Pack a heap; None where it has no spheres, or more than `MOST_SPHERES`."""
        centers, radii, grains = result.sphere_centers, result.sphere_radii, result.sphere_grain
        if not 0 < len(radii) <= MOST_SPHERES:
            return None
        low, largest = centers.min(axis=0), float(radii.max())
        span = float(np.ptp(centers, axis=0).max()) or largest
        packed = np.column_stack([(centers - low) / span, radii / largest])
        words = np.rint(STEPS * packed).astype("<u2")
        side = snapshot(centers, radii, pixels=PIXELS, backend="raster", grains=grains)
        return cls(
            caption,
            HeapPicture(caption, "", side.image),
            (float(low[0]), float(low[1]), float(low[2])),
            span,
            largest,
            base64.b64encode(words.tobytes()).decode("ascii"),
            base64.b64encode(grains.astype("<u2").tobytes()).decode("ascii"),
        )


def verified_heap(campaign: Campaign, load: Callable[[str], CaseResult]) -> SolidHeap | None:
    """Pack the fresh heap in the middle of those at the chosen values; None where there is none.

    `load` finds the result of a case by its ``case_key``, as ``Store.load`` does.
    """
    if campaign.verification is None or "angle" not in campaign.verification.cases:
        return None
    cases: pd.DataFrame = campaign.verification.cases.dropna(subset="angle").sort_values("angle")
    if cases.empty:
        return None
    case = cases.iloc[len(cases) // 2]
    caption = f"A heap at the chosen values (verification, heap {case['replicate']})."
    return SolidHeap.of(caption, load(str(case["case_key"])))
