"""The experiment that distinguishes models best (Hunter and Reiner 1965; Box and Hill 1967)."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby

import numpy as np
from scipy import stats

from doe.discrepancy.contest.rivals import settling
from doe.discrepancy.contest.signatures import projector
from doe.discrepancy.fitting.fitted_model import Stack
from doe.discrepancy.fitting.measured_means import Block
from doe.discrepancy.fitting.model_fit import Fitted, weigh
from doe.discrepancy.problem.settings import Settings


@dataclass(frozen=True)
class NextExperiment:
    """Measurements that would settle the verdict best."""

    conditions: tuple[str, ...]
    separates: tuple[str, str]
    """Two models, each a mechanism's name or "base"."""
    expected_q: float
    """Expected distance of the second behind the first, if the first is right, in minus twice the
    log-likelihood of all measurements."""
    replicates: int
    """Further measurements under each of the conditions."""
    observable: str
    """The observable that differs most."""
    chance: float
    """Probability that all measurements together distinguish the models (`rivals.settling`)."""
    power: float
    """Probability from which on the experiment is expected to."""
    without: str = ""
    """Mechanism that is taken away first, and measured apart from the others; empty: the same tests again."""

    @property
    def settles(self) -> bool:
        """True if the experiment can be expected to distinguish the models."""
        return self.chance >= self.power


@dataclass(frozen=True, eq=False)
class Rival:
    """Model that may be right in place of the best one."""

    fitted: Fitted
    """Weighed on all conditions."""
    behind: float
    """Its distance behind the best (`rivals.lag`)."""
    needed: float
    """The distance from which on it is no rival (`rivals.needed`)."""
    parting: float
    """Standard deviation of their distance by the errors of the predictions (`rivals.parting`)."""


TIMES = (1, 2, 4, 8)
"""Multiples of the measured replicates that are tried: beyond them the emulator's error remains."""


def propose(first: Fitted, rivals: Sequence[Rival], replicates: int, power: float) -> NextExperiment:
    """Choose what to repeat: the fewest measurements that tell a model from its rivals with a power.

    Further ones join those of their condition: they have the same errors of instruments and emulator.
    """
    names = first.model.emulator.space.conditions
    return _fewest(names, replicates, partial(_step, first, rivals, power=power))


def propose_without(
    base: Fitted, tied: Sequence[Fitted], replicates: int, settings: Settings
) -> NextExperiment | None:
    """Choose what to measure without one of some tied mechanisms; None where nothing takes any of them away.

    If it was the one, nothing is missing then; if it was another, the alarm is heard again.
    """
    names, steps = tuple(block.condition for block in base.stack.blocks), []
    for one in tied:
        if base.model.emulator.space.mechanism(*one.mechanisms).removal:
            others = [other for other in tied if other is not one]
            steps.append(_fewest(names, replicates, partial(_without, base, one, others, settings)))
    return max(steps, key=lambda step: step.chance, default=None)


def _fewest(
    names: tuple[str, ...], replicates: int, forecast: Callable[[int, tuple[str, ...]], NextExperiment]
) -> NextExperiment:
    """Choose the fewest measurements that are expected to settle the verdict; the best, where none are.

    They are of one condition, or of every condition, as many as it has replicates, or two, four or eight
    times as many.
    """
    plans = [(times * replicates, some) for some in (*((name,) for name in names), names) for times in TIMES]
    plans.sort(key=lambda plan: plan[0] * len(plan[1]))
    for _, alike in groupby(plans, key=lambda plan: plan[0] * len(plan[1])):
        best = max((forecast(*plan) for plan in alike), key=lambda step: (step.chance, step.expected_q))
        if best.settles:
            break
    return best


def _step(
    first: Fitted, rivals: Sequence[Rival], more: int, conditions: tuple[str, ...], *, power: float
) -> NextExperiment:
    """Forecast what further measurements of some conditions give, against the rival that they tell least."""
    found = []
    for rival in rivals:
        old = rival.fitted.stack.blocks
        after, observable = _distance(first, rival.fitted, _joined(old, conditions, more), conditions)
        gain = max(after - _distance(first, rival.fitted, old, conditions)[0], 0.0)
        chance = settling(rival.behind, gain, rival.needed, rival.parting)
        pair = _title(first), _title(rival.fitted)
        step = NextExperiment(conditions, pair, rival.behind + gain, more, observable, chance, power)
        found.append(step)
    return min(found, key=lambda step: step.chance)


def _without(
    base: Fitted, one: Fitted, others: Sequence[Fitted], settings: Settings, more: int, some: tuple[str, ...]
) -> NextExperiment:
    """Forecast the alarm of measurements without a mechanism, if the least visible other one is right.

    They are calibrated by themselves. The chance is that of Q alone; the alarm has further statistics.
    """
    (name,) = one.mechanisms
    measured = [block for block in base.stack.blocks if block.condition in some]
    blocks = tuple(replace(each, share=each.share * each.replicates.max() / more) for each in measured)
    freedom = sum(len(block.columns) for block in blocks) - len(base.model.emulator.space.factors)
    limit, found = stats.chi2.isf(settings.false_alarm, max(freedom, 1)), []
    for other in others:
        q, observable = _distance(other, base, blocks, some)
        chance = float(stats.ncx2.sf(limit, freedom, max(q, 0.0))) if freedom > 1 else 0.0
        pair = (name, _title(other))
        found.append(NextExperiment(some, pair, q, more, observable, chance, settings.power, name))
    return min(found, key=lambda step: step.chance)


def _joined(blocks: tuple[Block, ...], conditions: Sequence[str], more: int) -> tuple[Block, ...]:
    """Return the means of all conditions, with further replicates of some."""
    columns = np.unique(np.concatenate([block.columns for block in blocks]))
    old = [
        replace(block, share=block.share / (1.0 + more / block.replicates.max()))
        if block.condition in conditions
        else block
        for block in blocks
    ]
    known = {block.condition for block in blocks}
    return (*old, *(Block.of_runs(name, columns, more) for name in conditions if name not in known))


def _distance(
    first: Fitted, second: Fitted, blocks: tuple[Block, ...], conditions: Sequence[str]
) -> tuple[float, str]:
    """Return Q of what the first predicts, fitted by the second (linearised), and where they differ most.

    The errors of both predictions are in their difference, and make Q larger: that part is taken off.
    """
    ahead, weighed = Stack(first.model, blocks), weigh(Stack(second.model, blocks), second.x)
    difference = ahead.predict(first.x[None])[0] - weighed.stack.predict(second.x[None])[0]
    metric = projector(weighed.sensitivities) @ weighed.whitening
    errors = ahead.open_error(first.x) + weighed.stack.open_error(second.x)
    q = np.sum((metric @ difference) ** 2) - np.sum(metric.T @ metric * errors)
    there = np.concatenate([np.full(len(block.mean), block.condition in conditions) for block in blocks])
    most = np.argmax(np.abs(difference) / np.sqrt(np.diag(weighed.covariance)) * there)
    column = np.concatenate([block.columns for block in blocks])[most]
    return float(q), second.model.emulator.observables[column]


def _title(fitted: Fitted) -> str:
    return " + ".join(fitted.mechanisms) if fitted.mechanisms else "base"
