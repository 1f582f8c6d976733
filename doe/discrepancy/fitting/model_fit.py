"""Fits of models to means: bounded least squares, many at once, with the errors of the parameters."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import cholesky, solve_triangular

from doe.discrepancy.emulation.bank import sobol_points
from doe.discrepancy.fitting.fitted_model import STEP, Model, Stack

ITERATIONS = 40
SCOUTING = 6
"""Steps after which only the best starts continue."""
QUICK_SIZES = (0.3, 0.8)
"""Coded sizes from which a quick fit starts."""
FINALISTS = 3
"""Number of starts that continue, each with its own weights."""
DEEPEST = 10.0
"""Largest fall of the score in a descent: others than the best start are descended only within it."""
APART = 0.1
"""Distance of starts in coded units below which they are the same."""
DESCENTS = 12
"""Largest number of steps down the score."""
ARRIVED = 0.01
"""Fall of the score in the last step; its noise is a hundred times as large."""
TURNS = (30.0, 60.0, 90.0, -30.0, -60.0, -90.0)
"""Azimuths about one of the two sides that are tried [deg]: between two, a cosine changes by at most half."""
TURNED = 6.63
"""Fall of the score by one more parameter that chance reaches in one case of a hundred."""
CONVERGED = 1e-4
"""Longest last step of a converged fit, in coded units."""
AT_BOUND = 1e-3
"""Distance from an end of a range, in coded units, below which a parameter is at that end."""
LEAST_INFORMATION = 1e-9
"""Information on a parameter that no mean depends on; its range has a million times as much."""


@dataclass(frozen=True)
class Interval:
    """Estimate with the ends of its 90 % interval."""

    low: float
    value: float
    high: float


@dataclass(frozen=True, eq=False)
class Fitted:
    """Model at its optimum."""

    stack: Stack
    x: np.ndarray
    """Coded parameters, (parameters,)."""
    covariance: np.ndarray
    """Covariance of measured less predicted means, which gave the weights, (means, means)."""
    whitening: np.ndarray
    """Matrix W with W' W the inverse of the covariance, (means, means)."""
    q: float
    """Sum of squares of the whitened residuals."""
    score: float
    """q plus the logarithm of the determinant: minus twice the log-likelihood, but for a constant."""

    @cached_property
    def slopes(self) -> np.ndarray:
        """Whitened derivatives by the parameters, (means, parameters)."""
        return np.asarray(self.whitening @ self.stack.jacobian(self.x[None])[0])

    @cached_property
    def spread(self) -> np.ndarray:
        """Covariance of the parameters for known slopes and shift, with the ranges as prior."""
        information = self.slopes.T @ self.slopes + np.diag(model_width(self.model) ** -2)
        return np.asarray(np.linalg.inv(information))

    @cached_property
    def whole_spread(self) -> np.ndarray:
        """Covariance of the parameters, (parameters, parameters).

        Noise in the slopes makes them seem too large, and a direction without more information than noise is
        as open as its range. An error of the model's shift moves the optimum as far as the corrections leave
        it.
        """
        precision = self.whitening.T @ self.whitening
        seeming, feigned = self.slopes.T @ self.slopes, self.stack.feigned_information(self.x, precision)
        known = np.linalg.inv(_left(seeming, feigned) + np.diag(model_width(self.model) ** -2))
        if self.model.shift is None:
            return np.asarray(known)
        moved = self.spread @ self.slopes.T @ self.whitening @ self.stack.shift_slopes(self.x)
        return np.asarray(known + moved @ self.model.shift.spread @ moved.T)

    @property
    def model(self) -> Model:
        """The model that was fitted."""
        return self.stack.model

    @property
    def mechanisms(self) -> tuple[str, ...]:
        """Mechanisms of the model."""
        return self.model.mechanisms

    @property
    def coded_sizes(self) -> np.ndarray:
        """Coded sizes of the mechanisms."""
        return self.x[len(self.x) - len(self.mechanisms) :]

    @property
    def ratios(self) -> np.ndarray:
        """Coded sizes over the standard errors that absent mechanisms would have."""
        return np.asarray(self.coded_sizes / self.null_size_errors)

    @property
    def null_size_errors(self) -> np.ndarray:
        """Standard errors of the coded sizes of absent mechanisms.

        Noise in the slopes of an effect moves nothing where the effect is zero.
        """
        shift, start = self.model.shift, len(self.x) - len(self.mechanisms)
        variances = np.diag(self.spread if shift is None else self.spread + shift.spread)
        return np.sqrt(variances[start:])

    @property
    def coded_size_errors(self) -> np.ndarray:
        """Standard errors of the coded sizes."""
        return self.errors[len(self.x) - len(self.mechanisms) :]

    @property
    def errors(self) -> np.ndarray:
        """Standard errors of the coded parameters, (parameters,)."""
        return np.sqrt(np.diag(self.whole_spread))

    @property
    def promise(self) -> float:
        """Score with certain predictions and the same q."""
        certain = np.linalg.slogdet(self.stack.noise(self.x))[1]
        return self.score - float(np.linalg.slogdet(self.covariance)[1] - certain)

    @property
    def freedom(self) -> int:
        """Degrees of freedom of q."""
        return max(len(self.covariance) - len(self.x), 0)

    @property
    def residuals(self) -> np.ndarray:
        """Whitened residuals, (means,)."""
        return self.whitening @ (self.stack.target - self.stack.predict(self.x[None])[0])

    @property
    def sensitivities(self) -> np.ndarray:
        """Whitened derivatives by the parameters inside their range, (means, free)."""
        free = (self.x > self.model.lower + AT_BOUND) & (self.x < self.model.upper - AT_BOUND)
        return self.slopes[:, free]


