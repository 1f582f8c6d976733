"""Effect of the camera's height: angles and outlines of a cone seen from above, and the way back."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from scipy.optimize import least_squares

from imaging.flank.outline import Outline
from imaging.geometry import FloatArray

USUAL_DISTANCE = 10.0
"""Assumed distance [heap widths]: its effect is in the middle of those from `NEAR` to far away."""
NEAR = 4.0
"""Smallest usual distance [heap widths]."""
OTHER_GRAINS, MOST_GRAINS = 6.0, 2.0
"""Turn about a heap's axis [degrees] after which the outline has other grains: two, of twenty across; and the
most that this adds to the variance, of that of the lines: intervals of 413 renders then hold 96 %."""
BASE_POINTS = 721
"""Points of half the base's circle."""
LEVEL_ROUNDS = 16
"""Rounds of the iteration from the seen angle to the cone's; two or three gain a digit."""
RINGS = 121
"""Rings of the body of revolution."""
DIRECTIONS = 91
"""Points of a quarter of a ring, the half behind the heap's tip."""
END = 0.95
"""Part of the half width over which outlines are compared: the base behind hides the foot."""


def seen_angle(angle: float, elevation: float, distance: float) -> float:
    """Return the angle at which a camera sees the outline of a cone [degrees].

    The outline is the pair of tangents from the tip to the ellipse that is the image of the base's circle.
    From far away, with the height h and the base's radius r, they go from h cos e to half axes r and r sin e:
    tan(seen)^2 = tan(angle)^2 cos(e)^2 - sin(e)^2. From nearby the effect is smaller: the tip is closer to a
    camera that looks down than the foot behind it. `angle` and `elevation`, at which the camera looks down,
    are in degrees; `distance` is that of the cone's axis, in widths of its base, and may be infinite.
    """
    turn, slope = np.radians(elevation), np.tan(np.radians(angle))
    around = np.linspace(-0.5 * np.pi, 0.5 * np.pi, BASE_POINTS)
    x, y = np.cos(around), np.sin(around)
    nearness = 0.5 * np.cos(turn) / distance
    depth = 1.0 + nearness * y * np.cos(turn)
    tip_depth = 1.0 - nearness * slope * np.sin(turn)
    across, up = x / depth, y * np.sin(turn) / depth
    drop = slope * np.cos(turn) / tip_depth - up
    outer = across > 0.2
    return float(np.degrees(np.arctan((drop[outer] / across[outer]).min())))


def level_angle(
    seen: float, elevation: float, distance: float | None = None, nearest: float | None = None
) -> float:
    """Return the angle of a cone [degrees] whose outline a camera sees as `seen`: undo `seen_angle`.

    Without a distance it is halfway between the angles from the nearest place and from far away. Without this
    either, a level camera is far away, and any other camera at `USUAL_DISTANCE`.
    """
    if distance is None and nearest is not None:
        return 0.5 * (level_angle(seen, elevation, nearest) + level_angle(seen, elevation, math.inf))
    if distance is None and elevation == 0.0:
        return seen
    angle = seen
    for _ in range(LEVEL_ROUNDS):
        angle = min(max(angle + seen - seen_angle(angle, elevation, distance or USUAL_DISTANCE), 0.1), 89.0)
    return angle


def level_error(seen: float, outline: Outline) -> float:
    """Return the standard error [degrees] of an angle from that of the elevation and an unknown distance."""
    elevation, away = outline.elevation, outline.likely_distance
    if elevation == outline.elevation_se == 0.0:
        return 0.0
    higher = level_angle(seen, elevation + outline.elevation_se, away) - level_angle(seen, elevation, away)
    if away is not None:
        return abs(higher)
    reach = level_angle(seen, elevation, math.inf) - level_angle(seen, elevation, NEAR)
    return float(np.hypot(higher, 0.5 * reach))


def near_change(seen: float, outline: Outline) -> float:
    """Return the change of an angle [degrees] if the camera was at the nearest place that it may have had."""
    if outline.nearest is None:
        return 0.0
    near = level_angle(seen, outline.elevation, outline.nearest)
    return near - level_angle(seen, outline.elevation, nearest=outline.nearest)


def camera_error(seen: float, outline: Outline, lines: float) -> float:
    """Return what the camera's place adds to the standard error of an angle's lines [degrees].

    An unknown distance changes the angle by that of the nearest place at most: two standard errors. And lines
    from nearby or above touch a cone at other grains than those of the level outline, which are as rough.
    """
    unknown = 0.5 * near_change(seen, outline)
    above = np.tan(np.radians(outline.elevation)) / np.tan(np.radians(max(seen, 1.0)))
    turn = np.degrees(np.hypot(0.5 / (outline.likely_distance or math.inf), min(above, 1.0)))
    return float(np.hypot(unknown, lines * min(turn / OTHER_GRAINS, MOST_GRAINS) ** 0.5))


def level_outline(outline: Outline) -> Outline:
    """Return the outline that a level camera far away would see; a drawn outline is returned unchanged.

    A camera that looks down sees the far side of the heap above its flanks, and the flanks end above the
    middle of the base. The correction is that of a body of revolution whose outline from there is the mean of
    both flanks, so the roughness of the outline is kept.
    """
    if outline.elevation == 0.0 and outline.likely_distance is None:
        return outline
    position, height = outline.position, outline.height
    below = np.concatenate([[0.0], np.cumsum(0.5 * (height[1:] + height[:-1]) * np.diff(position))])
    if not below[-1] > 0.0:
        return outline
    middle = float(np.interp(0.5 * below[-1], below, position))
    reach = 0.5 * float(np.ptp(position))
    radius = np.linspace(0.0, END, RINGS)
    flanks = [np.interp(middle + side * radius * reach, position, height) for side in (-1.0, 1.0)]
    camera = np.radians(outline.elevation), outline.likely_distance or USUAL_DISTANCE
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
        nearest=None,
    )


def _heights(body: FloatArray, radius: FloatArray) -> FloatArray:
    """Heights of a bulging cone; lengths are in half widths of the outline."""
    tip, foot, bulge, lean = body
    part = np.clip(radius / foot, 0.0, 1.0)
    return np.asarray(tip * (1.0 - part) * (1.0 + bulge * part + lean * part * (1.0 - 2.0 * part)))


def _body_seen_as(seen: FloatArray, radius: FloatArray, camera: tuple[float, float]) -> FloatArray:
    """Fit tip, foot and bulges of the body whose outline has the heights `seen` at `radius`."""
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
    """Heights of a body's outline over the line at which its flanks end (see `seen_angle`)."""
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
