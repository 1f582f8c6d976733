"""Analysis of measured data: it finds an effect that the model lacks.

It is a generator: it yields batches of points, is sent their outcomes, and returns its findings. So it runs
with any simulator, and hundreds run together with all their points in one batch.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from doe.discrepancy.contest.fresh_runs import FreshRuns, Request
from doe.discrepancy.contest.gap import OF_A_CANDIDATE, OF_THE_BASE, GapTest, Question, find_gap
from doe.discrepancy.contest.held_out import held_out_gain
from doe.discrepancy.contest.power import Effects, powers, shown_apart
from doe.discrepancy.contest.rivals import certain, is_open, lag, needed, parting
from doe.discrepancy.contest.rounds import CandidateModel, CandidateModels, simulate_again
from doe.discrepancy.contest.signatures import Signatures, signatures
from doe.discrepancy.contest.slips import find_slips, without
from doe.discrepancy.emulation.emulator import Emulator
from doe.discrepancy.fitting.fitted_model import Model, Stack
from doe.discrepancy.fitting.measured_means import Evidence, gather
from doe.discrepancy.fitting.model_fit import Fitted, fit, weigh
from doe.discrepancy.problem.outcomes import Outcomes, Point
from doe.discrepancy.problem.replicates import Measured
from doe.discrepancy.problem.settings import Settings
from doe.discrepancy.verdict import records
from doe.discrepancy.verdict.before_after import BeforeAfter, compare
from doe.discrepancy.verdict.conclusion import (
    Assessment,
    Conclusion,
    conclude,
    conclude_with_two,
    explained_share,
    objections,
    rival,
    withdrawn,
)
from doe.discrepancy.verdict.discovery import Confounding, Discovery, Effort, Gap, Verdict
from doe.discrepancy.verdict.next_experiment import NextExperiment, Rival, propose, propose_without
from doe.numerics.one_thread import in_one_thread, steps_in_one_thread

Analysis = Generator[list[Point], Outcomes, Discovery]

DOUBTED = 0.25
"""P value of a named mechanism, or of a tie, below which pairs are tried too (``trials/record/thirteenth``).
"""

TWIN = 0.8
"""Correlation of visible signatures above which mechanisms replace each other in a pair
(``trials/record/fifteenth``)."""

LEAST_FREEDOM = 2
"""Degrees of freedom that a calibration must leave: with one, every mechanism has the same signature."""


@dataclass(frozen=True, eq=False)
class _Base:
    """Calibrated base with the possible effects of the library."""

    fitted: Fitted
    gap: GapTest
    seen: Signatures
    effects: Effects


def analyse(measured: Measured, emulator: Emulator, settings: Settings, seed: int) -> Analysis:
    """Analyse measured data; where a slip is likely, analyse them without its values as well.

    Parameters
    ----------
    emulator : Emulator
        Emulator of the bank; mechanisms that it withholds (``without``) are not in the library.
    seed : int
        Seed of the bootstraps and of the fresh runs.

    Yields
    ------
    list of Point
        A batch; its `Outcomes` must be sent back, columns as in the bank.
    """
    slips = in_one_thread(find_slips)(measured, emulator, settings)
    found = yield from _analyse(measured, emulator, settings, seed)
    if not slips:
        return found
    rest = yield from _analyse(without(measured, slips), emulator, settings, seed + 1)
    return replace(found, slips=slips, without_slips=rest)


@steps_in_one_thread
def _analyse(measured: Measured, emulator: Emulator, settings: Settings, seed: int) -> Analysis:
    """Analyse measured data as they are."""
    evidence = gather(measured, emulator)
    if not evidence.training:
        conclusion = Conclusion(
            Verdict.NOT_IDENTIFIABLE, (), "no training condition has a value to compare", None
        )
        return _empty(emulator, evidence, settings, seed, conclusion)
    parts = _Parts(emulator, evidence, settings, seed, FreshRuns(emulator, emulator.space.conditions, seed))
    model = Model(emulator, (), settings.systematic, views=evidence.views)
    base = parts.base(fit(Stack(model, evidence.training)))
    factors = len(emulator.space.factors)
    if evidence.count - factors < LEAST_FREEDOM:
        reason = (
            f"{evidence.count} measured mean{'s' * (evidence.count > 1)}, {factors} factors and the size of a"
            " mechanism: other values of the factors can take any such disagreement up"
        )
        return parts.discovery(base, Conclusion(Verdict.NOT_IDENTIFIABLE, (), reason, None), [])
    if not base.gap.found:
        reason = f"the calibrated model agrees with the data within the noise (p = {base.gap.p:.2g})"
        return parts.discovery(base, Conclusion(Verdict.NONE, (), reason, None), [])
    return (yield from _search(parts, base))


def _search(parts: _Parts, base: _Base) -> Analysis:
    """Explain a gap: choose candidates, simulate them again, decide, compare before and after."""
    settings = parts.settings
    singles_and_base = {(): CandidateModel(base.fitted), **parts.candidates([(n,) for n in base.seen.names])}
    candidates = yield from parts.contest(base, singles_and_base)
    base = parts.base(candidates[()].fitted)
    if not base.gap.found:
        reason = f"fresh runs at the optimum agree with the data within the noise (p = {base.gap.p:.2g})"
        return parts.discovery(base, Conclusion(Verdict.NONE, (), reason, None), [])
    singles = parts.assess(base, {names: one for names, one in candidates.items() if names})
    conclusion, assessments = conclude(singles, settings), singles
    chosen = None if conclusion.chosen is None else singles[conclusion.chosen]
    if _asks_for_two(chosen, singles, settings):
        pairs = yield from _pairs(parts, base, singles, chosen)
        conclusion, assessments = conclude_with_two(conclusion, singles, pairs, settings)
    if conclusion.chosen is None:
        return parts.discovery(base, conclusion, assessments)
    best = assessments[conclusion.chosen].fitted
    requests = [Request(one.mechanisms, one.x[None], settings.direct_runs) for one in (base.fitted, best)]
    direct = yield from parts.fresh.batch(requests)
    compared = []
    for held_out, blocks in ((False, parts.evidence.training), (True, parts.evidence.held_out)):
        compared.append(
            compare(base.fitted, best, direct[0], direct[1], blocks, held_out, settings.draws, parts.seed)
        )
    shown = [one for one in compared if one is not None]
    return parts.discovery(base, withdrawn(conclusion, shown), assessments, shown)


def drive(analysis: Analysis, simulator: Callable[[Sequence[Point]], Outcomes]) -> Discovery:
    """Run an analysis to its end; a simulator, or any function of points, answers its batches."""
    try:
        points = next(analysis)
        while True:
            points = analysis.send(simulator(points))
    except StopIteration as end:
        found: Discovery = end.value
        return found


def _asks_for_two(chosen: Assessment | None, singles: Sequence[Assessment], settings: Settings) -> bool:
    """Return True if the best single mechanism leaves a gap, or the chosen one is doubted."""
    if chosen is not None:
        return chosen.gap.p < DOUBTED
    best = min(singles, key=lambda one: one.score, default=None)
    return best is not None and best.gap.p < settings.fit_level


def _pairs(
    parts: _Parts, base: _Base, singles: Sequence[Assessment], chosen: Assessment | None
) -> Generator[list[Point], Outcomes, list[Assessment]]:
    """Try the pairs that promise most, then the twins of the best, until the best has no new twin."""
    promising = _promising_pairs(singles, chosen, parts.settings)
    if not promising:  # e.g. with a single mechanism
        return []
    candidates = yield from parts.contest(base, parts.candidates(promising))
    tried = set(promising)
    while candidates:
        best = min(candidates, key=lambda pair: candidates[pair].fitted.score)
        new = [pair for pair in _twins(best, base.seen) if pair not in tried]
        if not new:
            break
        met = yield from parts.contest(base, {best: candidates[best], **parts.candidates(new)})
        candidates, tried = {**candidates, **met}, tried.union(new)
    return parts.assess(base, candidates)


def _promising_pairs(
    singles: Sequence[Assessment], chosen: Assessment | None, settings: Settings
) -> list[tuple[str, ...]]:
    """Return the pairs to try first: those whose members' residuals promise most."""
    promised = _promised_pairs(singles)
    if chosen is not None:  # any other joins it at hardly a loss: such pairs would crowd the rest out
        (name,), enough = chosen.mechanisms, chosen.gap.q - settings.tie_margin
        joined = {pair: q for pair, q in _promised_pairs([chosen]).items() if q < enough}
        promised = {pair: q for pair, q in promised.items() if name not in pair} | joined
    return sorted(promised, key=lambda pair: promised[pair])[: settings.pair_candidates]


