"""Several differences at once, each with two errors: the level of each, and intervals of estimates.

The smallest p value of k differences is below alpha / k with probability alpha at most (Bonferroni), less
where the errors are correlated, as those of responses of the same runs are, and less where the rule of a
single difference (``doe.samples.two_errors``) is conservative. Here the level of each is the one at which all
together hold theirs. It is found by drawing with the estimated variances and correlations as the true ones (a
bootstrap of the smallest p value; Beran, J. Amer. Statist. Assoc. 83, 1988, p. 687). The draws are fixed, so
equal data give equal levels.
"""

import bisect
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import special, stats
from scipy.stats import qmc

from doe.samples.two_errors import TwoErrors, located

FloatArray = NDArray[np.float64]

DRAWS, SEED = 4096, 1
"""Size and seed of the bootstrap: a level of .05 is known to .002."""

LEVELS = 7
"""Levels at which the draws are evaluated, from `LOWEST` of the shared one to `HIGHEST` of the whole one."""

LOWEST, HIGHEST = 0.6, 1.2

LEVEL_TAILS, INTERVAL_TAILS = (0.5, 0.4), (0.35, 0.12)
"""Probabilities of a smaller estimate for the true variances behind an interval: estimates that weigh as well
as measure are doubted more than those that only measure."""

MANY = 1e6
"""Degrees of freedom that count as a known variance."""


