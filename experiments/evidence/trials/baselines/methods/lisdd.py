"""Localized, identifiable, sparse discovery of a discrepancy, after its published description.

The model is fitted to a clean regime, here the conditions whose residual energy is within its limit; those
beyond it, after Benjamini and Hochberg, raise the alarm (Wang 2026, arXiv 2606.23215). On one half of the
heaps each term of the library, one mechanism or two, is fitted to all conditions but one and forecasts that
one: the term with the least error of all forecasts is selected. On the other half an F test of the base and
the base with the term confirms it; its scale is that of the residuals. What is not confirmed is unknown.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
from scipy import stats

from doe.discrepancy.fitting.fitted_model import Stack
from doe.discrepancy.fitting.measured_means import Block
from doe.discrepancy.fitting.model_fit import Fitted, fit, minimise, weigh
from experiments.evidence.trials.baselines.protocol import LEVEL, Answer, Mechanisms, Problem

ROUNDS = 3
"""Refits to the conditions that are left as clean."""


class Lisdd:
    """A term that forecasts best and that an F test confirms."""

    name = "LISDD"
    source = "Wang 2026 (arXiv 2606.23215)"
    level = f"{100 * LEVEL:g} % (Benjamini and Hochberg)"

    def __call__(self, problem: Problem) -> Answer:
        """Locate, select and confirm."""
        energies = np.sort(located(problem.stack(()), problem.blocks))
        adjusted = stats.false_discovery_control(energies)
        alarm = bool(adjusted.min() < LEVEL)
        named: Mechanisms = ()
        if alarm:
            first, second = (_half(problem, start) for start in (0, 1))
            terms = [*first.singles, *combinations(problem.emulator.space.names, 2)]
            best = min(terms, key=lambda term: forecast_error(first.fitted(term)))
            named = confirmed(second, best)
        score = -float(np.log10(max(adjusted.min(), 1e-300)))
        return Answer(score, alarm, named, unknown=alarm and not named)


def located(stack: Stack, blocks: Sequence[Block]) -> np.ndarray:
    """P values of the residual energy of each condition, the base fitted to those that are clean."""
    clean = list(range(len(blocks)))
    for _ in range(ROUNDS):
        base = fit(Stack(stack.model, tuple(blocks[number] for number in clean)), count=2)
        energies = [weigh(Stack(stack.model, (block,)), base.x).q for block in blocks]
        p = stats.chi2.sf(energies, [len(block.mean) for block in blocks])
        left = [number for number in clean if p[number] >= LEVEL]
        if not left or left == clean:
            break
        clean = left
    return np.asarray(p)


def _half(problem: Problem, start: int) -> Problem:
    """Return the same trial with every second heap of each condition."""
    measured = problem.measured
    values = {name: rows[start::2] for name, rows in measured.values.items()}
    reasons = {name: each[start::2] for name, each in measured.reasons.items()}
    halved = replace(measured, values=values, reasons=reasons)
    return Problem(problem.trial, problem.emulator, halved, problem.settings, problem.seed)


def forecast_error(fitted: Fitted) -> float:
    """Sum of squared errors of the forecasts of each condition, each over its variance."""
    error, (lower, upper) = 0.0, (fitted.model.lower, fitted.model.upper)
    for block in fitted.stack.blocks:
        rest = Stack(fitted.model, tuple(other for other in fitted.stack.blocks if other is not block))
        whitening = weigh(rest, fitted.x).whitening
        x, _ = minimise(rest, whitening, rest.target, fitted.x[None], lower, upper)
        error += weigh(Stack(fitted.model, (block,)), x[0]).q
    return error


def confirmed(problem: Problem, term: Mechanisms) -> Mechanisms:
    """Return the mechanisms of a term whose F tests confirm them; variances are known but for their scale."""
    more = problem.fitted(term)
    freedom = len(more.covariance) - len(more.x)
    without = {name: problem.fitted(tuple(each for each in term if each != name)) for name in term}
    gains = {name: max(less.q - more.q, 0.0) / (more.q / freedom) for name, less in without.items()}
    return tuple(name for name in term if stats.f.sf(gains[name], 1, freedom) < LEVEL)
