"""A clump as good as asked for: the fewest spheres with volume, inertia and surface within a tolerance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from dem_warp.clump_fitting import ClumpFit, fit_clump
from experiments.io.errors import InputError

if TYPE_CHECKING:
    from trimesh import Trimesh

COUNTS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64)
"""Numbers of spheres that are tried."""
VOLUME_KEPT = 0.01
"""Error of the volume at which a protrusion is good enough."""
MOST_FITS = 5
"""Fits to find the protrusion of one number of spheres."""
LARGEST_PROTRUSION = 0.2
"""Of the solid's longest side."""


@dataclass(frozen=True)
class Trial:
    """Quality of a clump of so many spheres."""

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
    """The same over the diameter of the sphere of the solid's volume."""

    @classmethod
    def of(cls, fit: ClumpFit, protrusion: float) -> Trial:
        """Judge a fit."""
        diameter = float(np.cbrt(6.0 * fit.solid_volume / np.pi))
        distance = fit.surface_distance
        return cls(
            fit.shape.sphere_count, 1e3 * protrusion, fit.volume_error, fit.inertia_error,
            1e3 * distance, distance / diameter,
        )  # fmt: skip

    def within(self, tolerance: float) -> bool:
        """Tell that volume, inertia and surface are within a tolerance."""
        return max(abs(self.volume_error), self.inertia_error, self.surface_error) <= tolerance

    def to_dict(self) -> dict[str, Any]:
        """Values for JSON."""
        return asdict(self)


def fit_by_volume(solid: Trimesh, sphere_count: int) -> tuple[ClumpFit, float]:
    """Fit a clump with the protrusion [m] that keeps the solid's volume, and return both.

    The volume grows with the protrusion: secants lead to the root within `MOST_FITS` fits.
    """
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
    """Fit ever more spheres until a clump is within a tolerance.

    Parameters
    ----------
    solid
        Closed surface [m].
    tolerance
        Of the volume, of the moments of inertia, and of the surface over the diameter of the sphere of the
        solid's volume.
    protrusion
        Distance by which a sphere may pass the surface [m]; None: the one that keeps the volume.
    watch
        Called with each trial.

    Returns
    -------
    fit
        The first clump within the tolerance.
    trials
        Everything that was tried.

    Raises
    ------
    InputError
        When none of `COUNTS` is enough.
    """
    trials: list[Trial] = []
    for count in COUNTS:
        if protrusion is None:
            fit, reach = fit_by_volume(solid, count)
        else:
            fit, reach = fit_clump(solid, count, protrusion), protrusion
        trials.append(Trial.of(fit, reach))
        watch(trials[-1])
        if trials[-1].within(tolerance):
            return fit, trials
    best = min(trials, key=lambda each: max(abs(each.volume_error), each.inertia_error, each.surface_error))
    rule = f"needs a tolerance that a clump of at most {COUNTS[-1]} spheres keeps, for example with --spheres"
    received = (
        f"{tolerance:.1%}; the best, {best.spheres} spheres: volume {best.volume_error:+.1%}, "
        f"inertia {best.inertia_error:.1%}, surface {best.surface_error:.1%}"
    )
    raise InputError("--tolerance", rule, received)
