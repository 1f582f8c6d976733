"""The circle of a drum in a picture: candidates of a Hough transform, refined on the edge around them."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from scipy.optimize import least_squares

from imaging.geometry import FloatArray, Layer
from imaging.picture_error import PictureError

SEARCHED, CANDIDATES = 200, 10
"""Longer side of the copy on which circles are searched [pixels], and circles of it that are refined."""
LEAST_RADIUS, LARGEST_RADIUS = 0.2, 0.75
"""Radius over the longer side of the picture; a larger circle is cut on three sides."""
DIRECTIONS: FloatArray = np.linspace(0.0, 2.0 * np.pi, 360, endpoint=False)
"""Directions from the centre in which the edge is looked for."""
ROUNDS = (0.06, 0.03, 0.015)
"""Reach of the search for the edge about the circle, over its radius, round by round."""
INNER, INNER_ROUNDS = (0.01, 0.02, 0.03, 0.04, 0.05, 0.06, 0.08), (0.012, 0.008, 0.008)
"""Parts of the radius within a circle that an inner edge is looked for, and the reach of that search."""
ON_CIRCLE = 0.008
"""Largest distance of an edge that belongs to a circle, over its radius."""
LEAST_STEP = 0.12
"""Least step of the lightness across an edge, over the spread of the picture's lightness."""
LEAST_ARC = 0.22
"""Part of the circle with an edge below which it is no drum; the arc of a bed of 10 % is 0.26."""
CONCENTRIC, INNERMOST, AS_LONG, AS_CLEAR = 0.06, 0.75, 0.7, 0.3
"""Largest distance of centres over the radius, and least ratios of radii, arcs and steps, of two edges of one
rim: the inner one bounds the bed."""


class Circle(NamedTuple):
    """The inner edge of a drum in a picture."""

    column: float
    row: float
    """Middle [pixels]."""
    radius: float
    """Radius [pixels]."""
    se: float = 0.0
    """Standard error of its place and radius [pixels]; 0 for a given one."""
    arc: float = 1.0
    """Part of the circle with a visible edge; 1 for a given one."""
    ellipticity: float = 0.0
    """Difference of the half axes over their mean, of a rim seen from the side."""
    step: float = np.inf
    """Median step of the lightness across the edge, over the spread of the picture's lightness."""

    def scaled(self, factor: float) -> Circle:
        """Return the circle on a copy of the picture that is `factor` times as large."""
        column, row = (factor * (value + 0.5) - 0.5 for value in (self.column, self.row))
        return self._replace(column=column, row=row, radius=factor * self.radius, se=factor * self.se)


def find_circle(picture: Layer, place: str) -> Circle:
    """Find the drum's inner edge in a picture of 32-bit numbers (rows, columns, channels).

    The edge may be a rim, the end of the light around the drum, or the arc of the bed alone.

    Raises
    ------
    PictureError
        When there is no circle.
    """
    starts = _candidates(most_varied(picture))
    found = [circle for start in starts if (circle := _refined(picture, start, ROUNDS))]
    if not found:
        raise PictureError(place, "no drum: there is no circle; if there is one, give it (circle)")
    best = max(found, key=lambda circle: circle.arc * min(circle.step, 1.0) ** 0.5)
    inner = [best._replace(radius=(1.0 - part) * best.radius) for part in INNER]
    rims = [circle for start in inner if (circle := _refined(picture, start, INNER_ROUNDS))]
    return min((circle for circle in (best, *rims) if _same_rim(circle, best)), key=lambda one: one.radius)


def most_varied(colors: Layer) -> Layer:
    """Return colours (..., channels) along the direction in which they vary most."""
    flat = colors.reshape(-1, colors.shape[-1])
    axis = np.linalg.svd(np.cov((flat - flat.mean(axis=0)).T))[0][:, 0].astype(np.float32)
    return np.asarray(colors @ axis)


def _same_rim(circle: Circle, best: Circle) -> bool:
    away = np.hypot(circle.column - best.column, circle.row - best.row) / best.radius
    close = away < CONCENTRIC and circle.radius > INNERMOST * best.radius
    return bool(close and circle.arc > AS_LONG * best.arc and circle.step > AS_CLEAR * best.step)


def _candidates(lightness: Layer) -> list[Circle]:
    """Circles of a Hough transform on a small smooth copy, with room for a centre below the picture."""
    factor = SEARCHED / max(lightness.shape)
    small = cv2.resize(lightness, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA)
    low, high = np.percentile(small, (1, 99))
    even = np.clip((small - low) / max(high - low, 1e-6) * 255.0, 0.0, 255.0).astype(np.uint8)
    room = SEARCHED // 4
    padded = cv2.copyMakeBorder(cv2.medianBlur(even, 5), room, room, room, room, cv2.BORDER_REPLICATE)
    found = cv2.HoughCircles(
        padded,
        cv2.HOUGH_GRADIENT,
        1.5,
        8.0,
        param1=100,
        param2=20,
        minRadius=round(LEAST_RADIUS * SEARCHED),
        maxRadius=round(LARGEST_RADIUS * SEARCHED),
    )
    circles = [] if found is None else found.reshape(-1, found.shape[-1])[:CANDIDATES, :3].tolist()
    return [Circle(x - room, y - room, radius).scaled(1.0 / factor) for x, y, radius in circles]


