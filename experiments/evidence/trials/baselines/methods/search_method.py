"""The search of this project: with fresh runs of the simulator, or on the bank alone."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from doe.discrepancy import Discovery, Outcomes, Point, Verdict, analyse, drive
from experiments.evidence.trials.baselines.protocol import Answer, Problem
from experiments.evidence.trials.findings import misfit_of, surprise

Simulator = Callable[[Sequence[Point]], Outcomes]


@dataclass(frozen=True)
class Search:
    """`doe.discrepancy.analyse`."""

    name: str
    simulator: Simulator | None
    """Answers fresh runs; None where there is but a bank."""
    source: str = "doe.discrepancy"
    level: str = "2.5 % (bootstrap)"

    def __call__(self, problem: Problem) -> Answer:
        """Run a whole analysis."""
        fresh = self.simulator or no_runs(max(problem.emulator.columns) + 1)
        analysis = analyse(problem.measured, problem.emulator, problem.settings, problem.seed)
        return answer_of(drive(analysis, fresh))


def answer_of(found: Discovery) -> Answer:
    """Reduce a discovery to an answer.

    The alarm's score is minus the logarithm of the base's p value, bounded by the number of bootstrap draws,
    and beyond it Q over its degrees of freedom. That of *outside* is the same of the best candidate.
    """
    if found.base is None:
        return Answer(-math.inf, False)
    naming = found.verdict in (Verdict.NAMED, Verdict.TIE)
    alarm = found.verdict not in (Verdict.NONE, Verdict.NOT_IDENTIFIABLE)
    return Answer(
        score=surprise(found.base.p_value, found.base.q / max(found.base.degrees_of_freedom, 1)),
        alarm=alarm,
        named=tuple(sorted(found.named)) if naming else (),
        tied=found.verdict is Verdict.TIE,
        unknown=found.verdict is Verdict.UNKNOWN,
        outside=misfit_of(found),
    )


def no_runs(observables: int) -> Simulator:
    """Answer as a published bank does, which has no simulator."""

    def answer(points: Sequence[Point]) -> Outcomes:
        values = np.full((len(points), observables), np.nan)
        return Outcomes(values, ("a published bank has no simulator",) * len(points))

    return answer
