"""Outlines of heaps, and the edges of the foreground that they are made of.

Lengths are in pixels of the picture; a point (column, row) is the middle of that pixel.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from imaging.flank.plate_line import PlateLine
from imaging.geometry import FloatArray, Layer
from imaging.picture_error import PictureError

MINIMUM_HEAP_WIDTH = 16
"""Smallest width of a heap that is measured [pixels]."""
HIGHER_SIDE = 0.25
"""A piece that touches both sides is cropped at one that is higher by this part of the piece's height."""
THIN = 4.0
"""Columns up to this height [pixels] are measured by their area."""
DOUBTS = (
    "lean", "error", "range", "elevation", "distance", "straightness", "foot", "step", "ends",
    "tilt", "border", "plate", "threshold", "shade", "rim", "surface",
)  # fmt: skip
"""Names of all doubts, in an angle or in the outline that it was fitted to."""


@dataclass(frozen=True)
class Doubt:
    """One reason to doubt an angle."""

    name: str
    """Short name, for tables: one of `DOUBTS`."""
    finding: str
    """Finding, and the limit that it exceeds."""

    def __post_init__(self) -> None:
        if self.name not in DOUBTS:
            raise PictureError("doubt", f"must be one of {', '.join(DOUBTS)}", self.name)

    def __str__(self) -> str:
        return f"{self.name}: {self.finding}"


@dataclass(frozen=True)
class Outline:
    """Height of a heap over its plate, from one picture."""

    position: FloatArray
    """Distance along the plate [pixels], increasing; 0 is where the plate line meets the picture's left
    border, shape (n,)."""
    height: FloatArray
    """Height over the plate line [pixels], positive, shape (n,)."""
    plate: PlateLine
    """Plate line in the picture."""
    meters_per_pixel: float | None = None
    """Scale, where it is known."""
    elevation: float = 0.0
    elevation_se: float = 0.0
    """Angle at which the camera looked down on the plate, and its standard error [degrees]."""
    distance: float | None = None
    """Distance from the camera to the heap, in widths of the heap, where it is known."""
    nearest: float | None = None
    """Least distance that the camera may have had, in widths of the heap, where only that is known."""
    photographed: bool = False
    """True for a photograph, False for a drawn silhouette, whose angle is never doubted."""
    doubts: tuple[Doubt, ...] = ()
    """Doubts about the outline; empty for a drawn silhouette."""

    @property
    def likely_distance(self) -> float | None:
        """Distance, or where only the least one is known, one that is as wrong nearby as far away."""
        return 2.0**0.5 * self.nearest if self.distance is None and self.nearest else self.distance

    def in_part(self, left: int, top: int) -> Outline:
        """Return the outline in a part of the picture that begins at this column and row."""
        start = left / np.cos(np.arctan(self.plate.slope))
        return replace(self, position=self.position - start, plate=self.plate.in_part(left, top))

    def mirrored(self) -> Outline:
        """Return the outline of the mirrored heap."""
        return replace(self, position=-self.position[::-1], height=self.height[::-1])


def levelled(
    columns: FloatArray, rows: FloatArray, plate: PlateLine, place: str
) -> tuple[FloatArray, FloatArray]:
    """Return increasing positions along the plate, and heights over it, of an upper edge's points."""
    position, height = plate.level(columns, rows)
    width = float(np.ptp(position)) if len(position) else 0.0
    if width < MINIMUM_HEAP_WIDTH:
        problem = f"the heap must be at least {MINIMUM_HEAP_WIDTH} pixels wide"
        raise PictureError(place, problem, f"{width:.0f}")
    order = np.argsort(position, kind="stable")
    return position[order], np.maximum(height[order], 0.0)


def cropping_borders(piece: NDArray[np.bool_]) -> str:
    """Name the left, right and top borders that a piece touches; return an empty text if it touches none.

    A plate that spans the picture touches both sides, its heap only the side where the piece is higher.
    """
    left, right, top = bool(piece[:, 0].any()), bool(piece[:, -1].any()), bool(piece[0].any())
    if left and right:
        first = piece.argmax(axis=0)[piece.any(axis=0)]
        ends = float(first[0]), float(first[-1])
        margin = HIGHER_SIDE * (max(ends) - float(first.min()))
        left, right = ends[0] <= ends[1] + margin, ends[1] <= ends[0] + margin
    names = [name for name, touched in (("left", left), ("right", right), ("top", top)) if touched]
    if len(names) < 2:
        return "".join(f"{name} border" for name in names)
    return f"{', '.join(names[:-1])} and {names[-1]} borders"


def top_edge(mask: NDArray[np.bool_], contrast: Layer, threshold: float) -> FloatArray:
    """Find the row at which the contrast crosses the threshold above the topmost masked pixel of each column.

    The crossing is interpolated between two pixels, which makes the edge of an anti-aliased picture exact
    to about a tenth of a pixel. Columns without a masked pixel get NaN.
    """
    first = mask.argmax(axis=0)
    columns = np.arange(mask.shape[1])
    inside = contrast[first, columns]
    outside = contrast[np.maximum(first - 1, 0), columns]
    step = np.where(first > 0, inside - outside, 0.0)
    part = np.divide(inside - threshold, step, out=np.full(len(columns), 0.5), where=step > 0)
    return np.where(mask.any(axis=0), first - np.clip(part, 0.0, 1.0), np.nan)


def bottom_edge(mask: NDArray[np.bool_], contrast: Layer, threshold: float) -> FloatArray:
    """Find the same row below the lowest masked pixel of each column."""
    return mask.shape[0] - 1.0 - top_edge(mask[::-1], contrast[::-1], threshold)


def refine_thin(rows: FloatArray, heap: NDArray[np.bool_], contrast: Layer, plate: PlateLine) -> FloatArray:
    """Replace the upper edge of columns at most `THIN` high by their summed contrast.

    Such a column may cover no pixel completely, so a threshold says little about its height.
    """
    columns = np.arange(heap.shape[1])
    line = plate.row + plate.slope * columns
    thin = line - rows <= THIN
    share = contrast / inner_contrast(heap, contrast)
    total = np.vstack([np.zeros(heap.shape[1]), np.cumsum(share, axis=0)])
    first = np.clip(heap.argmax(axis=0) - 2, 0, heap.shape[0])
    last = np.clip(np.ceil(line + 0.5), 0, heap.shape[0]).astype(np.intp)
    return np.where(thin, line - (total[last, columns] - total[first, columns]), rows)


def inner_contrast(heap: NDArray[np.bool_], contrast: Layer) -> float:
    """Return the typical contrast of pixels with the heap above and below, which it covers completely."""
    inner = heap.copy()
    inner[1:] &= heap[:-1]
    inner[:-1] &= heap[1:]
    return float(np.median(contrast[inner]) if inner.any() else contrast[heap].max())


def largest_pieces(mask: NDArray[np.bool_]) -> tuple[NDArray[np.bool_], float]:
    """Return the largest connected piece, and the area of the next one as a share of it."""
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    order = np.argsort(stats[1:, cv2.CC_STAT_AREA])[::-1]
    areas = stats[1:, cv2.CC_STAT_AREA][order]
    return labels == 1 + order[0], float(areas[1] / areas[0]) if len(areas) > 1 else 0.0