def _refined(picture: Layer, circle: Circle, rounds: tuple[float, ...]) -> Circle | None:
    """Fit a circle to the edge about a rough one; None where too little of it has an edge."""
    spread = float(np.ptp(np.percentile(picture[::4, ::4], (2, 98), axis=(0, 1)), axis=0).max())
    for reach in rounds:
        directions, radii, steps = _edge(picture, circle, reach)
        clear = steps > LEAST_STEP * spread
        if clear.sum() < LEAST_ARC * len(DIRECTIONS):
            return None
        points = _points(circle, directions[clear], radii[clear])
        start = [circle.column, circle.row, circle.radius]
        fit = least_squares(
            _misfit, start, args=(points,), loss="cauchy", f_scale=0.003 * circle.radius, max_nfev=20
        )
        circle = circle._replace(column=fit.x[0], row=fit.x[1], radius=abs(fit.x[2]))
    away = _misfit(fit.x, points)
    on = np.abs(away) < max(ON_CIRCLE * circle.radius, 1.5)
    arc = float((1.0 / (1.0 + (away[on] / (0.4 * ON_CIRCLE * circle.radius)) ** 2)).sum()) / len(DIRECTIONS)
    if arc < LEAST_ARC or not LEAST_RADIUS < circle.radius / max(picture.shape) < LARGEST_RADIUS:
        return None
    turn = np.arctan2(points[on, 1] - circle.row, points[on, 0] - circle.column)
    terms = np.column_stack(
        [np.ones(on.sum()), np.cos(turn), np.sin(turn), np.cos(2 * turn), np.sin(2 * turn)]
    )
    shape = np.linalg.lstsq(terms, away[on], rcond=None)[0]
    scatter = float(away[on].std()) / np.sqrt(max(on.sum() / 9, 1.0))
    step = float(np.median(steps[clear][on])) / spread
    return circle._replace(
        se=float(np.hypot(scatter, 0.05) / arc),
        arc=arc,
        ellipticity=2.0 * float(np.hypot(*shape[3:])) / circle.radius,
        step=step,
    )


def _points(circle: Circle, directions: FloatArray, radii: FloatArray) -> FloatArray:
    return np.column_stack(
        [circle.column + radii * np.cos(directions), circle.row + radii * np.sin(directions)]
    )


def _misfit(parameters: FloatArray, points: FloatArray) -> FloatArray:
    column, row, radius = parameters
    return np.asarray(np.hypot(points[:, 0] - column, points[:, 1] - row) - radius)


def _edge(picture: Layer, circle: Circle, reach: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return directions in the picture, and radius and size of the largest step of the colour in each."""
    count = max(int(4.0 * reach * circle.radius), 8)
    offsets = np.linspace(-reach, reach, count) * circle.radius
    wide = max(0.5 * min(reach, 0.02) * circle.radius, 1.0)
    radii = circle.radius + offsets
    inner, outer = (_sampled(picture, circle, DIRECTIONS, radii + side) for side in (-wide, wide))
    steps = np.linalg.norm(outer - inner, axis=2)
    known = np.isfinite(steps).all(axis=1)
    smooth = cv2.blur(np.nan_to_num(steps), (1, 5))
    best = smooth.argmax(axis=1)
    # the middle of all places with nearly the largest step is finer than the places
    weight = np.where(smooth > 0.7 * smooth.max(axis=1, keepdims=True), smooth, 0.0)
    weight[np.abs(np.arange(count) - best[:, None]) * (offsets[1] - offsets[0]) > 2.0 * wide] = 0.0
    mean = (weight @ radii) / np.maximum(weight.sum(axis=1), 1e-12)
    return DIRECTIONS[known], mean[known], smooth.max(axis=1)[known]


def _sampled(picture: Layer, circle: Circle, directions: FloatArray, radii: FloatArray) -> Layer:
    """Return the colours by direction and radius; NaN outside the picture."""
    columns = circle.column + np.cos(directions)[:, None] * radii
    rows = circle.row + np.sin(directions)[:, None] * radii
    return sampled(picture, columns, rows)


def sampled(picture: Layer, columns: FloatArray, rows: FloatArray) -> Layer:
    """Return a picture's values between its pixels; NaN outside the picture."""
    at = columns.astype(np.float32), rows.astype(np.float32)
    outside = (np.nan,) * 4
    return np.asarray(
        cv2.remap(picture, *at, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=outside)
    )
