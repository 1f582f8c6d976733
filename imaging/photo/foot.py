"""The heap's foot seen from above: below the plate's far edge, down to the front of its base.

The base of a heap is round, so its front is half an ellipse, whose half axes give the camera's height.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from imaging.flank.plate_line import PlateLine
from imaging.geometry import FloatArray, Layer
from imaging.photo.background import unevenness, unshaded

SIDE_SHARE = 0.05
"""Part of the plate's width, at either end, that shows the plate's own colours."""
LIKENESS = 4.0
"""Least difference of heap and plate, in multiples of the plate's noise."""
LEAST_DIFFERENCE = 12.0
"""Least difference of two colours [of 255]: compression and light make less."""
TEXTURE_SHARE = 0.015
"""Size of grains and gaps, as a share of the heap's width: gaps are closed before the foot is outlined."""
ARC_ROUNDS = 12
"""Rounds of reweighting of the arc, which reduce the weight of single grains."""
CORE = 0.95
"""Part of the half width over which the arc is fitted: its ends are upright."""
ROW_SHARE = 0.8
"""Least part of a body's width over which its heap rises, if the body is no wider than the heap."""
ROW_DEPTH = 0.065
"""Depth of the lowest row of grains, in the heap's widths, for a heap of sixteen grains across."""
ROW_UNEVENNESS = 0.5
"""Least unevenness of the lowest row over that of the grains above it: a board is even."""
LEAST_RISE = 4.0
"""Least height of a heap over the line [pixels]: a blurred edge and a lens make less."""
LEAST_ARC = 3.0
"""Least depth of a visible foot, in its standard errors and in pixels."""


def below_plate(
    colors: Layer, heap: NDArray[np.bool_], body: NDArray[np.bool_], plate: PlateLine
) -> Layer | None:
    """Compare what is below the plate's line with the plate.

    The difference from the plate's own colours is over the threshold for the heap, 0 above the line, shape
    (rows, columns); None where heap and plate are too similar to find the heap's end.

    The plate's own colour along each levelled row is interpolated between its two ends, which removes its
    top, its front and the light on them; the heap remains, or its shadow. `heap` is the part of it above the
    plate's line, `body` the whole foreground.
    """
    rows, columns = heap.shape
    nothing = np.zeros((rows, columns), dtype=np.float32)
    upright = np.array([[1.0, 0.0, 0.0], [-plate.slope, 1.0, 0.0]])
    turned = cv2.warpAffine(colors, upright, (columns, rows), borderMode=cv2.BORDER_REPLICATE)
    flat = np.asarray(turned, dtype=np.float32).reshape(colors.shape)
    first = int(np.ceil(plate.row)) + 1
    if first >= rows - 2:
        return nothing
    ends = np.flatnonzero(body.any(axis=0))[[0, -1]]
    size = max(2, round(SIDE_SHARE * (ends[1] - ends[0])))
    sides = [flat[first:, ends[0] : ends[0] + size], flat[first:, ends[1] - size + 1 : ends[1] + 1]]
    middles = [np.median(side, axis=1) for side in sides]
    noise = max(
        float(np.median(np.abs(side - middle[:, None]))) for side, middle in zip(sides, middles, strict=True)
    )
    share = np.clip((np.arange(columns) - ends[0]) / max(ends[1] - ends[0], 1), 0.0, 1.0).astype(np.float32)
    own = middles[0][:, None] + share[None, :, None] * (middles[1] - middles[0])[:, None]
    least = max(LIKENESS * noise, LEAST_DIFFERENCE)
    difference, typical = _difference_from_plate(flat[first:], own, colors, heap, least)
    if typical < least:
        return None
    nothing[first:] = difference / max(0.5 * typical, least)
    back = np.array([[1.0, 0.0, 0.0], [plate.slope, 1.0, 0.0]])
    return np.asarray(cv2.warpAffine(nothing, back, (columns, rows)), dtype=np.float32)


