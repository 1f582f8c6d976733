"""The gap before and after a mechanism was added, from fresh runs at both optima."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from doe.discrepancy.fitting.fitted_model import Model, Stack
from doe.discrepancy.fitting.measured_means import Block
from doe.discrepancy.fitting.misses import Runs
from doe.discrepancy.fitting.model_fit import Fitted, Interval, whiten

COVERAGE = 0.9


@dataclass(frozen=True)
class BeforeAfter:
    """The gap of fresh direct runs without and with the mechanism, on one set of conditions."""

    held_out: bool
    degrees_of_freedom: int
    before: Interval
    """Q of the base."""
    after: Interval
    """Q with the mechanism."""
    removed: Interval
    """Removed share of the base's excess."""
    runs: int
    """Fresh runs per model and condition."""


def compare(
    base: Fitted,
    chosen: Fitted,
    base_runs: Runs,
    chosen_runs: Runs,
    blocks: Sequence[Block],
    held_out: bool,
    draws: int,
    seed: int,
) -> BeforeAfter | None:
    """Return Q of the means of fresh runs at both optima, without and with the mechanism.

    Both use the same covariance, the chosen model's: disagreement counts, not scatter. The interval is over
    the noise of the measured and the simulated means. It is None where a condition has no data or fewer than
    two runs per model.
    """
    kept = [
        b for b in blocks if all(np.sum(r.conditions == b.condition) >= 2 for r in (base_runs, chosen_runs))
    ]
    if not kept:
        return None
    counts = [int(np.sum(runs.conditions == b.condition)) for b in kept for runs in (base_runs, chosen_runs)]
    stack = Stack(chosen.model, tuple(kept))
    noise = stack.noise(chosen.x) + stack.common.T @ stack.common
    size = len(stack.target)
    normal = np.random.default_rng(seed).standard_normal((draws, size))
    qs = []
    for runs in (base_runs, chosen_runs):
        mean, error = _means(runs, kept, chosen.model, chosen.x)
        whitening = whiten(noise + error)
        drawn = np.concatenate([np.zeros((1, size)), normal]) + whitening @ (stack.target - mean)
        qs.append((drawn**2).sum(axis=1))
    before, after = qs
    freedom = _expected(chosen, tuple(kept)) if held_out else max(size - len(chosen.x), 1)
    # a noisy residual is larger by its noise on average: a second noise would count it twice
    before[1:] -= size
    after[1:] -= size
    excess_before = np.maximum(before - freedom, 1e-9)
    removed = np.clip(1.0 - np.maximum(after - freedom, 0.0) / excess_before, -1.0, 1.0)
    return BeforeAfter(
        held_out, freedom, _interval(before), _interval(after), _interval(removed), min(counts)
    )


def _expected(chosen: Fitted, blocks: tuple[Block, ...]) -> int:
    """Return the expected Q of a true model whose parameters come from other conditions."""
    stack = Stack(chosen.model, blocks)
    slopes = whiten(stack.covariance(chosen.x)) @ stack.jacobian(chosen.x[None])[0]
    return round(len(stack.target) + float(np.trace(slopes @ chosen.spread @ slopes.T)))


def _means(runs: Runs, blocks: Sequence[Block], model: Model, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return means of runs in the conditions of blocks, and the covariance of their error."""
    means, errors = [], []
    for block in blocks:
        here = runs.values[runs.conditions == block.condition][:, block.columns]
        means.append(here.mean(axis=0) * model.turn(block.condition)[block.columns])
        errors.append(model.noise(x, Block.of_runs(block.condition, block.columns, len(here))))
    return np.concatenate(means), block_diag(*errors)


def _interval(values: np.ndarray) -> Interval:
    """Return the first value, between the quantiles of the others."""
    low, high = np.quantile(values[1:], [(1.0 - COVERAGE) / 2.0, (1.0 + COVERAGE) / 2.0])
    value = float(values[0])
    return Interval(min(float(low), value), value, max(float(high), value))