def minimise(
    stack: Stack,
    whitening: np.ndarray,
    target: np.ndarray,
    starts: np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
    iterations: int = ITERATIONS,
) -> tuple[np.ndarray, np.ndarray]:
    """Minimise least squares within bounds from many starts (n, parameters) at once; return x and q.

    The method is that of Levenberg and Marquardt, with active bounds frozen. Weights, target and bounds are
    those of all starts, or of each; equal bounds fix a parameter.
    """
    x = np.clip(starts, lower, upper)
    damping = np.full(len(x), 1e-2)
    residual = _whitened(whitening, target - stack.predict(x))
    q = (residual**2).sum(axis=1)
    for _ in range(iterations):
        slopes = whitening @ stack.jacobian(x)
        descent = np.einsum("nik,ni->nk", slopes, residual)
        frozen = ((x <= lower) & (descent < 0.0)) | ((x >= upper) & (descent > 0.0))
        slopes = np.where(frozen[:, None, :], 0.0, slopes)
        normal = np.einsum("nik,nil->nkl", slopes, slopes)
        diagonal = np.einsum("nkk->nk", normal)
        scale = np.where(frozen, 1.0, diagonal * damping[:, None] + 1e-9)
        step = np.linalg.solve(
            normal + scale[:, :, None] * np.eye(x.shape[1]), np.where(frozen, 0.0, descent)[:, :, None]
        )
        proposed = np.clip(x + step[:, :, 0], lower, upper)
        trial = _whitened(whitening, target - stack.predict(proposed))
        better = (trial**2).sum(axis=1) <= q
        moved = np.abs(proposed - x).max(axis=1)
        x = np.where(better[:, None], proposed, x)
        residual = np.where(better[:, None], trial, residual)
        q = np.where(better, (trial**2).sum(axis=1), q)
        damping = np.where(better, damping / 5.0, damping * 5.0).clip(1e-9, 1e9)
        if (moved < CONVERGED).all():
            break
    return x, q


def _whitened(whitening: np.ndarray, residuals: np.ndarray) -> np.ndarray:
    """Whiten residuals (n, means), all alike or each by its own matrix, (n, means)."""
    return np.asarray((whitening @ residuals[:, :, None])[:, :, 0])


def fit(stack: Stack, starts: np.ndarray | None = None, count: int = 8) -> Fitted:
    """Calibrate a model: find the least score from several starts.

    Given starts (n, parameters) are coded and additional to ``count`` Sobol points. The weights change with
    the parameters, so sums of squares of different places do not compare, and under the weights of one place
    every other is behind. A direction is searched at azimuth 0 and from behind, and at others where that
    lowers the score by `TURNED`.
    """
    lower, upper = stack.model.lower, stack.model.upper
    tried = [stack.model.start[None], lower + sobol_points(count, len(lower), 0) * (upper - lower)]
    x = np.concatenate(tried if starts is None else [np.atleast_2d(starts), *tried])
    if not stack.model.is_directed:
        return _least([stack], x)
    best = _least([_facing(stack, heading) for heading in (0.0, 180.0)], x)
    return _turned(best)


def _facing(stack: Stack, heading: float) -> Stack:
    return Stack(replace(stack.model, heading=heading % 360.0), stack.blocks)


def _least(stacks: Sequence[Stack], starts: np.ndarray) -> Fitted:
    """Find the least score of several models of the same parameters, from the same starts."""
    scouted = []
    for stack in stacks:
        lower, upper = stack.model.lower, stack.model.upper
        first = whiten(stack.covariance(starts[0]))
        near, _ = minimise(stack, first, stack.target, starts, lower, upper, SCOUTING)
        # also where they start: the weights of one place lead away from others
        scouted += [weigh(stack, each) for each in (*near, *starts)]
    seen = _best_apart(scouted)
    for stack in stacks:
        own = [each for each in seen if each.stack is stack]
        if own:
            lower, upper = stack.model.lower, stack.model.upper
            weights, x = np.array([each.whitening for each in own]), np.array([each.x for each in own])
            x, _ = minimise(stack, weights, stack.target, x, lower, upper)
            seen = [*seen, *(weigh(stack, each) for each in x)]
    leader, *others = _best_apart(seen)
    best = _descend(leader)
    near_it = [each for each in others if each.score < best.score + DEEPEST]
    return min([best, *map(_descend, near_it)], key=lambda each: each.score)


