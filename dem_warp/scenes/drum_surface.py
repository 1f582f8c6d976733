"""The surface of a bed in a drum, as different pictures show it: the volume below it, and its slopes."""

import math
from typing import Literal, NamedTuple

import numpy as np

from dem_warp.scenes.surfaces import TOP_OF_GRAIN, column_tops, profile, slope

SURFACE = 0.8
"""The slope is fitted over this part of the surface's chord, clear of the drum's wall at both ends."""

FINER = 4
"""Strips that a column of the bed is cut into where the shell bounds it."""

STATIONS = (-0.8, -0.6, -0.4, -0.2, 0.0, 0.2, 0.4, 0.6, 0.8)
"""Places across a drum, over its radius, at which the height of the surface is told."""

Picture = Literal["depth", "silhouette", "end"]
"""Pictures that a surface is read from: the mean over the drum's depth, the outline against a light behind
it, and the grains that lie against the transparent end."""


class SurfaceAngles(NamedTuple):
    """Slopes of a bed at one look [deg], as the observables of `Drum` define them."""

    dynamic_angle: float
    upper_angle: float
    lower_angle: float
    mass_angle: float


class DrumView(NamedTuple):
    """A drum, and the picture that is taken of it."""

    radius: float
    length: float
    """Inner ones [m]."""
    picture: Picture = "depth"
    camera_distance: float | None = None
    """From the front end to the camera, on the axis; None: from so far that nothing narrows [m]."""

    def seen(self, positions: np.ndarray, reach: float) -> np.ndarray:
        """Grains that the picture shows, where it shows them.

        Parameters
        ----------
        positions : (n, 3) array
            Grain centres from the middle of the drum, whose axis is along y; the camera looks from -y [m].
        reach : float
            Bounding radius of a grain [m].
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
    """Half the width of a drum at a height above its lowest line [m]."""
    return math.sqrt(max(level * (2 * radius - level), 0.0))


def bed_volume(positions: np.ndarray, radius: float, length: float, reach: float) -> float:
    """Volume of a drum below the surface of a bed, whatever the shape of that [m3].

    Each column of a grain's size is filled up to half a grain above its highest centre, within the shell.

    Parameters
    ----------
    positions : (n, 3) array
        Grain centres from the middle of the drum, whose axis is along y [m].
    radius, length : float
        Inner ones of the drum [m].
    reach : float
        Bounding radius of a grain [m].
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
    """Slopes of the bed in a drum; None where a part of its surface is too short for a line.

    The bed is turned back by the angle of its centre of mass, so that its surface is nearly level and steep
    parts can be seen as well as flat ones.

    Parameters
    ----------
    positions : (n, 3) array
        Grain centres from the middle of the drum, whose axis is along y; the bed is high at -x [m].
    chord : float
        Half the length of the surface in the cross-section [m]; what a picture of the end shows has its own.
    reach : float
        Bounding radius of a grain [m].
    view : DrumView, optional
        The drum and the picture; left out: the mean over the depth.
    """
    if not len(positions):
        return None
    center = positions.mean(axis=0)
    turn = math.atan2(-center[0], -center[2])
    level = _turned_back(positions if view is None else view.seen(positions, reach), turn)
    if not len(level):
        return None
    along, height = profile(level, reach)
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
    """Heights of the surface of a bed above the axis at `STATIONS` [m]; None where it cannot be seen.

    The surface is found as by `surface_angles`, and turned back into the picture. Beside it is the shell.

    Parameters
    ----------
    positions, chord, reach, view
        As of `surface_angles`.
    """
    if not len(positions):
        return None
    center = positions.mean(axis=0)
    turn = math.atan2(-center[0], -center[2])
    level = _turned_back(view.seen(positions, reach), turn)
    if not len(level):
        return None
    along, height = profile(level, reach)
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
    """Height of a level bed that takes a part of a drum, above its lowest line [m]."""
    if filling > 0.5:
        return 2 * radius - level_of(1 - filling, radius)
    angles = np.linspace(0.0, math.pi, 10_001)
    angle = np.interp(filling, (angles - np.sin(angles)) / (2 * math.pi), angles)
    return float(radius * (1 - np.cos(angle / 2)))


def _turned_back(positions: np.ndarray, turn: float) -> np.ndarray:
    x, y, z = positions.T
    cosine, sine = math.cos(turn), math.sin(turn)
    return np.column_stack([x * cosine - z * sine, y, x * sine + z * cosine])
