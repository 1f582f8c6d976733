"""Drawing of a measurement on its picture: the plate, the outline, both fitted lines and their angles."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from imaging.drawing.render import Snapshot
from imaging.drum.drum_reading import FITTED, DrumReading
from imaging.flank.flank_line import FlankLine
from imaging.flank.outline import Doubt
from imaging.geometry import FloatArray, Picture
from imaging.picture_error import PictureError
from imaging.repose import ReposeAngle

LINE_COLOR = (40, 40, 215)
OUTLINE_COLOR = (225, 150, 30)
PLATE_COLOR = (90, 90, 90)
DOUBT_COLOR = (0, 110, 225)
HALO_COLOR = (255, 255, 255)
REFERENCE_WIDTH = 900
"""Columns of a picture in which lines and letters are one unit thick; they grow with it."""
SUBPIXEL_BITS = 5


def overlay(picture: Picture | Snapshot, angle: ReposeAngle) -> Picture:
    """Draw a measured angle on a copy of its picture, blue-green-red.

    The outline (blue) is drawn where the lines (red) were fitted to it; thin lines continue to the plate and
    to each other. A `Snapshot` must have the scale of the measured one.
    """
    image = _same_scale(picture, angle).image if isinstance(picture, Snapshot) else picture
    canvas, unit = _canvas(image)
    outline = angle.outline
    ends = np.array([outline.position[0], outline.position[-1]])
    _stroke(canvas, _on_picture(angle, ends, np.zeros(2)), PLATE_COLOR, unit)
    summit = _summit(angle)
    for line, degrees, aside in ((angle.left_line, angle.left, -1.0), (angle.right_line, angle.right, 1.0)):
        fitted = np.array([line.start, line.stop])
        whole = np.array([-line.intercept / line.slope, summit])
        stroke = _on_picture(angle, fitted, _height(line, fitted))
        _stroke(canvas, _on_picture(angle, whole, _height(line, whole)), LINE_COLOR, unit)
        _stroke(canvas, _on_picture(angle, *line.covered(outline)), OUTLINE_COLOR, 1.5 * unit)
        _stroke(canvas, stroke, LINE_COLOR, 2.5 * unit)
        _label(canvas, stroke.mean(axis=0), degrees, aside, unit)
    _mark_doubts(canvas, angle.doubts, unit)
    if angle.correction:
        _mark(canvas, angle.correction, unit, PLATE_COLOR, 1)
    return canvas


def overlay_drum(picture: Picture, drum: DrumReading) -> Picture:
    """Draw the circle (grey), the surface (blue) and the slope (red) of a drum on a copy of its picture."""
    canvas, unit = _canvas(picture)
    circle, middle = drum.circle, np.array([drum.circle.column, drum.circle.row])
    turns = np.linspace(0.0, 2.0 * np.pi, 181)
    ring = np.column_stack([np.cos(turns), np.sin(turns)])
    _stroke(canvas, middle + circle.radius * ring, PLATE_COLOR, unit)
    points = drum.points()
    _stroke(canvas, points, OUTLINE_COLOR, 1.5 * unit)
    slope = np.radians(drum.dynamic_angle)
    across = np.array([np.cos(slope) * (-1.0 if drum.surface.mirrored else 1.0), np.sin(slope)])
    center = points.mean(axis=0)
    line = center + FITTED * circle.radius * np.array([[-1.0], [1.0]]) * across
    _stroke(canvas, line, LINE_COLOR, 1.5 * unit)
    _label(canvas, center, drum.dynamic_angle, -1.0 if drum.surface.mirrored else 1.0, unit)
    _mark_doubts(canvas, drum.doubts, unit)
    return canvas


def _canvas(image: Picture) -> tuple[Picture, float]:
    """Return a copy to draw on in colours, and the thickness of a line of one unit [pixels]."""
    canvas = np.repeat(image[:, :, None], 3, axis=2) if image.ndim == 2 else image.copy()
    return canvas, max(canvas.shape[1] / REFERENCE_WIDTH, 0.75)


def _mark_doubts(canvas: Picture, doubts: Sequence[Doubt], unit: float) -> None:
    if doubts:
        text = "doubtful: " + ", ".join(dict.fromkeys(doubt.name for doubt in doubts))
        _mark(canvas, text, unit, DOUBT_COLOR, 0)


def _mark(canvas: Picture, text: str, unit: float, color: tuple[int, int, int], at_bottom: int) -> None:
    """Write a line on a bar from border to border, at the top or at the bottom, as large as it fits."""
    size, weight = 0.7 * unit, max(1, round(1.4 * unit))
    (width, height), _ = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, size, weight)
    share = min(1.0, (canvas.shape[1] - height) / width)
    size, height = share * size, max(1, round(share * height))
    top = at_bottom * (canvas.shape[0] - 2 * height)
    cv2.rectangle(canvas, (0, top), (canvas.shape[1], top + 2 * height), color, -1)
    origin = (height // 2, top + round(1.5 * height))
    cv2.putText(canvas, text, origin, cv2.FONT_HERSHEY_SIMPLEX, size, HALO_COLOR, weight, cv2.LINE_AA)


def _same_scale(snapshot: Snapshot, angle: ReposeAngle) -> Snapshot:
    scale = angle.outline.meters_per_pixel
    if scale is None or not np.isclose(scale, snapshot.meters_per_pixel, rtol=1e-9):
        problem = f"must have the scale of the measured one, {scale} m per pixel"
        raise PictureError("snapshot", problem, snapshot.meters_per_pixel)
    return snapshot


def _height(line: FlankLine, position: FloatArray) -> FloatArray:
    return line.intercept + line.slope * position


def _summit(angle: ReposeAngle) -> float:
    left, right = angle.left_line, angle.right_line
    return (right.intercept - left.intercept) / (left.slope - right.slope)


def _on_picture(angle: ReposeAngle, position: FloatArray, height: FloatArray) -> FloatArray:
    """Return points (n, 2), column and row, of positions and heights over the plate."""
    return np.column_stack(angle.outline.plate.picture_point(position, height))


def _stroke(canvas: Picture, points: FloatArray, color: tuple[int, int, int], width: float) -> None:
    fixed = np.rint(points * 2**SUBPIXEL_BITS).astype(np.int32)
    thickness = max(1, round(width))
    cv2.polylines(canvas, [fixed], False, color, thickness, cv2.LINE_AA, SUBPIXEL_BITS)


def _label(canvas: Picture, anchor: FloatArray, degrees: float, aside: float, unit: float) -> None:
    """Write an angle to the left (`aside` -1) or right (1) of its line, in letters with a halo."""
    text, size, weight = f"{degrees:.1f}", 0.8 * unit, max(1, round(1.6 * unit))
    (width, height), _ = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, size, weight)
    ring = 0.16 * height
    full = width + 4.0 * ring
    corner = anchor + np.array([aside * (0.5 * full + 1.2 * height) - 0.5 * full, -0.8 * height])
    room = np.array([canvas.shape[1] - full, canvas.shape[0]]) - 0.5 * height
    corner = np.clip(corner, [0.5 * height, 1.5 * height], np.maximum(room, 0.0))
    origin = (round(corner[0]), round(corner[1]))
    degree_sign = (round(corner[0] + width + 2.0 * ring), round(corner[1] - height + ring))
    for color, extra in ((HALO_COLOR, max(2, round(3.0 * unit))), (LINE_COLOR, 0)):
        cv2.putText(canvas, text, origin, cv2.FONT_HERSHEY_SIMPLEX, size, color, weight + extra, cv2.LINE_AA)
        cv2.circle(canvas, degree_sign, max(1, round(ring)), color, weight + extra, cv2.LINE_AA)
