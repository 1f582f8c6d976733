"""Profiles with their covariance, as numbers that are independent of one another.

Generalised least squares is ordinary least squares in the directions in which the data scatter independently.
Each direction is a response of its own, with mean and spread, so ``joint_fit`` applies to profiles as well.
The canonical directions are those in which the settings move the profiles most, over their scatter: as many
of them as there are settings hold all that generalised least squares takes from a profile that is linear in
the settings (H. Hotelling, Biometrika 28 (1936) 321-377).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from doe.arguments import checked_list, real_array
from doe.errors import RuleError
from doe.numerics.shrunk_covariance import shrunk_covariance
from doe.samples.sample import Sample

LEAST_PROFILES = 3
"""Least number of profiles that shows a scatter."""

LEAST_VIEWED = 2
"""Least number of profiles of several views that shows the scatter of views."""

LEAST_SPREAD = 1e-3
"""Least standard deviation of a direction, over that of the widest: rounding makes no datum exact."""


@dataclass(frozen=True, eq=False)
class Mode:
    """A direction in which profiles scatter independently of the other directions."""

    weights: NDArray[np.float64]
    """Weights of the places, a unit vector, shape (places,)."""
    target: Sample
    """Mean and spread of the profiles along it."""


@dataclass(frozen=True, eq=False)
class ProfileSample:
    """Measured profiles: heights at the same places, one profile in each row."""

    mean: NDArray[np.float64]
    """Mean height of each place, shape (places,)."""
    covariance: NDArray[np.float64]
    """Covariance of one profile, shape (places, places)."""
    n: int
    """Number of profiles."""
    shrinkage: float
    """Share of the covariance that comes from its target: the scatter of views, or equal places."""
    profiles: NDArray[np.float64] | None = None
    """Profiles themselves, shape (profiles, places); None where they are unknown."""

    @classmethod
    def of(cls, profiles: ArrayLike, views: ArrayLike | None = None) -> ProfileSample:
        """Estimate mean and covariance; the fewer the profiles, the more the covariance is shrunk.

        Parameters
        ----------
        profiles
            Heights, shape (profiles, places).
        views
            Covariance of single views of one profile (`scatter_of_views`), shape (places, places): the target
            of the shrinkage (`shrunk_covariance`). Default: equal and independent places.

        Raises
        ------
        RuleError
            Fewer than three profiles, a height that is not finite, or no scatter.
        """
        rows = np.array(profiles, dtype=np.float64)
        if rows.ndim != 2 or len(rows) < LEAST_PROFILES:
            raise RuleError("profiles", f"must be {LEAST_PROFILES} rows or more", f"shape {rows.shape}")
        if not np.isfinite(rows).all():
            row = int(np.flatnonzero(~np.isfinite(rows).all(axis=1))[0])
            raise RuleError(f"profiles[{row}]", "must be finite", rows[row].tolist())
        mean, count = rows.mean(axis=0), len(rows)
        # of deviations from their own mean; as many degrees of freedom as a standard deviation has
        away = (rows - mean) * np.sqrt(count / (count - 1.0))
        if not np.abs(away).max() > 0.0:
            raise RuleError("profiles", "must scatter", "the same profile each time")
        root = np.eye(rows.shape[1]) if views is None else _root(views, rows.shape[1])
        rounded = np.linalg.solve(root, away.T).T
        scale = rounded.std()
        covariance, shrinkage = shrunk_covariance(rounded / scale)
        return cls(mean, root @ covariance @ root.T * scale**2, count, shrinkage, rows)

    @property
    def modes(self) -> tuple[Mode, ...]:
        """Independent directions, that of the widest scatter first."""
        variances, directions = np.linalg.eigh(self.covariance)
        spreads = np.sqrt(np.maximum(variances, LEAST_SPREAD**2 * variances[-1]))
        found = []
        for spread, direction in zip(spreads[::-1], directions.T[::-1], strict=True):
            # a direction has two ends: the one that is up, mostly
            weights = direction * (1.0 if direction.sum() >= 0.0 else -1.0)
            found.append(Mode(weights, Sample(float(weights @ self.mean), float(spread), self.n)))
        return tuple(found)

    def canonical(self, slopes: ArrayLike, count: int) -> tuple[Mode, ...]:
        """Return independent directions in which settings move profiles most, over their scatter.

        Directions that were chosen for their small scatter look quieter than they are. So each known
        profile's deviation is taken along the direction that the other profiles choose.

        Parameters
        ----------
        slopes
            Change of each height with each setting, all settings in like units, shape (places, settings).
        count
            Largest number of directions; there are no more than settings, or places.

        Raises
        ------
        RuleError
            Slopes that are not finite, have no row for each place, or are all zero.
        """
        changes = np.array(slopes, dtype=np.float64)
        if changes.ndim != 2 or len(changes) != len(self.mean) or not np.isfinite(changes).all():
            rule = f"must be finite, with a row for each of {len(self.mean)} places"
            raise RuleError("slopes", rule, f"shape {changes.shape}")
        root = _root(self.covariance, len(self.mean))
        left, values, right = np.linalg.svd(np.linalg.solve(root, changes), full_matrices=False)
        kept = min(count, int(np.count_nonzero(values > LEAST_SPREAD * values[0])))
        if not kept:
            raise RuleError("slopes", "must move the profiles", "no change at all")
        found = []
        for direction, setting in zip(np.linalg.solve(root.T, left[:, :kept]).T, right, strict=False):
            weights = direction / np.linalg.norm(direction) * (1.0 if direction.sum() >= 0.0 else -1.0)
            spread = self._spread(weights, changes @ setting)
            found.append(Mode(weights, Sample(float(weights @ self.mean), spread, self.n)))
        return tuple(found)

    def _spread(self, weights: NDArray[np.float64], change: NDArray[np.float64]) -> float:
        """Return the standard deviation along a direction chosen for a change, cross-validated."""
        if self.profiles is None or self.n <= LEAST_PROFILES:
            return float(np.sqrt(weights @ self.covariance @ weights))
        away = []
        for number, profile in enumerate(self.profiles):
            others = ProfileSample.of(np.delete(self.profiles, number, axis=0))
            own = np.linalg.solve(others.covariance, change)
            # as strong an answer to the setting as that of all together
            own *= (weights @ change) / (own @ change)
            away.append(own @ (profile - others.mean))
        return float(np.sqrt(np.mean(np.square(away)) * (self.n - 1.0) / self.n))


def scatter_of_views(heaps: Sequence[ArrayLike]) -> NDArray[np.float64] | None:
    """Return the covariance of single views about the mean of their own profile, pooled over profiles.

    It is None if fewer than two profiles have several views, or if all views are alike.

    Parameters
    ----------
    heaps
        Views of each profile, each of shape (views, places).

    Raises
    ------
    DesignError
        Views that are not finite, or at other places than those of the first profile.
    """
    profiles = [real_array("views of a profile", views) for views in checked_list("profiles", heaps)]
    for views in profiles:
        if views.ndim != 2 or views.shape[1:] != profiles[0].shape[1:] or not np.isfinite(views).all():
            rule = "must be finite, a row for each view, at the places of the first profile"
            raise RuleError("views", rule, f"shape {views.shape}")
    several = [views for views in profiles if len(views) > 1]
    if len(several) < LEAST_VIEWED:
        return None
    # as many degrees of freedom as views less their means
    away = np.vstack([(v - v.mean(axis=0)) * np.sqrt(len(v) / (len(v) - 1.0)) for v in several])
    scale = float(away.std())
    if not scale > 0.0:
        return None
    return np.asarray(shrunk_covariance(away / scale)[0] * scale**2)


def _root(covariance: ArrayLike, places: int) -> NDArray[np.float64]:
    """Return the root R of a covariance R R', with a least scatter in every direction."""
    matrix = np.asarray(covariance, dtype=np.float64)
    if matrix.shape != (places, places) or not np.isfinite(matrix).all():
        raise RuleError("covariance", f"must be finite, of {places} places", f"shape {matrix.shape}")
    variances, directions = np.linalg.eigh(matrix)
    return np.asarray(directions * np.sqrt(np.maximum(variances, LEAST_SPREAD**2 * variances[-1])))
