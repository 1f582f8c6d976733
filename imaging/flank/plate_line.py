"""The line under a heap: the visible edge of its plate, or the underside of the heap."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from imaging.geometry import FloatArray
from imaging.picture_error import PictureError

MINIMUM_BODY_WIDTH = 16
"""Smallest width of a piece with a plate or a heap [pixels]."""
END_SHARE = 0.05
"""Share of the width, at either end, that shows whether a plate reaches beyond the heap."""
END_TOLERANCE = 1.0
"""Largest deviation of a plate's edge from a line [pixels]."""
THIN_SHARE = 0.1
"""Share of the columns at its ends in which a plate's corners may be thin."""
BULGE = 0.002
"""Bend of a plate's edge by a lens, as a share of its length."""
END_POINTS = 14
"""Points of either end that candidate lines pass through."""
MINIMUM_PLATE_THICKNESS = 3.0
"""Smallest thickness of a plate next to the heap [pixels]; a thinner end is a toe of the heap."""
THICK_SHARE = 0.4
"""The underside is that of columns at least this thick, as a share of the thickest."""
LINE_ROUNDS = 8
"""Largest number of rounds that leave out columns that end above the line."""
LEAST_SEEN = 0.6
"""Smallest share of the columns at either end that show a plate; grains may hide it in the others."""
PLATE_CLEARANCE = 0.25
"""Height over the plate line [pixels] below which everything belongs to the plate."""
MAXIMUM_TILT = 20.0
"""Largest tilt of a plate [degrees]."""


@dataclass(frozen=True)
class PlateLine:
    """Surface of the plate in a picture: row = `row` + `slope` * column, in pixels.

    `visible` is true where the plate itself differs from the background, like the heap.
    """

    row: float
    slope: float
    visible: bool

    @property
    def tilt(self) -> float:
        """Angle between the plate and the picture's rows [degrees], positive where it falls to the right."""
        return float(np.degrees(np.arctan(self.slope)))

    def rows_at(self, columns: FloatArray | NDArray[np.intp]) -> FloatArray:
        """Return the rows of the line at some columns."""
        return np.asarray(self.row + self.slope * columns)

    def above(self, mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return the part of a picture's mask above the plate."""
        rows, columns = mask.shape
        line = self.rows_at(np.arange(columns))
        return np.asarray(mask & (np.arange(rows)[:, None] < line - PLATE_CLEARANCE))

    def in_part(self, left: int, top: int) -> PlateLine:
        """Return the line in a part of the picture that begins at this column and row."""
        return replace(self, row=self.row + self.slope * left - top)

    def level(self, column: FloatArray, row: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return distances along the plate and heights over it [pixels] of points in the picture."""
        cosine, sine = np.cos(np.arctan(self.slope)), np.sin(np.arctan(self.slope))
        below = row - self.row
        return column * cosine + below * sine, column * sine - below * cosine

    def picture_point(self, position: FloatArray, height: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return columns and rows of points given by position along the plate and height: undo `level`."""
        cosine, sine = np.cos(np.arctan(self.slope)), np.sin(np.arctan(self.slope))
        return position * cosine + height * sine, self.row + position * sine - height * cosine


def find_plate(top: FloatArray, bottom: FloatArray, place: str, shelf: bool = True) -> PlateLine:
    """Find the plate from the upper and lower edge of the foreground.

    Where the plate is visible next to the heap, the outermost parts of the upper edge are on one line, the
    plate. Otherwise the line is the lower edge of the heap, under its thicker columns: those of its toes are
    faint, or end on the round undersides of single grains. Edges are NaN outside the body; without `shelf` no
    plate next to the heap is looked for.
    """
    columns = np.flatnonzero(np.isfinite(top))
    if len(columns) < MINIMUM_BODY_WIDTH:
        problem = f"the foreground must be at least {MINIMUM_BODY_WIDTH} pixels wide"
        raise PictureError(place, problem, len(columns))
    upper, lower = top[columns], bottom[columns]
    spanning = len(columns) == len(top)
    line = _shelf(columns, upper, lower, spanning) if shelf else None
    line = line or _underside(columns, upper, lower)
    if abs(line.tilt) > MAXIMUM_TILT:
        problem = f"the plate must be level within {MAXIMUM_TILT:g} degrees"
        raise PictureError(place, problem, f"{line.tilt:.1f} degrees")
    return line


def _shelf(
    columns: NDArray[np.intp], upper: FloatArray, lower: FloatArray, spanning: bool
) -> PlateLine | None:
    """Find the line through both ends of the upper edge, if it is a plate's and not that of thin toes.

    A piece that spans the picture from border to border is no toe, however thin.
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
    """Fit the line that most of both ends are on: grains are above it, a board's corners below.

    Of some hundred lines through one point of either end, the one with the most points within the tolerance
    is fitted to these points.
    """
    half = len(columns) // 2
    tried = np.unique(np.linspace(0, half - 1, min(half, END_POINTS)).astype(np.intp))
    left, right = (grid.ravel() for grid in np.meshgrid(tried, half + tried))
    slope = (rows[right] - rows[left]) / (columns[right] - columns[left])
    near = np.abs(rows[left, None] + slope[:, None] * (columns - columns[left, None]) - rows) <= tolerance
    # The worse of both ends counts: anything may have a line along one end.
    support = np.minimum(near[:, :half].sum(axis=1), near[:, half:].sum(axis=1)) + 1e-3 * near.sum(axis=1)
    kept = near[int(np.argmax(support))]
    if min(kept[:half].sum(), kept[half:].sum()) > 0:
        slope, row = np.polyfit(columns[kept], rows[kept], 1)
        return PlateLine(float(row), float(slope), visible=False), kept
    return PlateLine(float(np.median(rows)), 0.0, visible=False), np.zeros_like(kept)


def _underside(columns: NDArray[np.intp], upper: FloatArray, lower: FloatArray) -> PlateLine:
    thickness = lower - upper
    thick = thickness >= THICK_SHARE * thickness.max()
    return _lowest_line(columns[thick], lower[thick])


def _lowest_line(columns: NDArray[np.intp], rows: FloatArray) -> PlateLine:
    """Fit the line through an edge without the columns that end well above it."""
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
