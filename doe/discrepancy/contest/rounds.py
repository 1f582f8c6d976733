"""Models in competition: each at its optimum, simulated again around it while that may change the leader."""

from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from doe.discrepancy.contest.fresh_runs import FreshRuns, Request
from doe.discrepancy.fitting.fitted_model import Stack
from doe.discrepancy.fitting.misses import Runs
from doe.discrepancy.fitting.model_fit import Fitted, fit
from doe.discrepancy.fitting.refinement import correct, has_moved, points_around
from doe.discrepancy.problem.outcomes import Outcomes, Point
from doe.discrepancy.problem.settings import Settings


@dataclass(frozen=True, eq=False)
class CandidateModel:
    """A model at its optimum."""

    fitted: Fitted
    runs: Runs | None = None
    """Fresh runs that correct it."""
    centre: np.ndarray | None = None
    """Centre of the last of them, (parameters,); None before the first."""
    rounds: int = 0
    """Number of times that it was run."""

    @property
    def simulated(self) -> bool:
        """True if it has fresh runs."""
        return self.centre is not None

    @property
    def fails(self) -> bool:
        """True if no fresh run of it has ended: a simulator may reject it, or fail everywhere."""
        return self.runs is not None and not len(self.runs.conditions)

    @property
    def settled(self) -> bool:
        """True if the fresh runs are around its optimum."""
        return self.centre is not None and not has_moved(self.fitted, self.centre)


CandidateModels = Mapping[tuple[str, ...], CandidateModel]


Rivalry = Callable[[Fitted, Fitted], bool]
"""Function of a model and the leader: is it open which of them is right?"""


def simulate_again(
    candidates: CandidateModels, fresh: FreshRuns, settings: Settings, error: float, is_rival: Rivalry
) -> Generator[list[Point], Outcomes, CandidateModels]:
    """Correct by fresh runs the models that may fit and may lead, half as many in every next round.

    Then a leader that fits and all its rivals are run until their optima stay: the leader has gained by its
    own runs, and an emulator of few runs may place a rival's optimum anywhere. At last the leader runs
    against those that may still overtake it.

    Parameters
    ----------
    candidates : mapping
        Candidates by mechanisms; the base is corrected once, if it may fit. A rival whose runs all fail is
        dropped, where runs can be had at all.
    error : float
        Error of the emulator in Q.
    """
    points = settings.refinement_points
    for number in range(settings.refinement_rounds):
        chosen = _worth_running(candidates, settings, error, max(1, settings.shortlist >> number))
        candidates = yield from _run(candidates, chosen, points, fresh, settings, number)
    called: list[tuple[str, ...]] = []
    while True:
        called += [names for names in _rivals(candidates, settings, is_rival) if names not in called]
        waiting = [
            names for names in called if names in candidates and _needs_runs(candidates[names], settings)
        ]
        if not waiting:
            break
        candidates = yield from _run(candidates, waiting, points, fresh, settings, settings.refinement_rounds)
    chosen, points = _undecided(candidates, settings), settings.finish_points
    return (yield from _run(candidates, chosen, points, fresh, settings, settings.refinement_rounds))


def _run(
    candidates: CandidateModels,
    chosen: Sequence[tuple[str, ...]],
    points: int,
    fresh: FreshRuns,
    settings: Settings,
    number: int,
) -> Generator[list[Point], Outcomes, CandidateModels]:
    """Run some models at a number of points each, and correct them."""
    if not (chosen and points):
        return candidates
    requests = [
        Request(
            names,
            points_around(candidates[names].fitted, points, fresh.seed + number),
            settings.refinement_repeats,
        )
        for names in chosen
    ]
    finished = yield from fresh.batch(requests)
    updated = {name: _updated(candidates[name], runs) for name, runs in zip(chosen, finished, strict=True)}
    candidates = {**candidates, **updated}
    if fresh.runs_end:
        candidates = {names: one for names, one in candidates.items() if not names or not one.fails}
    return candidates


def _updated(candidate: CandidateModel, fresh: Runs) -> CandidateModel:
    before = candidate.fitted
    runs = fresh if candidate.runs is None else candidate.runs.joined(fresh)
    corrected = correct(before.model, runs, before.x)
    refitted = fit(Stack(corrected, before.stack.blocks), before.x, count=2)
    return CandidateModel(refitted, runs, before.x, candidate.rounds + 1)


def _worth_running(
    candidates: CandidateModels, settings: Settings, error: float, count: int
) -> list[tuple[str, ...]]:
    """Return the base and some others that fresh runs may bring within the noise and to the lead.

    The best is run at least once, whatever it leaves: a verdict needs a fresh run.
    """
    best = min(candidate.fitted.score for candidate in candidates.values())
    tied, near = 2.0 * settings.tie_margin, []
    for names, one in candidates.items():
        behind, limit = one.fitted.score - best, stats.chi2.isf(settings.false_alarm, one.fitted.freedom)
        if one.simulated:  # the emulator's error at it is known
            may_lead, may_fit = behind <= tied, one.fitted.q <= limit + error
        else:
            may_lead = behind <= max(error, tied) or not names
            may_fit = one.fitted.q <= limit + error or behind == 0.0
        if may_lead and may_fit and not one.settled:
            near.append(names)
    others = sorted(filter(None, near), key=lambda names: candidates[names].fitted.score)
    return [names for names in near if not names] + others[:count]


def _rivals(candidates: CandidateModels, settings: Settings, is_rival: Rivalry) -> list[tuple[str, ...]]:
    """Return the leader, if it was run and is within the noise, and its rivals; nothing without rivals."""
    leader = min((one.fitted for names, one in candidates.items() if names), key=_score, default=None)
    if leader is None or not candidates[leader.mechanisms].simulated or not _fits(leader, settings):
        return []
    rivals = [
        names
        for names, one in candidates.items()
        if names and one.fitted is not leader and _fits(one.fitted, settings) and is_rival(one.fitted, leader)
    ]
    return [leader.mechanisms, *rivals] if rivals else []


def _needs_runs(candidate: CandidateModel, settings: Settings) -> bool:
    """Return True if a model was not run around its optimum, nor as often as a leader may be."""
    return not candidate.settled and candidate.rounds < settings.refinement_rounds


def _score(fitted: Fitted) -> float:
    return fitted.score


def _fits(fitted: Fitted, settings: Settings) -> bool:
    """Return True if Q is within the noise of a right model."""
    return bool(fitted.q <= stats.chi2.isf(settings.false_alarm, fitted.freedom))


def _undecided(candidates: CandidateModels, settings: Settings) -> list[tuple[str, ...]]:
    """Return the leader and those that more knowledge may bring ahead of it; nothing without such rivals.

    The score of a little known model is low for its uncertain predictions.
    """
    run = {names: one.fitted for names, one in candidates.items() if names and one.simulated}
    leader = min(run, key=lambda names: run[names].score, default=())
    rivals = [
        names
        for names, fitted in run.items()
        if names != leader
        and fitted.promise <= run[leader].score + settings.tie_margin
        and _fits(fitted, settings)
    ]
    rivals = sorted(rivals, key=lambda names: run[names].score)[: settings.shortlist - 1]
    return [leader, *rivals] if rivals else []