def quick_q(stack: Stack, x: np.ndarray) -> float:
    """Return roughly the least q of a model, in a few steps from a fitted smaller one.

    The sizes start small or large; the weights stay those of the start.
    """
    starts = np.array([np.append(x, np.full(len(stack.model.mechanisms), size)) for size in QUICK_SIZES])
    facing = [_facing(stack, each) for each in (0.0, 180.0)] if stack.model.is_directed else [stack]
    lower, upper = stack.model.lower, stack.model.upper
    whitening = whiten(stack.covariance(starts[0]))
    return min(
        float(minimise(one, whitening, one.target, starts, lower, upper, SCOUTING)[1].min()) for one in facing
    )


def _turned(best: Fitted) -> Fitted:
    """Turn a directed model to another azimuth where that is better by more than chance."""
    stacks = [_facing(best.stack, best.model.heading + turn) for turn in TURNS]
    lower, upper = best.model.lower, best.model.upper
    steps = [
        minimise(each, best.whitening, each.target, best.x[None], lower, upper, SCOUTING) for each in stacks
    ]
    turn = int(np.argmin([q[0] for _, q in steps]))
    x, q = steps[turn]
    if q[0] >= best.q:
        return best
    other = _descend(weigh(stacks[turn], x[0]))
    return other if other.score < best.score - TURNED else best


def _best_apart(tried: Sequence[Fitted]) -> list[Fitted]:
    """Return the best fits that are not near a better one."""
    chosen: list[Fitted] = []
    for one in sorted(tried, key=lambda each: each.score):
        if all(one.stack is not each.stack or np.abs(one.x - each.x).max() > APART for each in chosen):
            chosen.append(one)
    return chosen[:FINALISTS]


def _descend(fitted: Fitted) -> Fitted:
    """Go down the score by Fisher's scoring within bounds, with the covariance of each point."""
    stack, lower, upper = fitted.stack, fitted.model.lower, fitted.model.upper
    for _ in range(DESCENTS):
        slope, information = _score_slope(fitted)
        free = ~(((fitted.x <= lower) & (slope > 0.0)) | ((fitted.x >= upper) & (slope < 0.0)))
        step = np.zeros(len(slope))
        step[free] = -np.linalg.solve(information[np.ix_(free, free)], slope[free])
        for share in (1.0, 0.3, 0.1, 0.03):
            tried = weigh(stack, np.clip(fitted.x + share * step, lower, upper))
            if tried.score < fitted.score:
                break
        fall = fitted.score - tried.score
        fitted = tried if fall > 0.0 else fitted
        if fall < ARRIVED:
            break
    return fitted


def _score_slope(fitted: Fitted) -> tuple[np.ndarray, np.ndarray]:
    """Return derivatives of half the score by the parameters, and their information, (p,), (p, p).

    A normal law of mean m(x) and covariance C(x) has -m' C^-1 r + tr(C^-1 C') / 2 - r' C^-1 C' C^-1 r / 2,
    and m' C^-1 m' + tr(C^-1 C' C^-1 C') / 2.
    """
    stack, whitening, residual, slopes = fitted.stack, fitted.whitening, fitted.residuals, fitted.slopes
    turns = []
    for number in range(len(fitted.x)):
        inward = -1.0 if fitted.x[number] > fitted.model.start[number] else 1.0
        moved = fitted.x + inward * STEP * (np.arange(len(fitted.x)) == number)
        change = (stack.covariance(moved) - fitted.covariance) / (inward * STEP)
        turns.append(whitening @ change @ whitening.T)
    turned = np.array(turns)
    slope = -slopes.T @ residual + 0.5 * np.einsum("pii->p", turned) - 0.5 * turned @ residual @ residual
    information = slopes.T @ slopes + 0.5 * np.einsum("pij,qij->pq", turned, turned)
    return slope, information + np.diag(model_width(stack.model) ** -2)


def weigh(stack: Stack, x: np.ndarray) -> Fitted:
    """Weigh a model at given coded parameters by its covariance there."""
    covariance = stack.covariance(x)
    whitening = whiten(covariance)
    residual = whitening @ (stack.target - stack.predict(x[None])[0])
    q = float(residual @ residual)
    score = q - 2.0 * float(np.log(np.diag(whitening)).sum())
    return Fitted(stack, x, covariance, whitening, q, score)


def _left(seeming: np.ndarray, feigned: np.ndarray) -> np.ndarray:
    """Subtract spurious information from the apparent one; no direction falls below zero."""
    triangle = np.linalg.cholesky(seeming + LEAST_INFORMATION * np.eye(len(seeming)))
    inverse = np.linalg.inv(triangle)
    shares, directions = np.linalg.eigh(inverse @ feigned @ inverse.T)
    whole = triangle @ directions
    return np.asarray((whole * np.maximum(1.0 - shares, 0.0)) @ whole.T)


def model_width(model: Model) -> np.ndarray:
    """Return the widths of the coded ranges, (parameters,)."""
    return np.asarray(model.upper - model.lower)


def whiten(covariance: np.ndarray) -> np.ndarray:
    """Return the lower triangle W with W' W the inverse of a covariance."""
    triangle = cholesky(covariance, lower=True)
    return np.asarray(solve_triangular(triangle, np.eye(len(triangle)), lower=True))
