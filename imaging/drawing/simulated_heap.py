"""The repose angle of a simulated heap: the mean over several azimuths of its spheres."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from imaging.drawing.render import silhouette
from imaging.flank.fit_settings import FitSettings
from imaging.flank.outline import Outline
from imaging.geometry import FloatArray, Frame, Spheres
from imaging.photo.outline_finder import find_outline
from imaging.picture_error import PictureError
from imaging.repose import ReposeAngle, confidence_interval, measure

LEAST_DOF = 3.0
"""Least degrees of freedom: Satterthwaite's formula tends to 0 for a small difference of variances."""
LEAST_GRAINS = 20
"""Fewest grains of a heap with flanks."""


@dataclass(frozen=True)
class HeapAngle:
    """Repose angle of one simulated heap, from several azimuths."""

    mean: float
    se: float
    """Mean over the views and its standard error [degrees]: the scatter between heaps of the same grains with
    other seeds, estimated from this heap's roughness."""
    dof: float
    """Degrees of freedom of `se`."""
    views: tuple[ReposeAngle, ...]
    """One for each measured azimuth."""
    azimuths: tuple[float, ...]
    """Their directions [rad]."""
    rejections: tuple[str, ...]
    """Reasons why other azimuths could not be measured."""
    fit: FitSettings

    def __str__(self) -> str:
        return f"{self.mean:.2f} +- {self.se:.2f} degrees from {len(self.views)} sides"

    def interval(self, level: float = 0.95) -> tuple[float, float]:
        """Return the confidence interval of the mean [degrees]."""
        return confidence_interval(self.mean, self.se, self.dof, level)


@dataclass(frozen=True)
class HeapOutlines:
    """Outlines of one simulated heap from several azimuths, which may be measured with several fits."""

    azimuths: tuple[float, ...]
    """Directions of the views [rad]."""
    outlines: tuple[Outline | PictureError, ...]
    """Outline of each view, or the reason why it has none."""

    def angle(self, fit: str | FitSettings = "flank") -> HeapAngle:
        """Measure the repose angle with lines through the part of the flanks that `fit` names.

        Raises
        ------
        PictureError
            When there is no such fit, or when fewer than two azimuths show a measurable heap.
        """
        settings = FitSettings.of(fit)
        views, seen, rejections = [], [], []
        for azimuth, outline in zip(self.azimuths, self.outlines, strict=True):
            try:
                if isinstance(outline, PictureError):
                    raise outline
                views.append(measure(outline, settings, _place(azimuth)))
                seen.append(azimuth)
            except PictureError as error:
                rejections.append(str(error))
        if len(views) < 2:
            reasons = "; ".join(rejections)
            raise PictureError("heap", f"fewer than two views show a measurable heap: {reasons}")
        se, dof = _heap_error(views)
        return HeapAngle(
            mean=float(np.mean([view.mean for view in views])),
            se=se,
            dof=dof,
            views=tuple(views),
            azimuths=tuple(seen),
            rejections=tuple(rejections),
            fit=settings,
        )


def heap_outlines(
    centers: ArrayLike,
    radii: ArrayLike,
    azimuths: int | Sequence[float] = 8,
    pixels: int = 800,
    backend: str = "raster",
) -> HeapOutlines:
    """Draw a heap of spheres on the plate z = 0 and find its outlines; arguments as for `heap_angle`."""
    frame = Frame.around(Spheres.of(centers, radii), pixels)
    directions = tuple(float(azimuth) for azimuth in _directions(azimuths))
    found: list[Outline | PictureError] = []
    for azimuth in directions:
        drawn = silhouette(centers, radii, azimuth, backend=backend, frame=frame)
        try:
            found.append(find_outline(drawn.image, drawn.ground_row, drawn.meters_per_pixel, _place(azimuth)))
        except PictureError as error:
            found.append(error)
    return HeapOutlines(directions, tuple(found))


def heap_angle(
    centers: ArrayLike,
    radii: ArrayLike,
    azimuths: int | Sequence[float] = 8,
    fit: str | FitSettings = "flank",
    pixels: int = 800,
    backend: str = "raster",
    grain_count: int | None = None,
) -> HeapAngle:
    """Measure the repose angle of a heap of spheres on the plate z = 0.

    Parameters
    ----------
    centers : (n, 3) array
        Centres of the spheres [m], z up.
    radii : (n,) array
        Their radii [m].
    azimuths : int or sequence of float
        Number of directions, spread evenly over half a turn (the other half are mirror images), or the
        directions [rad].
    fit : str or FitSettings
        One of `FITS` by name, or your own.
    pixels : int
        Width of the heap in the pictures.
    backend : {"raster", "pyvista", "auto"}
        Drawer of the silhouettes (see `silhouette`).
    grain_count : int, optional
        Number of grains; default: each sphere is one.

    Raises
    ------
    PictureError
        When an argument is invalid, there are fewer grains than `LEAST_GRAINS`, or fewer than two azimuths
        show a measurable heap.
    """
    settings = FitSettings.of(fit)
    grains = np.size(radii) if grain_count is None else grain_count
    if grains < LEAST_GRAINS:
        raise PictureError("heap", f"needs at least {LEAST_GRAINS} grains", grains)
    return heap_outlines(centers, radii, azimuths, pixels, backend).angle(settings)


def _place(azimuth: float) -> str:
    return f"view at {np.degrees(azimuth):.1f} degrees"


def _directions(azimuths: int | Sequence[float]) -> FloatArray:
    if isinstance(azimuths, int):
        if azimuths < 2:
            raise PictureError("azimuths", "must be at least two", azimuths)
        return np.arange(azimuths) * np.pi / azimuths
    directions = np.asarray(azimuths, dtype=np.float64)
    if directions.ndim != 1 or len(directions) < 2 or not np.isfinite(directions).all():
        raise PictureError("azimuths", "must be at least two finite directions", azimuths)
    return directions


def _heap_error(views: Sequence[ReposeAngle]) -> tuple[float, float]:
    """Return the standard error of the mean of views of one heap, and its degrees of freedom.

    All views share the apex and much of the flanks, so that their scatter alone understates the error. The
    shared part is the fits' own variance V less the variance W between the n views; so the mean's is (V - W)
    + W / n, or W / n where that is larger. The degrees of freedom are Satterthwaite's, for a difference of
    variances.
    """
    count = len(views)
    fit = float(np.mean([view.se**2 for view in views]))
    between = float(np.var([view.mean for view in views], ddof=1))
    averaged = between * (1.0 - 1.0 / count)
    variance = fit - averaged
    if variance <= between / count:
        return float(np.sqrt(between / count)), count - 1.0
    fit_dof = float(np.mean([view.dof for view in views]))
    dof = variance**2 / (fit**2 / fit_dof + averaged**2 / (count - 1.0))
    return float(np.sqrt(variance)), max(dof, LEAST_DOF)
