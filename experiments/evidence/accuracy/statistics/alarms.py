"""The alarm of the search on Gaussian twins, next to exact tests; wrong names; false discoveries.

Truth is the emulator of the shipped bench bank, its heaps scatter normally. In one world the search knows
that simulator. There the F test of lack of fit against the scatter of the heaps, and the randomisation test
that flips the signs of heaps, are exact (but for a linear refit). In the other world it has, as a user has,
an emulator of a bank of runs, which is drawn anew for each laboratory, and instruments err.
"""

from collections.abc import Iterator, Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from doe.discrepancy import Emulator, analyse, drive, fit_emulator
from doe.discrepancy.contest.gap import find_gap
from doe.discrepancy.contest.signatures import projector, signatures
from doe.discrepancy.fitting.model_fit import Fitted, whiten
from experiments.evidence.accuracy.statistics.coverage import AT_MOST, EXACT, Figure, generator
from experiments.evidence.trials.baselines.emulated_world import (
    REPLICATES,
    EmulatedSimulator,
    emulated_heaps,
    redrawn_bank,
    true_world,
)
from experiments.evidence.trials.baselines.protocol import Problem

BANKS, TWINS, ACT, NAMES, LABS = 20, 30, 6, 12, 20_000
"""Banks; twins of each without an effect, with one, and with one to name; laboratories drawn from these."""
SETS, ACTING = 10, (1, 5)
"""Data sets of one laboratory, and those of them in which an effect acts."""
LEVEL, FLIPS, UNSTATED, LEAST = 0.025, 999, 1.0, 0.25
"""Level of a test, draws of signs, a level that nobody states, and the least coded size of an effect."""
P = dict[str, NDArray[np.float64]]
"""P values of each test, (banks, twins)."""


@cache
def world(bank: int | None) -> tuple[EmulatedSimulator, Emulator]:
    """Return the truth, and what the search knows of it: itself, or the emulator of a bank."""
    simulator = EmulatedSimulator(true_world()[0].emulator)
    runs = None if bank is None else redrawn_bank(simulator, true_world()[1], bank)
    return simulator, fit_emulator(runs) if runs else simulator.emulator


def twin(rng: np.random.Generator, bank: int | None, mechanism: str = "") -> Problem:
    """Draw heaps of a world, with a mechanism of random size or without."""
    (simulator, known), settings = world(bank), true_world()[1]
    space = known.space
    theta = space.natural_theta(rng.uniform(-1.0, 1.0, len(space.factors))).tolist()
    sizes = {mechanism: space.natural_size(mechanism, rng.uniform(LEAST, 1.0))} if mechanism else {}
    errs, seed = settings.systematic * (bank is not None), int(rng.integers(2**31))
    heaps = emulated_heaps(simulator, theta, sizes, REPLICATES, seed, errs)
    return Problem("", known, heaps, settings, seed)


def p_values(problem: Problem, simulator: EmulatedSimulator, rng: np.random.Generator) -> dict[str, float]:
    """P values of a calibrated base: by the search, by its bootstrap without fresh runs, by other tests."""
    base = problem.fitted()
    gap = find_gap(base, signatures(base), LEVEL, problem.settings.draws, problem.seed)
    found = drive(analyse(problem.measured, problem.emulator, problem.settings, problem.seed), simulator)
    heaps, project = _whitened(problem, base)
    seen = float(((heaps.sum(axis=0) @ project) ** 2).sum())
    freedom = round(float(np.trace(project)))
    groups = heaps.reshape(-1, REPLICATES, len(project))
    inner = len(groups) * (REPLICATES - 1) * len(base.model.emulator.observables)
    scale = REPLICATES * float(((groups - groups.mean(axis=1, keepdims=True)) ** 2).sum()) / inner
    signs = rng.choice([-1.0, 1.0], (FLIPS, len(heaps)))
    flipped = ((signs @ (heaps @ project)) ** 2).sum(axis=1)
    return {
        "search": found.base.p_value if found.base else 1.0,
        "bootstrap on the bank": gap.p,
        "chi-square": float(stats.chi2.sf(gap.q, gap.freedom)),
        "F test": float(stats.f.sf(seen / freedom / scale, freedom, inner)),
        "randomisation": (1.0 + float((flipped >= seen).sum())) / (FLIPS + 1.0),
    }


