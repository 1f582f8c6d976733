"""Models in contest: each at its optimum, simulated again around it while that may change who leads."""

from __future__ import annotations

from collections.abc import Generator, Mapping
from dataclasses import dataclass

import numpy as np

from experiments.discover.fitting import Fitted, fit
from experiments.discover.laboratory import Laboratory, Request
from experiments.discover.model import Stack
from experiments.discover.refinement import Runs, correct, has_moved, points_around
from experiments.discover.settings import Settings
from experiments.discover.simulator import Outcomes, Point


@dataclass(frozen=True, eq=False)
class Contender:
    """A model at its optimum.

    Attributes
    ----------
    fitted : Fitted
    runs : Runs or None
        Fresh runs that correct it.
    centre : (parameters,) array or None
        What the last of them lie around.
    """

    fitted: Fitted
    runs: Runs | None = None
    centre: np.ndarray | None = None

    @property
    def simulated(self) -> bool:
        """Whether fresh runs stand behind it."""
        return self.centre is not None

    @property
    def settled(self) -> bool:
        """Whether they lie around its optimum."""
        return self.centre is not None and not has_moved(self.fitted, self.centre)


Contenders = Mapping[tuple[str, ...], Contender]


def simulate_again(
    contenders: Contenders, laboratory: Laboratory, settings: Settings
) -> Generator[list[Point], Outcomes, Contenders]:
    """Correct the leading models, and the base if it is among them, by fresh runs until none of them moves.

    Parameters
    ----------
    contenders : mapping
        By mechanisms.
    laboratory : Laboratory
    settings : Settings
    """
    for number in range(settings.refinement_rounds):
        chosen = _worth_running(contenders, settings)
        if not chosen:
            break
        requests = [
            Request(
                names,
                points_around(contenders[names].fitted, settings.refinement_points, laboratory.seed + number),
                settings.refinement_repeats,
            )
            for names in chosen
        ]
        finished = yield from laboratory.wave(requests)
        updated = {
            name: _updated(contenders[name], runs) for name, runs in zip(chosen, finished, strict=True)
        }
        contenders = {**contenders, **updated}
    return contenders


def _updated(contender: Contender, fresh: Runs) -> Contender:
    before = contender.fitted
    runs = fresh if contender.runs is None else contender.runs.joined(fresh)
    corrected = correct(before.model, runs, before.x)
    return Contender(fit(Stack(corrected, before.stack.blocks), before.x, count=2), runs, before.x)


def _worth_running(contenders: Contenders, settings: Settings) -> list[tuple[str, ...]]:
    """The base, and the models so near the best that its lead may be the emulator's error, unless settled."""
    scores = {names: contender.fitted.score for names, contender in contenders.items() if names}
    best = min(scores.values(), default=0.0)
    margin = 2.0 * settings.tie_margin
    if () in contenders:
        base = contenders[()].fitted
        margin = max(margin, settings.shortlist_share * (base.q - base.freedom))
    near = sorted(
        (names for names in scores if scores[names] - best <= margin), key=lambda names: scores[names]
    )
    shortlist = [names for names in near if not contenders[names].settled][: settings.shortlist]
    return [names for names in contenders if not names and not contenders[names].settled] + shortlist
