"""The smallest clump with volume, inertia and surface within a tolerance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dem_warp.clump_fitting import ClumpFit, fit_clump
from experiments.io.errors import InputError

if TYPE_CHECKING:
    from trimesh import Trimesh

COUNTS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64)
"""Tried numbers of spheres."""
VOLUME_KEPT = 0.01
"""Largest error of the volume with a protrusion that keeps it."""
MOST_FITS = 5
"""Most fits to find the protrusion of one number of spheres."""
LARGEST_PROTRUSION = 0.2
"""Largest protrusion over the solid's longest side."""


@dataclass(frozen=True)
class Trial:
    """Quality of a clump of a number of spheres."""

    spheres: int
    """Number of spheres."""
    protrusion_mm: float
    """Distance by which they may pass the surface [mm]."""
    volume_error: float
    """Volume over the solid's, less 1."""
    inertia_error: float
    """Largest relative error of a principal moment over the mass."""
    surface_distance_mm: float
    """Distance of the surfaces, root mean square [mm]."""
    surface_error: float
    """Distance of the surfaces over the diameter of the sphere of the solid's volume."""

    @classmethod
    def of(cls, fit: ClumpFit, protrusion: float) -> Trial:
        """Return the quality of a fit."""
        diameter = float(np.cbrt(6.0 * fit.solid_volume / np.pi))
        distance = fit.surface_distance
        return cls(
            fit.shape.sphere_count, 1e3 * protrusion, fit.volume_error, fit.inertia_error,
            1e3 * distance, distance / diameter,
        )  # fmt: skip

    @property
    def worst(self) -> float:
        """Largest of the three errors."""
        return max(abs(self.volume_error), self.inertia_error, self.surface_error)


def fit_with(solid: Trimesh, sphere_count: int, protrusion: float | None) -> tuple[ClumpFit, float]:
    """Fit a clump with a protrusion [m], or by secants the one that keeps the solid's volume; return both."""
    if protrusion is not None:
        return fit_clump(solid, sphere_count, protrusion), protrusion
    low, limit = 0.0, LARGEST_PROTRUSION * float(solid.extents.max())
    best = fit_clump(solid, sphere_count, low), low
    error = best[0].volume_error
    reach = min(-error * float(solid.volume / solid.area), limit)
    for _ in range(MOST_FITS - 1):
        if abs(best[0].volume_error) <= VOLUME_KEPT or reach <= 0.0:
            break
        fit = fit_clump(solid, sphere_count, reach)
        slope = (fit.volume_error - error) / (reach - low)
        low, error = reach, fit.volume_error
        if abs(error) < abs(best[0].volume_error):
            best = fit, reach
        if slope <= 0.0:
            break
        reach = float(np.clip(low - error / slope, 0.0, limit))
        if reach == low:
            break
    return best


def fit_within(
    solid: Trimesh, tolerance: float, protrusion: float | None, watch: Callable[[Trial], None]
) -> tuple[ClumpFit, list[Trial]]:
    """Fit more and more spheres until a clump is within a tolerance (see `Trial`); return all trials, too.

    A sphere may pass the surface by the protrusion [m]; None: the one that keeps the volume. `watch` is
    called with each trial.
    """
    trials: list[Trial] = []
    for count in COUNTS:
        fit, reach = fit_with(solid, count, protrusion)
        trials.append(Trial.of(fit, reach))
        watch(trials[-1])
        if trials[-1].worst <= tolerance:
            return fit, trials
    best = min(trials, key=lambda each: each.worst)
    problem = (
        f"too small for {COUNTS[-1]} spheres: the best clump has {best.spheres} spheres, volume "
        f"{best.volume_error:+.1%}, inertia {best.inertia_error:.1%}, surface {best.surface_error:.1%}"
    )
    raise InputError("--tolerance", problem, f"{tolerance:.1%}", "Or use --spheres.")
