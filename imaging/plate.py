"""The line on which a heap stands: seen as the edge of a plate, or else as the underside of the heap."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from imaging.errors import PictureError
from imaging.geometry import FloatArray

MINIMUM_BODY_WIDTH = 16
"""A narrower piece [pixels] has neither a plate nor a heap."""
END_SHARE = 0.05
"""Share of the width, at either end, that shows whether a plate reaches beyond the heap."""
END_TOLERANCE = 1.0
"""A plate's edge is straight within this many pixels."""
THIN_SHARE = 0.1
"""Share of the columns at its ends in which a plate's corners may be thin."""
BULGE = 0.002
"""A lens bends a plate's edge by this share of its length."""
END_POINTS = 14
"""Points of either end that lines are tried through."""
MINIMUM_PLATE_THICKNESS = 3.0
"""A plate beside the heap is seen at least this thick [pixels]; a thinner end is a toe of the heap."""
THICK_SHARE = 0.4
"""The underside is taken from columns at least this thick, as a share of the thickest."""
LINE_ROUNDS = 8
"""Rounds of leaving out columns that end above the line."""
LEAST_SEEN = 0.6
"""A plate is seen in at least this share of the columns at either end; grains may hide the others."""
PLATE_CLEARANCE = 0.25
"""Height over the plate line [pixels] below which all belongs to the plate."""
MAXIMUM_TILT = 20.0
"""A camera that is tilted by more [degrees] has not seen a plate."""