def _twins(pair: tuple[str, ...], seen: Signatures) -> list[tuple[str, ...]]:
    """Return pairs in which one mechanism of a pair is replaced by one that looks much like it."""
    alike = dict(zip(seen.names, seen.correlations > TWIN, strict=True))
    out = []
    for own, other in (pair, pair[::-1]):
        others = [name for name, like in zip(seen.names, alike[own], strict=True) if like]
        out += [tuple(sorted((name, other))) for name in others if name not in pair]
    return out


def _promised_pairs(singles: Sequence[Assessment]) -> dict[tuple[str, ...], float]:
    """Return all pairs with the Q that the residuals of each member promise for them."""
    promised: dict[tuple[str, ...], float] = {}
    for one in singles:
        for name, score in zip(one.gap.mechanisms, one.gap.scores, strict=True):
            pair = tuple(sorted((*one.mechanisms, name)))
            left = one.gap.q - max(score, 0.0) ** 2
            promised[pair] = min(left, promised.get(pair, left))
    return promised


@dataclass(frozen=True, eq=False)
class _Parts:
    """Parts that the steps of one analysis share."""

    emulator: Emulator
    evidence: Evidence
    settings: Settings
    seed: int
    fresh: FreshRuns

    def candidates(self, models: Sequence[tuple[str, ...]]) -> dict[tuple[str, ...], CandidateModel]:
        """Fit models on the emulator."""
        blocks = self.evidence.training
        systematic = self.settings.systematic
        views = self.evidence.views
        of = {m: Model(self.emulator, m, systematic, views=views) for m in models}
        return {m: CandidateModel(fit(Stack(model, blocks))) for m, model in of.items()}

    def contest(
        self, base: _Base, candidates: CandidateModels
    ) -> Generator[list[Point], Outcomes, CandidateModels]:
        """Simulate again the models that may explain the gap of the base."""
        error, rivalry = self.settings.shortlist_share * base.gap.excess, partial(self.is_rival, base)
        return simulate_again(candidates, self.fresh, self.settings, error, rivalry)

    def base(self, fitted: Fitted) -> _Base:
        """Collect the gap, signatures and possible effects of the calibrated base."""
        seen = signatures(fitted)
        gap = self._gap(fitted, self.settings.false_alarm, OF_THE_BASE)
        return _Base(fitted, gap, seen, Effects.of(fitted, seen))

    def whole(self, fitted: Fitted) -> Fitted:
        """Weigh a fit on all conditions, those of the fit and those of the forecast."""
        return weigh(Stack(fitted.model, (*self.evidence.training, *self.evidence.held_out)), fitted.x)

    def apart(self, base: _Base, fitted: Fitted) -> dict[str, float]:
        """Return by other mechanism its distance in Q from a single mechanism of this size."""
        if len(fitted.mechanisms) != 1:
            return {}
        return shown_apart(base.effects, fitted.mechanisms[0], float(fitted.coded_sizes[0]))

    def is_rival(self, base: _Base, one: Fitted, leader: Fitted) -> bool:
        """Return True if it is open which of two models is right."""
        whole, best, margin = self.whole(one), self.whole(leader), self.settings.tie_margin
        behind = lag(whole.score - best.score, certain(whole) - certain(best), margin)
        apart = self.apart(base, leader).get(one.mechanisms[0], math.inf)
        return is_open(behind, apart, margin, parting(whole, best))

    def _gap(self, fitted: Fitted, level: float, questions: Sequence[Question]) -> GapTest:
        """Test a model on all conditions."""
        whole = self.whole(fitted)
        return find_gap(whole, signatures(whole), level, self.settings.draws, self.seed, questions)

    def assess(self, base: _Base, candidates: CandidateModels) -> list[Assessment]:
        """Apply every rule to the candidates, best first."""
        settings, out = self.settings, []
        for names, one in candidates.items():
            gap = self._gap(one.fitted, settings.fit_level, OF_A_CANDIDATE)
            gain = held_out_gain(base.fitted, one.fitted, self.evidence.held_out, settings.draws, self.seed)
            share = explained_share(base.gap, gap)
            may = settings.resolvable is None or set(names) <= set(settings.resolvable)
            whole, apart = self.whole(one.fitted), self.apart(base, one.fitted)
            out.append(Assessment(one.fitted, gap, gain, share, one.simulated, may, whole, apart))
        return sorted(out, key=lambda one: one.score)

    def discovery(
        self,
        base: _Base,
        conclusion: Conclusion,
        assessments: Sequence[Assessment],
        before_after: Sequence[BeforeAfter] = (),
    ) -> Discovery:
        """Return the record of all findings."""
        closest = assessments[0] if assessments else None
        chosen = None if conclusion.chosen is None else assessments[conclusion.chosen]
        shown = closest if chosen is None else chosen
        fit = None if shown is None else records.fit_record(shown.fitted, shown.gap, self.evidence)
        failures = self.fresh.failures
        notes = [f"{failures} of {self.fresh.cases} fresh runs failed"] if failures else []
        drop = base.gap
        return Discovery(
            verdict=conclusion.verdict,
            reason=conclusion.reason,
            named=conclusion.named,
            factors=self.emulator.space.factors,
            data=records.data_record(self.emulator, self.evidence, base.fitted),
            base=records.fit_record(base.fitted, base.gap, self.evidence),
            chosen=None if chosen is None else fit,
            closest=fit if chosen is None else None,
            gap=Gap(drop.found, drop.drop, drop.drop_limit, drop.mechanism),
            drifts=records.drift_records(base.fitted),
            candidates=tuple(
                records.candidate_record(one, base.seen, base.gap.scores, self.settings)
                for one in assessments
            ),
            power=powers(base.effects, base.seen.shares, self.emulator.space, self.settings),
            confounding=Confounding(base.seen.names, base.seen.correlations),
            before_after=tuple(before_after),
            next_experiment=self._next(base, conclusion, assessments),
            notes=(*self.evidence.notes, *records.scatter_notes(base.fitted), *self.emulator.notes, *notes),
            effort=Effort(self.seed, self.settings.sha256, self.emulator.cases, self.fresh.cases),
        )

    def _next(
        self, base: _Base, conclusion: Conclusion, assessments: Sequence[Assessment]
    ) -> NextExperiment | None:
        """Propose an experiment for the two best explanations, or for the best one and the base.

        In a tie it is for all of the tie; where repeated tests are not expected to settle it, without one of
        them. Two rejected models are not worth a measurement.
        """
        if conclusion.verdict in (Verdict.NONE, Verdict.NOT_IDENTIFIABLE) or not assessments:
            return None
        ordered = sorted(assessments, key=lambda one: one.score)
        if conclusion.verdict is Verdict.UNKNOWN:
            ordered.sort(key=lambda one: bool(objections(one, self.settings)))
            if objections(ordered[0], self.settings):
                return None
        margin, others = self.settings.tie_margin, ordered[1:2]
        if conclusion.verdict is Verdict.TIE:
            ordered = [one for one in ordered if one.mechanisms in [(name,) for name in conclusion.named]]
            others = ordered[1:]
        best = ordered[0]
        rivals = [rival(one, best, margin) for one in others]
        if not rivals:
            whole, limit = self.whole(base.fitted), needed(math.inf, margin)
            rivals = [Rival(whole, base.fitted.score - best.score, limit, parting(whole, best.whole))]
        most = max(int(np.max(block.replicates)) for block in self.evidence.training)
        again = propose(best.whole, rivals, most, self.settings.power)
        if again.settles or conclusion.verdict is not Verdict.TIE:
            return again
        without = propose_without(base.fitted, [one.whole for one in ordered], most, self.settings)
        return without if without and without.settles else again


def _empty(
    emulator: Emulator, evidence: Evidence, settings: Settings, seed: int, conclusion: Conclusion
) -> Discovery:
    """Return the record of data to which nothing can be fitted."""
    return Discovery(
        verdict=conclusion.verdict,
        reason=conclusion.reason,
        named=(),
        factors=emulator.space.factors,
        data=records.data_record(emulator, evidence),
        notes=(*evidence.notes, *emulator.notes),
        effort=Effort(seed, settings.sha256, emulator.cases, 0),
    )
