"""The repose angle of a simulated heap: sphere arrays in, the mean over several azimuths out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from imaging.errors import PictureError
from imaging.flanks import FitSettings
from imaging.geometry import FloatArray, Frame, Spheres
from imaging.render import silhouette
from imaging.repose import ReposeAngle, confidence_interval, measure
from imaging.silhouette import find_outline


@dataclass(frozen=True)
class HeapAngle:
    """Repose angle of one simulated heap, from several azimuths.

    Attributes
    ----------
    mean, se : float
        Mean over the views and its standard error [degrees]: how well these views give the mean over all
        azimuths of this heap. Neighbouring views share grains, so their correlation round the heap, where it is
        positive, widens the error. What another heap of the same grains would give, only replicates tell.
    views : tuple of ReposeAngle
        One for each measured azimuth.
    azimuths : tuple of float
        Their directions [rad].
    rejections : tuple of str
        Why other azimuths could not be measured; empty as a rule.
    fit : FitSettings
    """

    mean: float
    se: float
    views: tuple[ReposeAngle, ...]
    azimuths: tuple[float, ...]
    rejections: tuple[str, ...]
    fit: FitSettings

    @property
    def dof(self) -> float:
        """Degrees of freedom of `se`."""
        return len(self.views) - 1.0

    def interval(self, level: float = 0.95) -> tuple[float, float]:
        """Confidence interval of the mean [degrees]."""
        return confidence_interval(self, level)


def heap_angle(
    centers: ArrayLike,
    radii: ArrayLike,
    azimuths: int | Sequence[float] = 8,
    fit: str | FitSettings = "flank",
    pixels: int = 800,
    backend: str = "raster",
) -> HeapAngle:
    """Measure the repose angle of a heap of spheres on the plate z = 0.

    Parameters
    ----------
    centers : (n, 3) array
        Centres of the spheres [m], z up.
    radii : (n,) array
        Their radii [m].
    azimuths : int or sequence of float
        How many directions, spread evenly over half a turn (the other half are mirror images), or the
        directions [rad].
    fit : str or FitSettings
        One of `FITS` by name, or your own.
    pixels : int
        Width of the heap in the pictures.
    backend : {"raster", "pyvista", "auto"}
        What draws the silhouettes (see `silhouette`).

    Raises
    ------
    PictureError
        When an argument is wrong, or when fewer than two azimuths show a measurable heap.
    """
    settings = FitSettings.of(fit)
    frame = Frame.around(Spheres.of(centers, radii), pixels)
    views, seen, rejections = [], [], []
    for azimuth in _directions(azimuths):
        snapshot = silhouette(centers, radii, float(azimuth), backend=backend, frame=frame)
        place = f"view at {np.degrees(azimuth):.1f} degrees"
        try:
            outline = find_outline(snapshot.image, snapshot.ground_row, snapshot.meters_per_pixel, place)
            views.append(measure(outline, settings, place))
            seen.append(float(azimuth))
        except PictureError as error:
            rejections.append(str(error))
    if len(views) < 2:
        raise PictureError("at least two views show a measurable heap", "; ".join(rejections), "heap")
    values = np.array([view.mean for view in views])
    return HeapAngle(
        mean=float(values.mean()),
        se=_circular_se(values),
        views=tuple(views),
        azimuths=tuple(seen),
        rejections=tuple(rejections),
        fit=settings,
    )


def _directions(azimuths: int | Sequence[float]) -> FloatArray:
    if isinstance(azimuths, int):
        if azimuths < 2:
            raise PictureError("there are at least two azimuths", azimuths, "azimuths")
        return np.arange(azimuths) * np.pi / azimuths
    directions = np.asarray(azimuths, dtype=np.float64)
    if directions.ndim != 1 or len(directions) < 2 or not np.isfinite(directions).all():
        raise PictureError("azimuths are at least two finite directions", azimuths, "azimuths")
    return directions


def _circular_se(values: FloatArray) -> float:
    """Standard error of the mean of views round a heap, widened by the correlation of neighbours.

    The raw estimate of that correlation is 1/n too low on average, as the mean came from the same views.
    """
    count = len(values)
    deviation = values - values.mean()
    power = float(deviation @ deviation)
    if power == 0.0:
        return 0.0
    neighbours = float(deviation @ np.roll(deviation, 1)) / power + 1.0 / count if count > 3 else 0.0
    return float(np.sqrt(power / (count * (count - 1)) * (1.0 + 2.0 * max(neighbours, 0.0))))