@dataclass(frozen=True)
class PlateLine:
    """Surface of the plate in a picture: row = `row` + `slope` * column, in pixels.

    `visible` says whether the plate itself stands out of the background, together with the heap.
    """

    row: float
    slope: float
    visible: bool

    @property
    def tilt(self) -> float:
        """Angle between the plate and the picture's rows [degrees], positive where it falls to the right."""
        return float(np.degrees(np.arctan(self.slope)))

    def rows_at(self, columns: FloatArray | NDArray[np.intp]) -> FloatArray:
        """Rows of the line at some columns."""
        return np.asarray(self.row + self.slope * columns)

    def above(self, mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """The part of a picture's mask that rises over the plate."""
        rows, columns = mask.shape
        line = self.rows_at(np.arange(columns))
        return np.asarray(mask & (np.arange(rows)[:, None] < line - PLATE_CLEARANCE))

    def in_part(self, left: int, top: int) -> PlateLine:
        """The same line in a part of the picture that begins at this column and row."""
        return replace(self, row=self.row + self.slope * left - top)

    def level(self, column: FloatArray, row: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Distance along the plate and height over it [pixels] of points in the picture."""
        cosine, sine = np.cos(np.arctan(self.slope)), np.sin(np.arctan(self.slope))
        below = row - self.row
        return column * cosine + below * sine, column * sine - below * cosine

    def picture_point(self, position: FloatArray, height: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Column and row of points given by distance along the plate and height over it: undoes `level`."""
        cosine, sine = np.cos(np.arctan(self.slope)), np.sin(np.arctan(self.slope))
        return position * cosine + height * sine, self.row + position * sine - height * cosine


def find_plate(top: FloatArray, bottom: FloatArray, place: str, shelf: bool = True) -> PlateLine:
    """Find the plate from the upper and lower edge of what stands out of the background.

    Where a plate stands out together with the heap, the outermost parts of the upper edge lie on one line,
    the plate. Otherwise the lower edge of the heap is taken, under its thicker columns: those of its toes
    are faint, or end on the round undersides of single grains.

    Parameters
    ----------
    top, bottom : (n,) arrays
        Rows of the two edges in consecutive columns; NaN outside the body.
    place : str
        Names the picture in errors.
    shelf : bool
        Look for a plate that stands out together with the heap.

    Raises
    ------
    PictureError
        When there is too little to see, or when the line is so steep that it is no plate.
    """
    columns = np.flatnonzero(np.isfinite(top))
    if len(columns) < MINIMUM_BODY_WIDTH:
        rule = f"expected what stands out of the background is at least {MINIMUM_BODY_WIDTH} pixels wide"
        raise PictureError(place, rule, len(columns))
    upper, lower = top[columns], bottom[columns]
    spanning = len(columns) == len(top)
    line = _shelf(columns, upper, lower, spanning) if shelf else None
    line = line or _underside(columns, upper, lower)
    if abs(line.tilt) > MAXIMUM_TILT:
        rule = f"expected the plate is level within {MAXIMUM_TILT:g} degrees"
        raise PictureError(place, rule, f"{line.tilt:.1f} degrees")
    return line


def _shelf(
    columns: NDArray[np.intp], upper: FloatArray, lower: FloatArray, spanning: bool
) -> PlateLine | None:
    """The line through both ends of the upper edge, where it is a plate's and not that of a heap's thin toes.

    What spans the picture from border to border is no toe, however thin.
    """
    size = max(2, round(END_SHARE * len(columns)))
    ends = np.r_[0:size, len(columns) - size : len(columns)]
    tolerance = max(END_TOLERANCE, BULGE * len(columns))
    line, kept = _common_line(columns[ends], upper[ends], tolerance)
    seen = min(kept[:size].sum(), kept[size:].sum()) >= max(2, LEAST_SEEN * size)
    thickness = float(np.quantile((lower - upper)[ends], THIN_SHARE))
    thick = spanning or thickness >= MINIMUM_PLATE_THICKNESS
    return replace(line, visible=True) if seen and thick else None


def _common_line(
    columns: NDArray[np.intp], rows: FloatArray, tolerance: float
) -> tuple[PlateLine, NDArray[np.bool_]]:
    """The line that most of both ends lie on: grains lie above it, a board's corners below.

    Lines through one point of either end are tried, some hundred, and the one that passes the most points
    within the tolerance is fitted to them.
    """
    half = len(columns) // 2
    tried = np.unique(np.linspace(0, half - 1, min(half, END_POINTS)).astype(np.intp))
    left, right = (grid.ravel() for grid in np.meshgrid(tried, half + tried))
    slope = (rows[right] - rows[left]) / (columns[right] - columns[left])
    near = np.abs(rows[left, None] + slope[:, None] * (columns - columns[left, None]) - rows) <= tolerance
    # The worse of both ends counts: a line along one end alone is that of anything.
    support = np.minimum(near[:, :half].sum(axis=1), near[:, half:].sum(axis=1)) + 1e-3 * near.sum(axis=1)
    kept = near[int(np.argmax(support))]
    if min(kept[:half].sum(), kept[half:].sum()) > 0:
        slope, row = np.polyfit(columns[kept], rows[kept], 1)
        return PlateLine(float(row), float(slope), visible=False), kept
    return PlateLine(float(np.median(rows)), 0.0, visible=False), np.zeros_like(kept)


def _underside(columns: NDArray[np.intp], upper: FloatArray, lower: FloatArray) -> PlateLine:
    """The line along the lower edge of the thicker columns."""
    thickness = lower - upper
    thick = thickness >= THICK_SHARE * thickness.max()
    return _lowest_line(columns[thick], lower[thick])


def _lowest_line(columns: NDArray[np.intp], rows: FloatArray) -> PlateLine:
    """The line through an edge without the columns that end well above it."""
    kept = np.ones(len(columns), dtype=np.bool_)
    slope, row = 0.0, float(np.median(rows))
    for _ in range(LINE_ROUNDS):
        height = row + slope * columns - rows
        limit = max(END_TOLERANCE, 2.0 * float(np.median(np.abs(height[kept]))))
        kept = height <= limit
        if kept.sum() < 2:
            break
        slope, row = np.polyfit(columns[kept], rows[kept], 1)
    return PlateLine(float(row), float(slope), visible=False)
