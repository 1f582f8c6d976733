"""Two mechanisms that act alike, and a bank of so few runs that it does not show it."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from synthetic_world import CONDITIONS, OBSERVABLES, SyntheticSimulator, measure, space

from doe.discrepancy import Emulator, Settings, bank_points, fit_emulator, make_bank
from doe.discrepancy.contest.fresh_runs import FreshRuns
from doe.discrepancy.contest.power import CODED_SIZES, Effects, shown_apart
from doe.discrepancy.contest.rounds import CandidateModel, CandidateModels, simulate_again
from doe.discrepancy.contest.signatures import signatures
from doe.discrepancy.fitting.fitted_model import Model, Stack
from doe.discrepancy.fitting.measured_means import gather
from doe.discrepancy.fitting.model_fit import fit, weigh

SMALL = Settings(
    bank_points=24,
    bank_mechanism_points=12,
    systematic=0.2,
    refinement_rounds=2,
    finish_points=0,
    shortlist=1,
)
NAMES = ("alpha", "delta", "twin")


@cache
def small(seed: int) -> Emulator:
    """Return the emulator of a bank of twelve runs of each mechanism."""
    points, simulator = bank_points(space(NAMES), SMALL, seed), SyntheticSimulator(space(NAMES))
    return fit_emulator(make_bank(space(NAMES), OBSERVABLES, points, simulator(points)))


def _effects(known: Emulator) -> Effects:
    evidence = gather(measure({}, 1, replicates=8), known)
    fitted = weigh(Stack(Model(known, (), SMALL.systematic), evidence.training), np.zeros(3))
    return Effects.of(fitted, signatures(fitted))


@pytest.mark.parametrize("seed", range(4))
def test_errors_of_a_small_bank_do_not_tell_twins_apart(seed: int) -> None:
    # Their signatures are one by themselves; here only the distance is looked at.
    effects = replace(_effects(small(seed)), correlations=np.eye(len(NAMES)))
    alpha, twin, largest = effects.names.index("alpha"), effects.names.index("twin"), len(CODED_SIZES) - 1
    raw = effects.apart(alpha, np.zeros_like(effects.chance))[twin, largest]
    likely = effects.apart(alpha, effects.chance)[twin, largest]
    assert raw > 2.0 * SMALL.tie_margin
    assert likely < raw
    # so little of that is beyond its errors that the two are still alike
    assert shown_apart(effects, "alpha", 1.0)["twin"] < SMALL.tie_margin
    assert shown_apart(effects, "alpha", 1.0)["delta"] > 10.0 * SMALL.tie_margin


def _contest(is_open: bool) -> CandidateModels:
    known = small(0)
    evidence = gather(measure({"alpha": 0.9}, 0, replicates=8), known)
    models = [(name,) for name in NAMES]
    stacks = [Stack(Model(known, names, SMALL.systematic), evidence.training) for names in models]
    candidates = {names: CandidateModel(fit(stack)) for names, stack in zip(models, stacks, strict=True)}
    fresh, simulator = FreshRuns(known, CONDITIONS, 1), SyntheticSimulator(space(NAMES))
    contest = simulate_again(
        candidates, fresh, SMALL, 0.0, lambda one, _: is_open and one.mechanisms != ("delta",)
    )
    try:
        points = next(contest)
        while True:
            points = contest.send(simulator(points))
    except StopIteration as end:
        found: CandidateModels = end.value
        return found


def test_a_rival_is_heard_before_the_leader_is_believed() -> None:
    # One model is run again at first; the other one only because it stays open which of the two is right.
    ran = {names for names, one in _contest(False).items() if one.simulated}
    assert len(ran) == 1
    heard = {names: one for names, one in _contest(True).items() if one.simulated}
    assert set(heard) == {("alpha",), ("twin",)}
    assert all(one.settled or one.rounds >= SMALL.refinement_rounds for one in heard.values())
