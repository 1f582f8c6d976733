"""The surface of a bed in a drum in different pictures: the volume below it, and its slopes."""

import math
from typing import Literal, NamedTuple

import numpy as np

from dem_warp.scenes.surfaces import TOP_OF_GRAIN, column_tops, profile, slope

SURFACE = 0.8
"""Part of the surface's chord that the slope is fitted to, away from the drum's wall."""

FINER = 4
"""Strips per column of the bed where the shell bounds it."""

STATIONS = (-0.8, -0.6, -0.4, -0.2, 0.0, 0.2, 0.4, 0.6, 0.8)
"""Places across a drum, over its radius, where the height of the surface is measured."""

Picture = Literal["depth", "silhouette", "end"]
"""Pictures of a surface: the mean over the drum's depth, the outline against a light behind it, and the
grains at the transparent end."""


class SurfaceAngles(NamedTuple):
    """Slopes of a bed at one look [deg]; see the observables of `Drum`."""

    dynamic_angle: float
    upper_angle: float
    lower_angle: float
    mass_angle: float


class DrumView(NamedTuple):
    """A drum and the picture of it."""

    radius: float
    length: float
    """Inner radius and length [m]."""
    picture: Picture = "depth"
    camera_distance: float | None = None
    """Distance of the camera from the front end, on the axis [m]; None: infinite."""

    def seen(self, positions: np.ndarray, reach: float) -> np.ndarray:
        """Return the grains in the picture at their places in it.

        `positions` (n, 3) are centres from the middle of the drum, whose axis is along y, with the camera at
        -y; `reach` is the bounding radius of a grain [m].
        """
        if self.picture == "depth":
            return positions
        behind = positions[:, 1] + self.length / 2
        if self.picture == "end":
            return positions[behind < 2 * reach] * np.array([1.0, 0.0, 1.0])
        far = self.camera_distance
        scale = np.ones(len(behind)) if far is None else far / (far + behind)
        return positions * np.column_stack([scale, np.zeros(len(behind)), scale])


def half_chord(level: float, radius: float) -> float:
    """Return half the width of a drum at a height above its lowest line [m]."""
    return math.sqrt(max(level * (2 * radius - level), 0.0))


def bed_volume(positions: np.ndarray, radius: float, length: float, reach: float) -> float:
    """Return the volume of a drum below the surface of a bed of any shape [m3].

    Each column of a grain's size is filled up to half a grain above its highest centre, within the shell of a
    radius and length [m]. `positions` and `reach` are as in `DrumView.seen`.
    """
    if not len(positions):
        return 0.0
    side = 2 * reach
    columns, tops = column_tops(positions[:, :2], positions[:, 2], side)
    strips = (columns[:, :1] + (np.arange(FINER) + 0.5) / FINER) * side
    wall = np.sqrt(np.maximum(radius**2 - strips**2, 0.0))
    height = np.clip(tops[:, None] + TOP_OF_GRAIN * reach + wall, 0.0, 2 * wall)
    ends = np.array([[0.0, side]]) + columns[:, 1:] * side
    depth = np.ptp(np.clip(ends, -length / 2, length / 2), axis=1)
    return float(height.mean(axis=1) @ depth * side)


def surface_angles(
    positions: np.ndarray, chord: float, reach: float, view: DrumView | None = None
) -> SurfaceAngles | None:
    """Return the slopes of the bed in a drum; None if a part of its surface is too short for a line.

    The bed is high at -x; `positions` and `reach` are as in `DrumView.seen`. `chord` is half the length of
    the surface [m]; a picture of the end uses its own. Without a view it is the mean over the depth.
    """
    if (levelled := _levelled(positions, reach, view)) is None:
        return None
    turn, along, height = levelled
    if view is not None and view.picture == "end":
        wall = np.sqrt(np.maximum(view.radius**2 - along**2, 0.0))
        area = float(np.clip(height + TOP_OF_GRAIN * reach + wall, 0.0, 2 * wall).sum() * 2 * reach)
        chord = half_chord(level_of(area / (math.pi * view.radius**2), view.radius), view.radius)
    middle = np.abs(along) < SURFACE * chord
    gradients = [
        slope(along[part], height[part]) for part in (middle, middle & (along < 0), middle & (along > 0))
    ]
    whole, upper, lower = (None if g is None else math.degrees(turn - math.atan(g)) for g in gradients)
    if whole is None or upper is None or lower is None:
        return None
    return SurfaceAngles(whole, upper, lower, math.degrees(turn))


def surface_heights(positions: np.ndarray, chord: float, reach: float, view: DrumView) -> np.ndarray | None:
    """Return the heights of the surface above the axis at `STATIONS` [m]; None if it cannot be seen.

    The parameters are those of `surface_angles`. Outside the bed the height is that of the shell.
    """
    if (levelled := _levelled(positions, reach, view)) is None:
        return None
    turn, along, height = levelled
    inside = np.abs(along) < chord
    if not inside.any():
        return None
    x, _, z = _turned_back(
        np.column_stack([along, np.zeros(len(along)), height + TOP_OF_GRAIN * reach])[inside], -turn
    ).T
    order = np.argsort(x)
    places = np.array(STATIONS) * view.radius
    wall = np.sqrt(view.radius**2 - places**2)
    return np.asarray(np.clip(np.interp(places, x[order], z[order]), -wall, wall))


def level_of(filling: float, radius: float) -> float:
    """Return the height of a level bed that fills a part of a drum, above its lowest line [m]."""
    if filling > 0.5:
        return 2 * radius - level_of(1 - filling, radius)
    angles = np.linspace(0.0, math.pi, 10_001)
    angle = np.interp(filling, (angles - np.sin(angles)) / (2 * math.pi), angles)
    return float(radius * (1 - np.cos(angle / 2)))


def _levelled(
    positions: np.ndarray, reach: float, view: DrumView | None
) -> tuple[float, np.ndarray, np.ndarray] | None:
    """Return the angle of a bed's centre of mass, and the profile of the bed turned back by it.

    Its surface is then nearly level, so that steep parts are seen as well as flat ones.
    """
    if not len(positions):
        return None
    center = positions.mean(axis=0)
    turn = math.atan2(-center[0], -center[2])
    level = _turned_back(positions if view is None else view.seen(positions, reach), turn)
    return (turn, *profile(level, reach)) if len(level) else None


def _turned_back(positions: np.ndarray, turn: float) -> np.ndarray:
    x, y, z = positions.T
    cosine, sine = math.cos(turn), math.sin(turn)
    return np.column_stack([x * cosine - z * sine, y, x * sine + z * cosine])
