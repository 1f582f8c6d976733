"""Outlines as a level camera sees them, from those that one sees which looks down on the plate."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.optimize import least_squares

from imaging.geometry import FloatArray
from imaging.outline import Outline
from imaging.photo.view import USUAL_DISTANCE

RINGS = 121
"""Rings of the body of revolution."""
DIRECTIONS = 91
"""Points of a quarter of a ring, the half behind the heap's tip."""
END = 0.95
"""Part of the half width over which outlines are compared: the base behind hides the foot."""


def level_outline(outline: Outline) -> Outline:
    """The outline as a level camera far away sees it; the same one where it was drawn, or seen so.

    A camera that looks down sees the far side of the heap over its flanks, and the plate's line, at which the
    flanks end, above the middle of the base. The heights are changed by what that makes of a body of
    revolution whose outline from there is the mean of both flanks; so the grains on the outline stay.
    """
    if outline.elevation == 0.0 and outline.distance is None:
        return outline
    position, height = outline.position, outline.height
    below = np.concatenate([[0.0], np.cumsum(0.5 * (height[1:] + height[:-1]) * np.diff(position))])
    if not below[-1] > 0.0:
        return outline
    middle = float(np.interp(0.5 * below[-1], below, position))
    reach = 0.5 * float(np.ptp(position))
    radius = np.linspace(0.0, END, RINGS)
    flanks = [np.interp(middle + side * radius * reach, position, height) for side in (-1.0, 1.0)]
    camera = np.radians(outline.elevation), outline.distance or USUAL_DISTANCE
    body = _body_seen_as(0.5 * (flanks[0] + flanks[1]) / reach, radius, camera)
    step = float(np.ptp(position)) / max(len(position) - 1, 1)
    beyond = np.arange(step, max(body[1] - 1.0, 0.0) * reach, step)
    whole = np.concatenate([position[0] - beyond[::-1], position, position[-1] + beyond])
    seen = np.concatenate([0.0 * beyond, height, 0.0 * beyond])
    away = np.abs(whole - middle) / reach
    change = _heights(body, away) - _outline_of(body, away, camera)
    return replace(
        outline,
        position=whole,
        height=np.maximum(seen + reach * change, 0.0),
        elevation=0.0,
        elevation_se=0.0,
        distance=None,
    )


def _heights(body: FloatArray, radius: FloatArray) -> FloatArray:
    """Heights of a body, a cone that bulges; in half widths of the outline, as radii are."""
    tip, foot, bulge, lean = body
    part = np.clip(radius / foot, 0.0, 1.0)
    return np.asarray(tip * (1.0 - part) * (1.0 + bulge * part + lean * part * (1.0 - 2.0 * part)))


def _body_seen_as(seen: FloatArray, radius: FloatArray, camera: tuple[float, float]) -> FloatArray:
    """Tip, foot and bulges of the body whose outline has heights `seen` at `radius`."""
    start = np.array([float(seen.max()), 1.02, 0.0, 0.0])
    limits = np.array([[0.2 * start[0], 1.0, -0.9, -2.0], [3.0 * start[0], 1.5, 3.0, 2.0]])
    found = least_squares(
        lambda body: _outline_of(body, radius, camera) - seen,
        start,
        bounds=limits,
        x_scale=[0.1, 0.05, 0.3, 0.3],
    )
    return np.asarray(found.x)


def _outline_of(body: FloatArray, radius: FloatArray, camera: tuple[float, float]) -> FloatArray:
    """Heights of a body's outline over the line at which its flanks end (see `imaging.photo.view.seen_angle`)."""
    turn, distance = camera
    rings = np.linspace(0.0, body[1], RINGS)
    heights = _heights(body, rings)
    nearness = 0.5 * np.cos(turn) / distance
    outline = np.full(len(radius), -np.inf)
    around = np.linspace(0.0, 0.5 * np.pi, DIRECTIONS)[:-1]
    for x, y in zip(np.cos(around), np.sin(around), strict=True):
        depth = 1.0 + nearness * (y * rings * np.cos(turn) - heights * np.sin(turn))
        up = (heights * np.cos(turn) + y * rings * np.sin(turn)) / depth
        outline = np.maximum(outline, np.interp(radius, x * rings / depth, up, right=-np.inf))
    tip = heights[0] * np.cos(turn)
    touch = (body[1] * np.sin(turn)) ** 2 / max(tip, 1e-9)
    return np.maximum(outline - touch, 0.0)
