"""Reading of a rotating drum in a picture, with the definitions of the simulator's drum."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np

from imaging.drum.bed_surface import BedSurface, find_surface, half_chord
from imaging.drum.circle import Circle, find_circle
from imaging.flank.outline import Doubt
from imaging.flank.roughness import SlopeError, slope_error
from imaging.geometry import FloatArray, Picture
from imaging.photo.doubts import LARGEST_ERROR, doubts_of_mean
from imaging.photo.view_settings import View
from imaging.picture_error import PictureError
from imaging.repose import confidence_interval

FITTED = 0.8
"""Part of the level surface's half chord that the slope is fitted to, as in the simulator's drum."""
STATIONS = (-0.8, -0.6, -0.4, -0.2, 0.0, 0.2, 0.4, 0.6, 0.8)
"""Places across the drum [radii] where the height is read, as in the simulator's drum."""
LARGEST_SIDE = 1000
"""Longer side of the copy that is read [pixels]."""
LEAST_SEEN, LEAST_COLUMNS = 0.6, 8
"""Least part of the fitted surface that the picture shows, and fewest columns of a half of it."""
LEAST_CIRCLE = 24
"""Least radius of a drum [pixels]."""
SHORT_ARC, LARGEST_ELLIPTICITY = 0.3, 0.03
"""Visible part of the circle below which it is doubted, and difference of the rim's half axes over their mean
above which the camera is not on the axis."""
LARGEST_STEP = 0.15
"""Step between neighbouring columns of the surface [radii]: it overhangs, or something hides it."""
LARGEST_MIXED = 0.04
"""Part of the pixels on the wrong side of the surface; 0.01 as a rule."""
ANGLES, FILLINGS, POSSIBLE = (8.0, 75.0), (0.1, 0.8), (0.03, 0.9)
"""Dynamic angles [degrees] and fillings that beds have, and fillings beyond which there is no bed."""


@dataclass(frozen=True)
class DrumReading:
    """Surface of the bed in a rotating drum, from one picture; mirrored so that it is high on the left."""

    circle: Circle
    """Inner edge of the drum [pixels of the picture]."""
    surface: BedSurface
    halves: tuple[float, float]
    """Slopes of the upper and the lower half of the middle 80 % of the surface [degrees]."""
    dynamic_angle: float
    se: float
    dof: float
    """Slope of those 80 % [degrees], its standard error and the degrees of freedom. The error has the
    roughness of the surface, and no roll of the camera, which a round drum does not show."""
    heights: tuple[float | None, ...]
    height_se: float
    """Heights above the axis at `STATIONS` [radii], None where not shown, and their standard error."""
    filling: float | None
    filling_se: float | None
    """Part of the drum's section below the surface; None where it is not shown."""
    doubts: tuple[Doubt, ...] = ()

    @property
    def mass_angle(self) -> float | None:
        """Angle between the vertical and the line from the axis to the middle of the bed [degrees]."""
        return float(np.degrees(self.surface.turn)) if self.surface.known else None

    def interval(self, level: float = 0.95) -> tuple[float, float]:
        """Return the confidence interval of the dynamic angle [degrees]."""
        return confidence_interval(self.dynamic_angle, self.se, self.dof, level)

    def points(self) -> FloatArray:
        """Return the points of the surface off the shell, column and row in the picture, shape (n, 2)."""
        surface = self.surface
        x, z = surface.points()[surface.free].T
        side = -x if self.surface.mirrored else x
        return np.column_stack([side, -z]) * self.circle.radius + [self.circle.column, self.circle.row]


def read_drum(picture: Picture, view: View | None = None, place: str = "picture") -> DrumReading:
    """Read the surface of the bed in a rotating drum.

    Parameters
    ----------
    picture : (rows, columns) or (rows, columns, 3) uint8 array
        Drum seen along its axis: one look, or an average over time. The bed may be darker or lighter than
        what is above it, or only its grains may differ. The drum may turn either way.
    view : View, optional
        Part of the picture to look at, and the drum's circle; the rest is about heaps.

    Raises
    ------
    PictureError
        When there is no drum, or no bed in it.
    """
    view = view or View()
    part = view.inside(picture.shape, place)
    top, left = part[0].start, part[1].start
    cut = picture[part]
    layered = cut[:, :, None].repeat(3, axis=2) if cut.ndim == 2 else cut
    factor = min(1.0, LARGEST_SIDE / max(cut.shape))
    small: Picture = np.asarray(cv2.resize(layered, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA))
    if view.circle is None:
        circle = find_circle(small.astype(np.float32), place)
    else:
        column, row, radius = view.circle
        circle = Circle(column - left, row - top, radius).scaled(factor)
    if circle.radius < LEAST_CIRCLE:
        raise PictureError(place, f"the drum's radius must be at least {LEAST_CIRCLE} pixels", circle.radius)
    surface = find_surface(small, circle, place)
    whole = circle.scaled(1.0 / factor)
    return _read(whole._replace(column=whole.column + left, row=whole.row + top), surface, place)