@dataclass(frozen=True, eq=False)
class Simultaneous:
    """Differences that are tested together, each with a first error, possibly correlated, and a second one.

    Parameters
    ----------
    errors : sequence of TwoErrors
        Degrees of freedom of both errors of each difference.
    second, correlation : array, shapes (differences,) and (differences, differences)
        Estimated variances of the second errors, and correlation of the first.
    reference : array, shape (nodes, differences)
        Estimated variances of the first errors at which the level is found; it is interpolated between them.
    alpha : float
        Level of all tests together.
    """

    errors: Sequence[TwoErrors]
    second: FloatArray
    correlation: FloatArray
    reference: FloatArray
    alpha: float

    def levels(self, first: FloatArray) -> FloatArray:
        """Return the level of each test, for estimated variances of the first errors, shape (..., tests)."""
        if len(self.errors) == 1:
            return np.full(first.shape[:-1], self.alpha)
        size, level = self._curve
        return np.asarray(np.exp(np.interp(_size(first), size, level)))

    def accepted(self, difference: FloatArray, first: FloatArray) -> NDArray[np.bool_]:
        """Return True for differences (points, tests) that are not significant at the common level."""
        return np.asarray(np.abs(difference) <= self.reach(first))

    def reach(self, first: FloatArray) -> FloatArray:
        """Return the size from which on each difference is significant, shape (points, differences).

        ``first`` holds the estimated variances of the first errors, same shape.
        """
        total = first + self.second
        grid, level = self._grid, self.levels(first)
        place = np.clip(np.searchsorted(grid, level) - 1, 0, len(grid) - 2)
        weight = np.log(level / grid[place]) / np.log(grid[place + 1] / grid[place])
        rows = np.arange(len(level))
        reach = np.empty(first.shape)
        for column, rule in enumerate(self.errors):
            share = self.second[column] / total[:, column]
            table = np.array([rule.critical(share, one) for one in grid])
            critical = table[place, rows] ** (1.0 - weight) * table[place + 1, rows] ** weight
            reach[:, column] = critical * np.sqrt(total[:, column])
        return reach

    def added(self, slopes: FloatArray, direction: FloatArray, first: FloatArray) -> float:
        """Return what the true value of a linear combination of unknowns adds to the smallest chi2.

        More is added with probability alpha. The differences are slopes @ x plus their errors, chi2 weighs
        each by its estimated variance, direction @ x is fixed and all else is free. Where the slopes
        (differences, unknowns) say nothing of the direction (unknowns,), as if its variance were known.
        An estimated correlation scatters: where it makes the errors cancel, independent errors count.
        """
        return max(each._added(slopes, direction, first) for each in (self, self._independent))

    @cached_property
    def _independent(self) -> "Simultaneous":
        """The same with errors that are not correlated."""
        return replace(self, correlation=np.eye(len(self.errors)))

    def _added(self, slopes: FloatArray, direction: FloatArray, first: FloatArray) -> float:
        _, values, basis = np.linalg.svd(slopes, full_matrices=False)
        basis = basis[values > 1e-9 * values[0]]
        wanted = basis @ direction
        if not np.linalg.norm(wanted) > 1e-9:
            return float(stats.chi2.ppf(1.0 - self.alpha, 1.0))
        difference, own, other = self._drawn(first, *INTERVAL_TAILS)
        variance = np.einsum("bii->bi", own) + other
        row = _weights(slopes @ basis.T, wanted, variance)
        chi2 = (row * difference).sum(axis=1) ** 2 / (row**2 * variance).sum(axis=1)
        return float(np.quantile(chi2, 1.0 - self.alpha))

    @property
    def _grid(self) -> FloatArray:
        """Levels of one test at which the draws are evaluated."""
        return np.geomspace(LOWEST * self.alpha / len(self.errors), HIGHEST * self.alpha, LEVELS)

    @cached_property
    def _curve(self) -> tuple[FloatArray, FloatArray]:
        """Size of the first errors' variances at the reference, and the logarithm of the level there."""
        size, place = np.unique(_size(self.reference), return_index=True)
        return size, np.array([self._log_level(first) for first in self.reference[place]])

    def _log_level(self, first: FloatArray) -> float:
        difference, own, other = self._drawn(first, *LEVEL_TAILS)
        total = np.einsum("bii->bi", own) + other
        size = np.abs(difference) / np.sqrt(total)
        lower, way = located(other / total)

        def alarms(level: float) -> float:
            found = np.zeros(len(size), dtype=bool)
            for column, rule in enumerate(self.errors):
                table, place = rule.table(level), lower[:, column]
                found |= size[:, column] > table[place] + way[:, column] * np.diff(table)[place]
            return float(found.mean())

        # the share of alarms grows with the level: the two of the grid around alpha are enough
        grid = self._grid
        place = min(max(bisect.bisect_left(grid, self.alpha, key=alarms), 1), len(grid) - 1)
        around = [np.log(max(alarms(level), 1e-12)) for level in grid[place - 1 : place + 1]]
        found = float(np.interp(np.log(self.alpha), around, np.log(grid[place - 1 : place + 1])))
        if any(rule.second_df < 2.0 for rule in self.errors):
            # two measurements show too little of their spread for a higher level
            found = min(found, float(np.log(self.alpha / len(self.errors))))
        return found

    def _drawn(self, first: FloatArray, own_tail: float, other_tail: float) -> tuple[FloatArray, ...]:
        """Return drawn differences, the covariances of their first errors and the variances of the second.

        Both are as they would be estimated, shapes (draws, differences), (draws, differences, differences)
        and (draws, differences). The estimates found are smaller than those from the true variances with the
        probability of the tails.
        """
        dfs = np.array(self._dfs)
        normal, spread, other, ratio = self._standard
        own = np.sqrt(first * dfs[0] / stats.chi2.ppf(own_tail, dfs[0]))
        its = self.second * dfs[1] / stats.chi2.ppf(other_tail, dfs[1])
        return own * normal + np.sqrt(its) * other, np.outer(own, own) * spread, its * ratio

    @cached_property
    def _standard(self) -> tuple[FloatArray, ...]:
        """Draws of unit variance: first errors and their covariance, correlated; second errors and theirs."""
        normal, root, other, ratio = _draws(*self._dfs)
        factor = np.linalg.cholesky(self.correlation + 1e-9 * np.eye(len(self.errors)))
        mixed = (factor @ root) / np.sqrt(self._dfs[0])[:, None]
        return normal @ factor.T, mixed @ mixed.transpose(0, 2, 1), other, ratio

    @property
    def _dfs(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        first = tuple(float(min(rule.first_df, MANY)) for rule in self.errors)
        return first, tuple(float(min(rule.second_df, MANY)) for rule in self.errors)


def _size(first: FloatArray) -> FloatArray:
    """Return the mean logarithm of variances, at which the level is found."""
    return np.log(np.maximum(first, np.finfo(float).tiny)).mean(axis=-1)


def _weights(slopes: FloatArray, direction: FloatArray, variance: FloatArray) -> FloatArray:
    """Return the weights of differences in direction @ x, by least squares with each row of variances."""
    weighted = slopes / variance[:, :, None]
    information = np.einsum("bij,ik->bjk", weighted, slopes)
    solved = np.linalg.solve(information, np.tile(direction[:, None], (len(variance), 1, 1)))[..., 0]
    return np.asarray(np.einsum("bij,bj->bi", weighted, solved))


@cache
def _draws(first_df: tuple[float, ...], second_df: tuple[float, ...]) -> tuple[FloatArray, ...]:
    """Return standard draws: first errors, root of their Wishart matrix, second errors, chi-square / df.

    The root is Bartlett's: lower triangular, the roots of chi-squares of falling degrees of freedom on the
    diagonal and normals below it; with fewer degrees of freedom than differences its last columns are empty.
    The points are Sobol's, which determine a level better than as many random ones.
    """
    count = len(first_df)
    points = qmc.Sobol(3 * count + count * (count + 1) // 2, seed=SEED).random(DRAWS)
    normal, other, ratio, rest = np.split(points, [count, 2 * count, 3 * count], axis=1)
    ratio = np.column_stack(
        [stats.chi2.ppf(part, df) / df for part, df in zip(ratio.T, second_df, strict=True)]
    )
    root = np.zeros((DRAWS, count, count))
    below = np.tril_indices(count, -1)
    root[:, below[0], below[1]] = special.ndtri(rest[:, count:])
    for place, df in enumerate(first_df):
        left = df - place
        root[:, place, place] = np.sqrt(stats.chi2.ppf(rest[:, place], left)) if left > 0.0 else 0.0
        root[:, place, int(np.ceil(df)) :] = 0.0
    return special.ndtri(normal), root, special.ndtri(other), ratio
