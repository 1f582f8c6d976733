"""Fits of models to means: bounded least squares, many at once, and what they say of the parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import cholesky, solve_triangular

from doe.discrepancy.emulation.bank import sobol_points
from doe.discrepancy.fitting.fitted_model import STEP, Model, Stack

ITERATIONS = 40
SCOUTING = 6
"""Steps after which only the best starts go on."""
GLIMPSED = (0.3, 0.8)
"""Coded sizes that a first look starts from."""
FINALISTS = 3
"""Starts that go on, each with the weights of where it is."""
DEEPEST = 10.0
"""Fall of the score that a descent may bring: the best goes down to the least, others if they may pass it."""
APART = 0.1
"""Starts that have come nearer to each other than this, in coded units, are one."""
DESCENTS = 12
"""Most steps down the score."""
ARRIVED = 0.01
"""Fall of the score that a last step brings: its noise is a hundred times as large."""
TURNS = (30.0, 60.0, 90.0, -30.0, -60.0, -90.0)
"""Azimuths about one of the two sides that are tried [deg]: between two, a cosine changes by half at most."""
TURNED = 6.63
"""Fall of the score that chance brings by one more parameter in one case of a hundred."""
CONVERGED = 1e-4
"""Longest step of a fit that has arrived, in coded units."""
AT_BOUND = 1e-3
"""A parameter so near an end of its range, in coded units, is at that end."""
LEAST_INFORMATION = 1e-9
"""Of a parameter that no mean depends on; its range is worth a millionfold."""


@dataclass(frozen=True)
class Interval:
    """An estimate with the ends of its 90 % interval."""

    low: float
    value: float
    high: float


@dataclass(frozen=True, eq=False)
class Fitted:
    """A model at its optimum."""

    stack: Stack
    x: np.ndarray
    """Coded, (parameters,)."""
    covariance: np.ndarray
    """Of measured less predicted means, which the fit was weighted with, (means, means)."""
    whitening: np.ndarray
    """W with W' W its inverse, (means, means)."""
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
        """Covariance of the parameters if slopes and the model's shift were known, (parameters, parameters).

        The ranges are what is known of a parameter that the data say nothing of.
        """
        information = self.slopes.T @ self.slopes + np.diag(model_width(self.model) ** -2)
        return np.asarray(np.linalg.inv(information))

    @cached_property
    def whole_spread(self) -> np.ndarray:
        """Covariance of the parameters, (parameters, parameters).

        Slopes are less than they seem by the noise in them, and a direction that they say no more of than
        noise would is as open as its range. An error of the model's shift moves the optimum by what the
        corrections leave of it.
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
        """Coded sizes over the standard errors that they would have if there were none."""
        return np.asarray(self.coded_sizes / self.null_size_errors)

    @property
    def null_size_errors(self) -> np.ndarray:
        """Standard errors that coded sizes would have if there were none.

        Noise in the slopes of an effect moves nothing where the effect is nothing.
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
        """Score that it would have if all that is uncertain of its predictions were known, and q as it is."""
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
        """Whitened derivatives by the parameters that are not at an end of their range, (means, free)."""
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
    """Least squares within bounds from many starts at once (Levenberg and Marquardt, active bounds frozen).

    Parameters
    ----------
    stack : Stack
    whitening : (means, means) or (n, means, means) array
    target : (means,) or (n, means) array
        Of all, or of each.
    starts : (n, parameters) array
    lower, upper : (parameters,) or (n, parameters) array
        Equal ends fix a parameter.
    iterations : int
        Most steps.

    Returns
    -------
    x : (n, parameters) array
    q : (n,) array
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
    """Whiten residuals (n, means), all alike or each by its own, (n, means)."""
    return np.asarray((whitening @ residuals[:, :, None])[:, :, 0])


def fit(stack: Stack, starts: np.ndarray | None = None, count: int = 8) -> Fitted:
    """Calibrate a model: the least score, from several starts.

    The weights change with the parameters, so that sums of squares of different places do not compare, and
    under the weights of one place every other is behind. A direction is looked for at azimuth 0 and from
    behind, and at others where that lowers the score by `TURNED`.

    Parameters
    ----------
    stack : Stack
    starts : (n, parameters) array, optional
        Coded parameters to start from as well.
    count : int
        Sobol points to start from.
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


def glimpse(stack: Stack, x: np.ndarray) -> float:
    """Find about the least q of a model in a few steps from a fitted smaller one, its sizes small or large.

    The weights stay those of where it starts.
    """
    starts = np.array([np.append(x, np.full(len(stack.model.mechanisms), size)) for size in GLIMPSED])
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
    """Pick those of the best scores that are not near a better one."""
    chosen: list[Fitted] = []
    for one in sorted(tried, key=lambda each: each.score):
        if all(one.stack is not each.stack or np.abs(one.x - each.x).max() > APART for each in chosen):
            chosen.append(one)
    return chosen[:FINALISTS]


def _descend(fitted: Fitted) -> Fitted:
    """Go down the score by Fisher's scoring within bounds, the covariance changing with the point."""
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
    """Derivatives of half the score by the parameters, and their information, (p,), (p, p).

    Of a normal law with mean m(x) and covariance C(x): -m' C^-1 r + tr(C^-1 C') / 2 - r' C^-1 C' C^-1 r / 2,
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
    """Take feigned information out of what seems to be there; no direction keeps less than none."""
    triangle = np.linalg.cholesky(seeming + LEAST_INFORMATION * np.eye(len(seeming)))
    inverse = np.linalg.inv(triangle)
    shares, directions = np.linalg.eigh(inverse @ feigned @ inverse.T)
    whole = triangle @ directions
    return np.asarray((whole * np.maximum(1.0 - shares, 0.0)) @ whole.T)


def model_width(model: Model) -> np.ndarray:
    """Widths of the coded ranges, (parameters,)."""
    return np.asarray(model.upper - model.lower)


def whiten(covariance: np.ndarray) -> np.ndarray:
    """Lower triangle W with W' W the inverse of a covariance."""
    triangle = cholesky(covariance, lower=True)
    return np.asarray(solve_triangular(triangle, np.eye(len(triangle)), lower=True))
