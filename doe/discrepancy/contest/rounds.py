"""Models in contest: each at its optimum, simulated again around it while that may change who leads."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from doe.discrepancy.contest.fresh_runs import Laboratory, Request
from doe.discrepancy.fitting.fitted_model import Stack
from doe.discrepancy.fitting.misses import Runs
from doe.discrepancy.fitting.model_fit import Fitted, fit
from doe.discrepancy.fitting.refinement import correct, has_moved, points_around
from doe.discrepancy.problem.outcomes import Outcomes, Point
from doe.discrepancy.problem.settings import Settings


@dataclass(frozen=True, eq=False)
class Contender:
    """A model at its optimum."""

    fitted: Fitted
    runs: Runs | None = None
    """Fresh runs that correct it."""
    centre: np.ndarray | None = None
    """Centre of the last of them, (parameters,); None where there is none."""
    rounds: int = 0
    """Times that it was run."""

    @property
    def simulated(self) -> bool:
        """True if fresh runs stand behind it."""
        return self.centre is not None

    @property
    def fails(self) -> bool:
        """True if no fresh run of it has ended: a simulator may refuse it, or fail everywhere."""
        return self.runs is not None and not len(self.runs.conditions)

    @property
    def settled(self) -> bool:
        """True if they lie around its optimum."""
        return self.centre is not None and not has_moved(self.fitted, self.centre)


Contenders = Mapping[tuple[str, ...], Contender]


Rivalry = Callable[[Fitted, Fitted], bool]
"""Says of a model and the leader if it stays open which of them is right."""


def simulate_again(
    contenders: Contenders, laboratory: Laboratory, settings: Settings, error: float, is_rival: Rivalry
) -> Generator[list[Point], Outcomes, Contenders]:
    """Correct by fresh runs the models that may fit and may lead, half as many in every next round.

    Then a leader that fits and all its rivals are heard, run until their optima stay: the leader has gained
    by its own runs, and on an emulator of a few runs a rival's optimum may lie anywhere. At last the leader
    runs against those that might still overtake it.

    Parameters
    ----------
    contenders : mapping
        By mechanisms; the base is corrected once, if it may fit, whoever leads. A rival whose runs fail is
        out, where runs can be had at all.
    laboratory : Laboratory
    settings : Settings
    error : float
        By how much the emulator may be wrong about Q.
    is_rival : callable
    """
    points = settings.refinement_points
    for number in range(settings.refinement_rounds):
        chosen = _worth_running(contenders, settings, error, max(1, settings.shortlist >> number))
        contenders = yield from _run(contenders, chosen, points, laboratory, settings, number)
    called: list[tuple[str, ...]] = []
    while True:
        called += [names for names in _rivals(contenders, settings, is_rival) if names not in called]
        unheard = [names for names in called if names in contenders and _unheard(contenders[names], settings)]
        if not unheard:
            break
        contenders = yield from _run(
            contenders, unheard, points, laboratory, settings, settings.refinement_rounds
        )
    chosen, points = _undecided(contenders, settings), settings.finish_points
    return (yield from _run(contenders, chosen, points, laboratory, settings, settings.refinement_rounds))


def _run(
    contenders: Contenders,
    chosen: Sequence[tuple[str, ...]],
    points: int,
    laboratory: Laboratory,
    settings: Settings,
    number: int,
) -> Generator[list[Point], Outcomes, Contenders]:
    """Run some models at so many points each, in the round of a number, and correct them."""
    if not (chosen and points):
        return contenders
    requests = [
        Request(
            names,
            points_around(contenders[names].fitted, points, laboratory.seed + number),
            settings.refinement_repeats,
        )
        for names in chosen
    ]
    finished = yield from laboratory.wave(requests)
    updated = {name: _updated(contenders[name], runs) for name, runs in zip(chosen, finished, strict=True)}
    contenders = {**contenders, **updated}
    if laboratory.runs_end:
        contenders = {names: one for names, one in contenders.items() if not names or not one.fails}
    return contenders


def _updated(contender: Contender, fresh: Runs) -> Contender:
    before = contender.fitted
    runs = fresh if contender.runs is None else contender.runs.joined(fresh)
    corrected = correct(before.model, runs, before.x)
    refitted = fit(Stack(corrected, before.stack.blocks), before.x, count=2)
    return Contender(refitted, runs, before.x, contender.rounds + 1)


def _worth_running(
    contenders: Contenders, settings: Settings, error: float, count: int
) -> list[tuple[str, ...]]:
    """The base and so many others that fresh runs may bring within the noise and before the rest.

    The best is run at least once, whatever it leaves: nothing is said without a fresh run.
    """
    best = min(contender.fitted.score for contender in contenders.values())
    tied, near = 2.0 * settings.tie_margin, []
    for names, one in contenders.items():
        behind, limit = one.fitted.score - best, stats.chi2.isf(settings.false_alarm, one.fitted.freedom)
        if one.simulated:  # What the emulator got wrong of it is known.
            may_lead, may_fit = behind <= tied, one.fitted.q <= limit + error
        else:
            may_lead = behind <= max(error, tied) or not names
            may_fit = one.fitted.q <= limit + error or behind == 0.0
        if may_lead and may_fit and not one.settled:
            near.append(names)
    others = sorted(filter(None, near), key=lambda names: contenders[names].fitted.score)
    return [names for names in near if not names] + others[:count]


def _rivals(contenders: Contenders, settings: Settings, is_rival: Rivalry) -> list[tuple[str, ...]]:
    """The leader, if it was run and is within the noise, and its rivals; none without."""
    leader = min((one.fitted for names, one in contenders.items() if names), key=_score, default=None)
    if leader is None or not contenders[leader.mechanisms].simulated or not _fits(leader, settings):
        return []
    rivals = [
        names
        for names, one in contenders.items()
        if names and one.fitted is not leader and _fits(one.fitted, settings) and is_rival(one.fitted, leader)
    ]
    return [leader.mechanisms, *rivals] if rivals else []


def _unheard(contender: Contender, settings: Settings) -> bool:
    """Say if a model was not run around its optimum, nor as often as a leader may be."""
    return not contender.settled and contender.rounds < settings.refinement_rounds


def _score(fitted: Fitted) -> float:
    return fitted.score


def _fits(fitted: Fitted, settings: Settings) -> bool:
    """Say if Q is within the noise of a model that is not wrong."""
    return bool(fitted.q <= stats.chi2.isf(settings.false_alarm, fitted.freedom))


def _undecided(contenders: Contenders, settings: Settings) -> list[tuple[str, ...]]:
    """The leader, and those that might overtake it if more were known of what they predict; none without.

    The score of a model that little is known of suffers for its uncertain predictions.
    """
    run = {names: one.fitted for names, one in contenders.items() if names and one.simulated}
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