def _difference_from_plate(
    below: Layer, own: Layer, colors: Layer, heap: NDArray[np.bool_], least: float
) -> tuple[Layer, float]:
    """Return differences from the plate's own colours: of the pixels below the line, and of the heap above.

    Shadows do not count, unless the heap would then not differ: grey powder on a grey plate.
    """
    covered = heap.any(axis=0)
    reach = max(1, round(0.5 * TEXTURE_SHARE * int(covered.sum())))
    near = np.median(own[: max(2, len(own) // 20), covered], axis=(0, 1)).astype(np.float32)
    around = np.broadcast_to(near, colors.shape)
    typical = float(np.median(unshaded(colors, around, reach)[heap]))
    if typical >= least:
        return unshaded(below, own, reach), typical
    typical = float(np.median(np.linalg.norm(colors[heap] - near, axis=1)))
    return np.linalg.norm(below - own, axis=2), typical


def is_lowest_row(
    colors: Layer, heap: NDArray[np.bool_], body: NDArray[np.bool_], plate: PlateLine, least: float
) -> bool:
    """Return True if the supposed plate is the heap's lowest row of grains, whose tops are on a line too.

    Such a row is as wide as the heap, a grain deep, of its hues within `least` [of 255], and as uneven.
    """
    covered = np.flatnonzero(body.any(axis=0))
    width = float(np.ptp(covered))
    below = np.arange(len(body))[:, None] - plate.rows_at(np.arange(body.shape[1]))
    rising = np.flatnonzero((heap & (below < -LEAST_RISE)).any(axis=0))
    if len(rising) == 0 or np.ptp(rising) < ROW_SHARE * width:
        return False
    lowest = np.where(body, below, -np.inf).max(axis=0)[covered]
    # Half of the columns, not all: a grain may be in front of the others.
    if float(np.median(lowest)) > ROW_DEPTH * width:
        return False
    row, above = body & (below > 0.0), heap & (below > -ROW_DEPTH * width)
    if not row.any() or not above.any():
        return False
    own = np.broadcast_to(np.median(colors[above], axis=0), colors[row][None].shape).astype(np.float32)
    if float(np.median(unshaded(colors[row][None], own, 0))) > least:
        return False
    uneven = unevenness(colors, max(2, round(0.25 * float(np.median(lowest)))))
    return float(np.median(uneven[row])) >= ROW_UNEVENNESS * float(np.median(uneven[above]))


def joined_foot(heap: NDArray[np.bool_], level: Layer, plate: PlateLine) -> NDArray[np.bool_]:
    """Join the heap above the plate's line with its foot below."""
    rows, columns = heap.shape
    width = int(np.ptp(np.flatnonzero(heap.any(axis=0)))) + 1
    size = 2 * max(1, round(0.5 * TEXTURE_SHARE * width)) + 1
    cut = (level > 1.0).astype(np.uint8)
    cut = np.asarray(cv2.morphologyEx(cut, cv2.MORPH_CLOSE, np.ones((size, size), np.uint8)), dtype=np.uint8)
    lower = np.greater(cv2.morphologyEx(cut, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)), 0)
    line = plate.rows_at(np.arange(columns))
    row = np.arange(rows)[:, None]
    # The plate's blurred edge belongs to neither: the heap goes through it where it continues below.
    seam = (row >= line - 1.5) & (row <= line + 3.0) & heap.any(axis=0)
    whole = heap | (lower & (row > line)) | seam
    _, labels = cv2.connectedComponents(whole.astype(np.uint8), connectivity=4)
    kept = np.unique(labels[heap])
    joined = np.isin(labels, kept[kept > 0]) & (heap | (lower & (row > line)))
    return np.asarray(joined)


@dataclass(frozen=True)
class Base:
    """The front of a heap's base: row = `row` + `slope` * column + `depth` * half ellipse between `ends`."""

    row: float
    slope: float
    depth: float
    depth_se: float
    ends: tuple[float, float]

    @property
    def seen(self) -> bool:
        """True where the base is curved."""
        return self.depth > LEAST_ARC * max(self.depth_se, 1.0)

    @property
    def half_width(self) -> float:
        """Half of the base's width [pixels]."""
        return 0.5 * (self.ends[1] - self.ends[0])

    @property
    def elevation(self) -> float:
        """Angle at which the camera looks down on the plate [degrees]."""
        return float(np.degrees(np.arcsin(np.clip(self.depth / self.half_width, 0.0, 1.0))))

    @property
    def elevation_se(self) -> float:
        """Standard error of the elevation [degrees]."""
        cosine = max(np.cos(np.radians(self.elevation)), 0.1)
        return float(np.degrees(self.depth_se / self.half_width / cosine))


def front_of_base(bottom: FloatArray, slope: float | None) -> Base:
    """Fit the front of the base to the lower edge of a heap (NaN outside) by least absolute deviations.

    The slope of the plate is fitted if it is unknown.
    """
    columns = np.flatnonzero(np.isfinite(bottom)).astype(np.float64)
    ends = (float(columns[0]) - 0.5, float(columns[-1]) + 0.5)
    middle, half = 0.5 * (ends[0] + ends[1]), 0.5 * (ends[1] - ends[0])
    core = columns[np.abs(columns - middle) <= CORE * half]
    curve = np.sqrt(1.0 - ((core - middle) / half) ** 2)
    values = bottom[core.astype(np.intp)]
    terms = np.column_stack([np.ones_like(core), curve])
    if slope is None:
        terms = np.column_stack([terms, core - middle])
    else:
        values = values - slope * (core - middle)
    weight = np.ones(len(core))
    for _ in range(ARC_ROUNDS):
        root = np.sqrt(weight)
        fitted = np.linalg.lstsq(terms * root[:, None], values * root, rcond=None)[0]
        residual = values - terms @ fitted
        scale = max(float(np.median(np.abs(residual))), 0.25)
        weight = 1.0 / np.maximum(np.abs(residual), scale)
    tilt = float(fitted[2]) if slope is None else slope
    spread = 1.5 * scale / np.sqrt(max(len(core) / 10.0, 1.0)) / max(float(curve.std()), 1e-6)
    return Base(float(fitted[0]) - tilt * middle, tilt, float(fitted[1]), spread, ends)
