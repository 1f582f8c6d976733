"""Numbers of a heap's outline beside its angle: what else a calibration can hold against a measured heap."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from imaging.flanks import apex_column
from imaging.geometry import FloatArray
from imaging.outline import Outline
from imaging.photo.elevation import level_outline


@dataclass(frozen=True)
class HeapShape:
    """Shape of an outline; lengths are in the outline's pixels, or in metres where its scale is known."""

    height: float
    """Greatest height."""
    width: float
    """Width from end to end on the plate."""
    r50: float
    r90: float
    """Radius that holds 50 and 90 % of the volume of the outline turned about the apex (the mean of both
    flanks)."""
    concavity: float
    """1 - area / (width * height / 2): 0 for straight flanks, positive for hollow, negative for bulging
    ones."""
    asymmetry: float
    """(area right of the apex - area left of it) / area, -1 to 1."""


def heap_shape(outline: Outline) -> HeapShape:
    """Measure the shape of an outline (see `find_outline`), the height of the camera taken out of it."""
    level = level_outline(outline)
    x, h = level.position, level.height
    scale = outline.meters_per_pixel or 1.0
    step = np.gradient(x)
    apex = apex_column(x, h)
    radius = np.abs(x - 0.5 * (x[apex - 1] + x[apex]))
    left, right = float((h * step)[:apex].sum()), float((h * step)[apex:].sum())
    width, height = float(x[-1] - x[0] + step.mean()), float(h.max())
    r50, r90 = _volume_radii(radius, h * step * radius, (0.5, 0.9))
    return HeapShape(
        height=height * scale,
        width=width * scale,
        r50=r50 * scale,
        r90=r90 * scale,
        concavity=1.0 - (left + right) / (0.5 * width * height),
        asymmetry=(right - left) / (right + left),
    )


def _volume_radii(radius: FloatArray, ring_volume: FloatArray, shares: tuple[float, ...]) -> list[float]:
    """Radii within which the given shares of the summed ring volumes lie."""
    order = np.argsort(radius)
    volume = np.cumsum(ring_volume[order])
    return [float(np.interp(share * volume[-1], volume, radius[order])) for share in shares]
