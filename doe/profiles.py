"""Functions as data: profiles with their covariance, as numbers that are independent of one another.

A fit by generalised least squares is one by ordinary least squares in the directions in which the data
scatter independently. So each of these is a response of its own, with mean and spread, and what is made for
responses (``joint_fit``) is made for profiles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from doe.errors import RuleError
from doe.sample import Sample

LEAST_PROFILES = 3
"""Profiles from which a scatter can be told."""

LEAST_SPREAD = 1e-3
"""Least standard deviation of a direction, over that of the widest: rounding makes no datum exact."""


@dataclass(frozen=True, eq=False)
class Mode:
    """A direction in which profiles scatter independently of the other directions."""

    weights: NDArray[np.float64]
    """Parts of the places in it, a unit vector, shape (places,)."""
    target: Sample
    """Mean and spread of the profiles along it."""


@dataclass(frozen=True, eq=False)
class ProfileSample:
    """Measured profiles: heights at the same places, each profile a row."""

    mean: NDArray[np.float64]
    """Mean height of each place, shape (places,)."""
    covariance: NDArray[np.float64]
    """Covariance of one profile, shape (places, places)."""
    n: int
    """Number of profiles."""
    shrinkage: float
    """Part of the covariance that was taken from equal and independent places."""

    @classmethod
    def of(cls, profiles: ArrayLike) -> ProfileSample:
        """Estimate mean and covariance; the fewer the profiles, the more the covariance is shrunk.

        Parameters
        ----------
        profiles
            Heights, shape (profiles, places).

        Raises
        ------
        RuleError
            When there are fewer than three profiles, a height is not finite, or they do not scatter.

        References
        ----------
        O. Ledoit and M. Wolf, Journal of Multivariate Analysis 88 (2004) 365-411.
        """
        from sklearn.covariance import ledoit_wolf

        rows = np.array(profiles, dtype=np.float64)
        if rows.ndim != 2 or len(rows) < LEAST_PROFILES:
            raise RuleError(f"are rows, {LEAST_PROFILES} or more", f"shape {rows.shape}", "profiles")
        if not np.isfinite(rows).all():
            row = int(np.flatnonzero(~np.isfinite(rows).all(axis=1))[0])
            raise RuleError("must be finite", rows[row].tolist(), f"profiles[{row}]")
        mean, count = rows.mean(axis=0), len(rows)
        # of deviations from their own mean; as many degrees of freedom as a standard deviation has
        away = (rows - mean) * np.sqrt(count / (count - 1.0))
        if not np.abs(away).max() > 0.0:
            raise RuleError("must scatter", "the same one each time", "profiles")
        scale = away.std()
        covariance, shrinkage = ledoit_wolf(away / scale, assume_centered=True)
        return cls(mean, covariance * scale**2, count, float(shrinkage))

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