def _whitened(problem: Problem, base: Fitted) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Deviations of heaps, whose sum has variance 1, (heaps, means), and what a refit leaves of a sum."""
    slopes, start = base.stack.jacobian(base.x[None])[0], 0
    heaps, white = [], np.empty_like(slopes)
    for block in base.stack.blocks:
        part = slice(start, start := start + len(block.columns))
        whitening = whiten(base.model.run_covariance(base.x, block.condition))
        white[part] = np.sqrt(REPLICATES) * whitening @ slopes[part]
        away = problem.measured.values[block.condition] - base.model.predict(base.x[None], block.condition)
        rows = np.zeros((REPLICATES, len(slopes)))
        rows[:, part] = away @ whitening.T / np.sqrt(REPLICATES)
        heaps.append(rows)
    return np.concatenate(heaps), projector(white)


def tested(rng: np.random.Generator, banks: Sequence[int | None], count: int, names: Sequence[str]) -> P:
    """P values of twins in which mechanisms act in turn, or nothing."""
    found = []
    for bank in banks:
        twins = (twin(rng, bank, names[number % len(names)]) for number in range(count))
        found.append([p_values(one, world(bank)[0], rng) for one in twins])
    return {test: np.array([[one[test] for one in row] for row in found]) for test in found[0][0]}


def wrong_lead(problem: Problem, truth: str) -> float:
    """Return how far a wrong single mechanism leads every other; negative where the truth leads."""
    scores = {name: problem.fitted((name,)).score for name in problem.emulator.space.names}
    first, second = sorted(scores, key=scores.__getitem__)[:2]
    return scores[second] - scores[first] if first != truth else -1.0


def alarms() -> Iterator[Figure]:
    """Yield levels of alarms, wrong names, and false discoveries among the data sets of a laboratory."""
    rng, banks = generator("alarms", 0), range(BANKS)
    names, margin = true_world()[0].emulator.space.names, true_world()[1].tie_margin
    known = tested(rng, [None], BANKS * TWINS, [""])
    null = tested(rng, banks, TWINS, [""])
    for test in null:
        promise = EXACT if test in ("F test", "randomisation") else AT_MOST
        share = float((known[test] < LEVEL).mean())
        yield Figure(f"alarm, {test}", "the simulator is known", LEVEL, promise, share, BANKS * TWINS)
        stated = LEVEL if test == "search" else UNSTATED
        yield _of_banks(f"alarm with a bank, {test}", "an emulator of a bank", stated, null[test] < LEVEL)
    acting = tested(rng, banks, ACT, names)
    for test in ("search", "chi-square"):
        yield from _discoveries(test, null[test].ravel(), acting[test].ravel(), rng)
    truths = names * (NAMES // len(names))
    leads = np.array([[wrong_lead(twin(rng, bank, one), one) for one in truths] for bank in banks])
    for least in (0.0, margin):
        # by Markov a wrong hypothesis leads the truth by a ratio of likelihoods of r with 1 / r at most
        case, stated = f"{least:g} or more ahead of its best rival", float(np.exp(-0.5 * least))
        yield _of_banks("wrong name", case, stated, leads >= least)


def _of_banks(figure: str, case: str, stated: float, happens: NDArray[np.bool_]) -> Figure:
    """Return a figure of twins (banks, twins) whose error is that between banks."""
    shares = happens.mean(axis=1)
    return Figure(figure, case, stated, AT_MOST, float(shares.mean()), len(shares), float(shares.std()))


def _discoveries(
    test: str, null: NDArray[np.float64], acting: NDArray[np.float64], rng: np.random.Generator
) -> Iterator[Figure]:
    """Yield shares of false alarms among all alarms, each data set alone and after Benjamini and Hochberg."""
    for count in ACTING:
        true = rng.choice(acting, (LABS, count))
        p = np.concatenate([true, rng.choice(null, (LABS, SETS - count))], axis=1)
        adjusted = stats.false_discovery_control(p, axis=1)
        any_of_them = 1.0 - (1.0 - LEVEL) ** (SETS - count)
        for how, values, stated in (("each alone", p, any_of_them), ("adjusted", adjusted, UNSTATED)):
            alarm = values < LEVEL
            false = alarm[:, count:].sum(axis=1) / np.maximum(alarm.sum(axis=1), 1)
            title, case = f"false discoveries, {how}, {test}", f"{count} of {SETS} data sets have an effect"
            yield Figure(title, case, stated, AT_MOST, float(false.mean()), LABS, float(false.std()))
