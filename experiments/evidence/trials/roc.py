"""Areas under the curve of a score, with their intervals."""

from __future__ import annotations

import numpy as np
from scipy import stats

DRAWS = 2000
"""Of a bootstrap over trials."""


def auroc(positive: np.ndarray, negative: np.ndarray) -> float:
    """Probability that a positive score is the larger, ties counting half (Mann and Whitney 1947)."""
    if not len(positive) or not len(negative):
        return float("nan")
    ranks = stats.rankdata(np.concatenate([positive, negative]))
    above = ranks[: len(positive)].sum() - len(positive) * (len(positive) + 1) / 2.0
    return float(above / (len(positive) * len(negative)))


def auroc_interval(positive: np.ndarray, negative: np.ndarray) -> tuple[float, float]:
    """95 % interval of the area, by a bootstrap over the trials of each class."""
    rng = np.random.default_rng(0)
    drawn = [
        auroc(rng.choice(positive, len(positive)), rng.choice(negative, len(negative))) for _ in range(DRAWS)
    ]
    low, high = np.quantile(drawn, [0.025, 0.975])
    return float(low), float(high)


def area_text(positive: np.ndarray, negative: np.ndarray) -> str:
    """The area with its interval, as tables have it."""
    if not len(positive) or not len(negative):
        return "no trials"
    low, high = auroc_interval(positive, negative)
    return f"{auroc(positive, negative):.3f} ({low:.2f} to {high:.2f})"
