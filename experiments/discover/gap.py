"""Whether and where a calibrated model disagrees with the data beyond the noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from experiments.discover.fitting import Fitted, fit
from experiments.discover.model import Stack
from experiments.discover.ranking import Signatures, projector


@dataclass(frozen=True, eq=False)
class GapTest:
    """Two questions to the whitened residuals at once: are they too large, and do they point at a mechanism?

    Attributes
    ----------
    q, q_limit, q_p : float
        Sum of squares, the point that ``level`` of the bootstrap exceeds, and the share of it above ``q``.
    scores : (mechanisms,) array
        z of each visible signature in the residuals.
    drop, drop_limit : float
        Largest fall of Q that a positive size of one mechanism brings, and its limit.
    mechanism : str
        Of that fall; empty without a library.
    p : float
        Of the smaller of the two p values, by the same bootstrap.
    level : float
    """

    q: float
    q_limit: float
    q_p: float
    scores: np.ndarray
    drop: float
    drop_limit: float
    mechanism: str
    p: float
    level: float

    @property
    def found(self) -> bool:
        """Whether there is a gap."""
        return self.p < self.level


def find_gap(fitted: Fitted, seen: Signatures, level: float, draws: int, seed: int) -> GapTest:
    """Test a calibrated model by parametric bootstrap, each draw refitted (linearised at the optimum).

    Parameters
    ----------
    fitted : Fitted
    seen : Signatures
        Of the mechanisms that it lacks.
    level : float
        Probability of a gap where there is none.
    draws, seed : int
    """
    project = projector(fitted.sensitivities)
    noise = np.random.default_rng(seed).standard_normal((draws, len(project))) @ project
    q_drawn = (noise**2).sum(axis=1)
    drops_drawn = (np.maximum(noise @ seen.directions.T, 0.0) ** 2).max(axis=1, initial=0.0)
    scores = seen.directions @ fitted.residuals
    drops = np.maximum(scores, 0.0) ** 2
    drop = float(drops.max(initial=0.0))
    q_p, drop_p = _exceeded(q_drawn, fitted.q), _exceeded(drops_drawn, drop)
    smaller = np.minimum(_own_p(q_drawn), _own_p(drops_drawn))
    return GapTest(
        q=fitted.q,
        q_limit=float(np.quantile(q_drawn, 1.0 - level)),
        q_p=q_p,
        scores=scores,
        drop=drop,
        drop_limit=float(np.quantile(drops_drawn, 1.0 - level)),
        mechanism=seen.names[int(np.argmax(drops))] if seen.names else "",
        p=(1.0 + float(np.sum(smaller <= min(q_p, drop_p)))) / (draws + 1.0),
        level=level,
    )


def _exceeded(drawn: np.ndarray, value: float) -> float:
    return (1.0 + float(np.sum(drawn >= value))) / (len(drawn) + 1.0)


def _own_p(drawn: np.ndarray) -> np.ndarray:
    """Share of the draws that are at least as large as each."""
    return np.asarray((len(drawn) + 1.0 - stats.rankdata(drawn, method="min")) / len(drawn))


def holm(p_values: np.ndarray) -> np.ndarray:
    """P values adjusted for being many (Holm 1979), same shape (n,)."""
    order = np.argsort(p_values)
    adjusted = np.maximum.accumulate(p_values[order] * np.arange(len(order), 0, -1)).clip(max=1.0)
    out = np.empty_like(adjusted)
    out[order] = adjusted
    return out


def condition_fits(fitted: Fitted) -> list[Fitted]:
    """Calibrate a model to one training condition at a time, where that has more means than parameters."""
    enough = [block for block in fitted.stack.blocks if len(block.mean) > len(fitted.x)]
    return [fit(Stack(fitted.model, (block,)), fitted.x, count=2) for block in enough]


def drift_p(values: np.ndarray, errors: np.ndarray) -> float:
    """P value of the hypothesis that values with independent errors are one."""
    weights = errors**-2.0
    mean = np.sum(weights * values) / np.sum(weights)
    return float(stats.chi2.sf(np.sum(weights * (values - mean) ** 2), len(values) - 1))