def _read(circle: Circle, surface: BedSurface, place: str) -> DrumReading:
    filling = surface.filling if surface.known else None
    if filling is not None and not POSSIBLE[0] <= filling <= POSSIBLE[1]:
        raise PictureError(place, "no drum: no bed fills a part of the circle", f"a filling of {filling:.2f}")
    chord = _visible_chord(surface) if filling is None else half_chord(filling)
    whole, upper, lower = _lines(surface, chord, place)
    height_se = float(np.hypot(circle.se / circle.radius, _roughness(surface.height[surface.free])))
    angle, se = whole.angle(surface.turn), whole.se
    return DrumReading(
        circle=circle,
        surface=surface,
        dynamic_angle=angle,
        halves=(upper.angle(surface.turn), lower.angle(surface.turn)),
        se=se,
        dof=whole.error.dof,
        filling=filling,
        filling_se=None if filling is None else float(2.0 * chord * height_se / np.pi),
        heights=_heights(surface),
        height_se=height_se,
        doubts=tuple(_doubts(circle, surface, angle, se, filling, np.abs(surface.along) < FITTED * chord)),
    )


@dataclass(frozen=True)
class _Line:
    """Least-squares line through a part of the level surface."""

    slope: float
    error: SlopeError

    def angle(self, turn: float) -> float:
        """Slope of the surface as the drum stands [degrees]."""
        return float(np.degrees(turn - np.arctan(self.slope)))

    @property
    def se(self) -> float:
        """Standard error of the angle [degrees]."""
        return float(np.degrees(np.sqrt(self.error.variance)) / (1.0 + self.slope**2))


def _lines(surface: BedSurface, chord: float, place: str) -> tuple[_Line, _Line, _Line]:
    """Fit lines to the middle of the surface, and to its upper and its lower half."""
    known, along = np.isfinite(surface.height), surface.along
    middle = np.abs(along) < FITTED * chord
    if known[middle].mean() < LEAST_SEEN:
        raise PictureError(place, f"the picture must show {LEAST_SEEN:.0%} of the bed's surface")
    parts = [part & known for part in (middle, middle & (along < 0.0), middle & (along > 0.0))]
    if min(part.sum() for part in parts) < LEAST_COLUMNS:
        raise PictureError(place, "the picture must show both halves of the bed's surface")
    whole, upper, lower = (_line(along[part], surface.height[part]) for part in parts)
    return whole, upper, lower


def _line(x: FloatArray, h: FloatArray) -> _Line:
    slope, level = np.polyfit(x, h, 1)
    return _Line(float(slope), slope_error(x, h - level - slope * x))


def _visible_chord(surface: BedSurface) -> float:
    """Return half the width between the shell of a level line at the known surface's median height."""
    return float(np.sqrt(max(1.0 - np.nanmedian(surface.height) ** 2, 0.05)))


def _heights(surface: BedSurface) -> tuple[float | None, ...]:
    """Return the heights at `STATIONS`, that of the shell outside the bed; None where they are not shown."""
    points = surface.points()[surface.free]
    points = points[np.argsort(points[:, 0])]
    # the ends at the shell, which the rim hides
    ends = points[[0, -1]] / np.linalg.norm(points[[0, -1]], axis=1, keepdims=True)
    if surface.known:
        points = np.vstack([ends[:1], points, ends[1:]])
    x, z = points.T
    places = np.array(STATIONS)
    wall = np.sqrt(1.0 - places**2)
    heights = np.clip(np.interp(places, x, z), -wall, wall)
    shown = surface.known | ((places >= x[0]) & (places <= x[-1]))
    return tuple(float(h) if seen else None for h, seen in zip(heights, shown, strict=True))


def _roughness(height: FloatArray) -> float:
    """Return the scatter of neighbouring heights, the shape taken out by second differences [radii]."""
    far = max(len(height) // 50, 1)
    second = height[2 * far :] - 2.0 * height[far:-far] + height[: -2 * far]
    return float(1.4826 * np.median(np.abs(second)) / np.sqrt(6.0))


def _doubts(
    circle: Circle,
    surface: BedSurface,
    angle: float,
    se: float,
    filling: float | None,
    middle: np.ndarray,
) -> Iterator[Doubt]:
    """Find reasons to doubt a reading."""
    if circle.arc < SHORT_ARC:
        finding = f"{circle.arc:.0%} of the circle has an edge, under {SHORT_ARC:.0%}: give the circle"
        yield Doubt("rim", finding)
    if circle.ellipticity > LARGEST_ELLIPTICITY:
        finding = f"the rim is {circle.ellipticity:.1%} from round, over {LARGEST_ELLIPTICITY:.0%}"
        yield Doubt("rim", f"{finding}: look along the axis")
    yield from doubts_of_mean(angle, se, LARGEST_ERROR, usual=ANGLES)
    if filling is not None and not FILLINGS[0] <= filling <= FILLINGS[1]:
        yield Doubt("range", f"a filling of {filling:.2f}, outside {FILLINGS[0]:g} to {FILLINGS[1]:g}")
    if not np.isfinite(surface.height[middle]).all():
        yield Doubt("border", "the picture does not show all of the bed's surface")
    elif surface.mixed > LARGEST_MIXED:
        finding = f"{surface.mixed:.0%} of the pixels are on the wrong side, over {LARGEST_MIXED:.0%}"
        yield Doubt("surface", finding)
    step = np.nanmax(np.abs(np.diff(surface.height[middle])), initial=0.0)
    if step > LARGEST_STEP:
        yield Doubt("step", f"the surface has a step of {step:.2f} radii, over {LARGEST_STEP:g}")
