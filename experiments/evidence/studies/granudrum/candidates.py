"""Settings of a list, and how well curves of single runs agree with each of them.

What a run differs by from an emulator has long tails: the noise is never known exactly where it varies. So
the scores of all its curves together are Student's, with the freedom and the correlation that the runs of the
emulators themselves show, each predicted from the others (K. L. Lange, R. J. A. Little and J. M. G. Taylor,
J. Am. Stat. Assoc. 84 (1989) 881-896).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy import optimize, stats
from scipy.special import gammaln, logsumexp

from doe.curves.curve_emulator import CurveEmulator

FREEDOMS = (2.1, 200.0)
"""Degrees of freedom of the tails that a fit may find."""


@dataclass(frozen=True, eq=False)
class Candidates:
    """Coded settings, (candidates, settings), as emulators of several conditions predict their curves."""

    emulators: Mapping[str, CurveEmulator]
    """Emulators by condition, made of the same runs in the same order."""
    settings: np.ndarray
    _known: dict[tuple[str, ...], tuple[np.ndarray, float]] = field(default_factory=dict)

    @cached_property
    def expected(self) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Scores and the variances of one run about them, by condition, both (candidates, components)."""
        found = {}
        for name, emulator in self.emulators.items():
            means, variances = emulator.scores(self.settings)
            found[name] = means, variances + emulator.noise(self.settings)
        return found

    def weights(self, curves: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return the probabilities of the candidates, all as likely before, (candidates,)."""
        squares, logs, count, freedom = self._apart(curves)
        logs = _log_density(squares, count, freedom) - logs
        return np.asarray(np.exp(logs - logsumexp(logs)))

    def p_values(self, curves: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return the probability that a run of a candidate differs from it by more, (candidates,)."""
        squares, _, count, freedom = self._apart(curves)
        return np.asarray(stats.f.sf(squares / count * freedom / (freedom - 2.0), count, freedom))

    def curve(self, condition: str, weights: np.ndarray) -> np.ndarray:
        """Return the expected curve of a condition, weighted over the candidates, (places,)."""
        emulator = self.emulators[condition]
        return np.asarray(emulator.mean + weights @ self.expected[condition][0] @ emulator.components)

    def _apart(self, curves: Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray, int, float]:
        """Return generalised least squares, sums of the errors' logarithms, scores, and freedom."""
        apart, logs = [], np.zeros(len(self.settings))
        for name, curve in curves.items():
            emulator, (means, variances) = self.emulators[name], self.expected[name]
            apart.append(((curve - emulator.mean) @ emulator.components.T - means) / np.sqrt(variances))
            logs += 0.5 * np.log(variances).sum(axis=1)
        correlation, freedom = self._tails(tuple(curves))
        return _squares(np.hstack(apart), correlation), logs, len(correlation), freedom

    def _tails(self, conditions: tuple[str, ...]) -> tuple[np.ndarray, float]:
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


def _squares(apart: np.ndarray, correlation: np.ndarray) -> np.ndarray:
    return np.asarray((apart @ np.linalg.inv(correlation) * apart).sum(axis=1))


def _log_density(squares: np.ndarray, count: int, freedom: float) -> np.ndarray:
    """Return the logarithm of Student's density of variance 1 in some dimensions, at squared distances."""
    ends = gammaln(0.5 * (freedom + count)) - gammaln(0.5 * freedom) - 0.5 * count * np.log(freedom - 2.0)
    return np.asarray(ends - 0.5 * (freedom + count) * np.log1p(squares / (freedom - 2.0)))
