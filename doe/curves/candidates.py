"""Settings of a list, and how well curves of single runs agree with each of them.

What a run differs by from an emulator has long tails: the noise is never known exactly where it varies. So
the scores of all its curves together are Student's, with the freedom and the correlation that the runs of the
emulators themselves show, each predicted from the others (K. L. Lange, R. J. A. Little and J. M. G. Taylor,
J. Am. Stat. Assoc. 84 (1989) 881-896).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import optimize, stats
from scipy.special import gammaln, logsumexp

from doe.curves.curve_emulator import CurveEmulator

Array = NDArray[np.float64]

FREEDOMS = (2.1, 200.0)
"""Degrees of freedom of the tails that a fit may find."""


@dataclass(frozen=True, eq=False)
class Candidates:
    """Settings of a list, as emulators of several conditions predict their curves."""

    emulators: Mapping[str, CurveEmulator]
    """Emulators by condition, made of the same runs in the same order."""
    settings: Array
    """Coded settings, shape (candidates, settings)."""

    @cached_property
    def expected(self) -> dict[str, tuple[Array, Array]]:
        """Scores and the variances of one run about them, by condition, both (candidates, components)."""
        found = {}
        for name, emulator in self.emulators.items():
            means, variances = emulator.scores(self.settings)
            found[name] = means, variances + emulator.noise(self.settings)
        return found

    def squares(self, curves: Mapping[str, Array]) -> Array:
        """Return generalised least squares of curves by condition, (candidates,)."""
        correlation, _ = self._tails(tuple(curves))
        return _squares(
            np.hstack([self._apart(name, curve)[0] for name, curve in curves.items()]), correlation
        )

    def log_likelihood(self, curves: Mapping[str, Array]) -> Array:
        """Return the log-likelihoods of the candidates but for a constant, (candidates,)."""
        _, freedom = self._tails(tuple(curves))
        logs = sum(self._apart(name, curve)[1] for name, curve in curves.items())
        return np.asarray(_log_density(self.squares(curves), self._count(curves), freedom) - logs)

    def weights(self, curves: Mapping[str, Array]) -> Array:
        """Return the probabilities of the candidates, all as likely before, (candidates,)."""
        logs = self.log_likelihood(curves)
        return np.asarray(np.exp(logs - logsumexp(logs)))

    def p_values(self, curves: Mapping[str, Array]) -> Array:
        """Return the probability that a run of a candidate differs from it by more, (candidates,)."""
        _, freedom = self._tails(tuple(curves))
        ratio = self.squares(curves) / self._count(curves) * freedom / (freedom - 2.0)
        return np.asarray(stats.f.sf(ratio, self._count(curves), freedom))

    def curve(self, condition: str, weights: Array) -> Array:
        """Return the expected curve of a condition, weighted over the candidates, (places,)."""
        emulator = self.emulators[condition]
        return np.asarray(emulator.mean + weights @ self.expected[condition][0] @ emulator.components)

    def _count(self, conditions: Mapping[str, Array]) -> int:
        return sum(len(self.emulators[name].components) for name in conditions)

    def _apart(self, name: str, curve: Array) -> tuple[Array, Array]:
        """Return scores less the expected ones over their errors, and the sum of the errors' logarithms."""
        emulator, (means, variances) = self.emulators[name], self.expected[name]
        apart = (curve - emulator.mean) @ emulator.components.T - means
        return apart / np.sqrt(variances), 0.5 * np.log(variances).sum(axis=1)

    def _tails(self, conditions: tuple[str, ...]) -> tuple[Array, float]:
        """Return the correlation of the scores of some conditions, and the freedom of their tails."""
        if conditions not in self._known:
            left_out = np.hstack([self.emulators[name].standard for name in conditions])
            correlation = np.atleast_2d(np.corrcoef(left_out.T))
            squares, count = _squares(left_out, correlation), left_out.shape[1]
            found = optimize.minimize_scalar(
                lambda freedom: -_log_density(squares, count, freedom).sum(), bounds=FREEDOMS
            )
            self._known[conditions] = correlation, float(found.x)
        return self._known[conditions]

    @cached_property
    def _known(self) -> dict[tuple[str, ...], tuple[Array, float]]:
        return {}


def _squares(apart: Array, correlation: Array) -> Array:
    return np.asarray((apart @ np.linalg.inv(correlation) * apart).sum(axis=1))


def _log_density(squares: Array, count: int, freedom: float) -> Array:
    """Return the logarithm of Student's density of variance 1 in some dimensions, at squared distances."""
    ends = gammaln(0.5 * (freedom + count)) - gammaln(0.5 * freedom) - 0.5 * count * np.log(freedom - 2.0)
    return np.asarray(ends - 0.5 * (freedom + count) * np.log1p(squares / (freedom - 2.0)))
