"""The choice of tests: all pairs are tried, then tests are added greedily and exchanged."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

from doe import FactorSurface, central_composite
from doe.response.quadratic import FittedSurface
from experiments.calibrate.joint import NO_HELP, direction_text
from experiments.calibrate.plan.knowledge import Array, Knowledge, Size, Variant
from experiments.calibrate.plan.present import Key, Present
from experiments.io.plain_data import jsonable
from experiments.io.texts import enumeration
from experiments.studyfile.campaign import OptimumSettings
from experiments.studyfile.candidate_section import Candidate

GAIN, AS_GOOD = 0.05, 0.02
"""Shares by which a further test, and one in place of another, must narrow the width of a set."""

LARGER, WORTH = (2.0, 5.0, 10.0, 20.0, 50.0, 100.0), 0.8
"""Growths that are tried of a test that buys nothing, and the share of the region that one must leave."""

ASSUMED = "Assumed"
"""First word of the notes on what no candidate states."""

CHUNK = 64
"""Sets that are evaluated at once."""

Chosen = tuple[int, ...]
"""Numbers of the variants of a set, in order."""


@dataclass(frozen=True, eq=False)
class Choice:
    """Sets of variants by what they buy and what they cost."""

    knowledge: Knowledge
    variants: Sequence[Variant]
    _widths: dict[Chosen, float] = field(default_factory=dict)

    @cached_property
    def _added(self) -> list[Array]:
        return [self.knowledge.added(v.candidate, v.repeats, v.size.growth) for v in self.variants]

    def information(self, chosen: Chosen) -> Array:
        """Return all that is known with a set of tests."""
        return sum((self._added[v] for v in chosen), self.knowledge.base)

    def minutes(self, chosen: Chosen) -> float:
        """Return the laboratory time of a set [min]."""
        return sum(self.variants[v].minutes for v in chosen)

    def widths(self, sets: Sequence[Chosen]) -> Array:
        """Return the root mean square of the promised half widths of each set: the widest weighs most."""
        new = [chosen for chosen in dict.fromkeys(sets) if chosen not in self._widths]
        for start in range(0, len(new), CHUNK):
            part = new[start : start + CHUNK]
            found = self.knowledge.promised(np.array([self.information(chosen) for chosen in part]))
            self._widths.update(zip(part, np.sqrt((found**2).mean(axis=-1)).tolist(), strict=True))
        return np.array([self._widths[chosen] for chosen in sets])

    def _others(self, chosen: Chosen) -> list[Chosen]:
        """Return a set with each further variant; a plan has one test of a scene, and of a factor."""
        taken = {(self.variants[v].candidate.scene, self.variants[v].candidate.factor) for v in chosen}
        groups = [(v.candidate.scene, v.candidate.factor) for v in self.variants]
        return [tuple(sorted((*chosen, v))) for v, group in enumerate(groups) if group not in taken]

    def pairs(self) -> list[Chosen]:
        """List all sets of at most two tests."""
        ones = self._others(())
        return [(), *ones, *dict.fromkeys(two for one in ones for two in self._others(one))]

    def _grown(self, chosen: Chosen) -> Iterator[Chosen]:
        """Add the best test, then exchange tests, while that narrows the width."""
        while options := self._others(chosen):
            widths = self.widths(options)
            if widths.min() > (1.0 - GAIN) * self.widths([chosen])[0]:
                return
            chosen = self._exchanged(options[int(widths.argmin())])
            yield chosen

    def _exchanged(self, chosen: Chosen) -> Chosen:
        for gone in chosen:
            options = self._others(tuple(v for v in chosen if v != gone))
            widths = self.widths(options)
            if widths.min() < (1.0 - AS_GOOD) * self.widths([chosen])[0]:
                return self._exchanged(options[int(widths.argmin())])
        return chosen

    def _front(self, pool: Sequence[Chosen]) -> list[Chosen]:
        """Return the sets of the least cost for what they buy: laboratory time first, then work."""
        works = [sum(self.variants[v].size.work for v in each) for each in pool]
        costs = [(self.minutes(each), work, len(each)) for each, work in zip(pool, works, strict=True)]
        front: list[Chosen] = []
        widths, best = self.widths(pool), np.inf
        for i in sorted(range(len(pool)), key=lambda i: (*costs[i], widths[i])):
            if widths[i] < (1.0 - AS_GOOD) * best:
                best = widths[i]
                front = [*(each for each in front if self.minutes(each) < costs[i][0]), pool[i]]
        return front

    def rows(self) -> list[Chosen]:
        """Return two or three sets worth doing, the cheapest first; empty where none buys anything.

        They are the first that buys something, the first nearly as good as the best, and one halfway.
        """
        front = self._front(self.pairs())
        starts = [front[-1], *front[:: max(1, len(front) // 4)]]
        front = self._front([*front, *(grown for chosen in starts for grown in self._grown(chosen))])
        widths = self.widths(front)
        worth = np.flatnonzero(widths <= (1.0 - GAIN) * widths[0])
        if not worth.size:
            return []
        limits = [np.inf, np.sqrt(widths[worth[0]] * widths[-1]), (1.0 + GAIN) * widths[-1]]
        kept = dict.fromkeys(int(worth[np.argmax(widths[worth] <= limit)]) for limit in limits)
        return [front[i] for i in kept]


@dataclass(frozen=True, eq=False)
class TestPlan:
    """The tests worth doing."""

    __test__ = False  # for pytest: not a test

    present: Present
    table: pd.DataFrame
    """Sets of tests (index ``tests``; the first is none): minutes, seconds, of each factor the 95 % half
    width over the value that holds at 90 % of the settings [%], left of the region [%], open (in words)."""
    chosen: tuple[tuple[Variant, ...], ...]
    """Tests of each set."""
    notes: tuple[str, ...]
    """Sentences on tests that buy nothing or could not be judged, and on what is assumed."""

    @property
    def sentence(self) -> str:
        """Say what to do next."""
        if len(self.table) == 1:
            return f"No candidate narrows what is known by {GAIN:.0%} or more."
        last, minutes = self.table.index[-1], self.table["minutes"].iloc[-1]
        widths = self.table[[factor.name for factor in self.present.factors]].iloc[[0, -1]].round().T
        narrowed = enumeration(
            f"{name} {then:.0f} % (now {now:.0f})" for name, now, then in widths.itertuples()
        )
        return f"Next test: {last} ({minutes:.0f} min). In 80 % of the cases this leaves {narrowed}."

    def to_dict(self) -> dict[str, Any]:
        """Return everything as JSON-able data."""
        facts = {"sentence": self.sentence, "share": self.present.share, "notes": list(self.notes)}
        return facts | {"rows": jsonable(self.table.reset_index())}


def make_plan(
    present: Present,
    surfaces: Mapping[Key, FittedSurface],
    unjudged: Mapping[str, str],
    candidates: Sequence[Candidate],
    sizes: Mapping[str, Sequence[Size]],
    settings: OptimumSettings,
) -> TestPlan:
    """Choose among candidates, given surfaces of their readings, and their sizes by name."""
    design, why = central_composite(present.factors, "face", 1), dict(unjudged)
    direct = {("", f): FactorSurface(design, f) for f in design.names}
    knowledge = Knowledge(present, {**surfaces, **direct})
    ranked = [each for each in candidates if knowledge.is_judged(each)]
    for each in candidates:
        if each not in ranked and not {one.response.name for one in each.readings} & set(why):
            why[each.name] = (
                "the factor was not kept" if each.factor else "it was not simulated: run dem-warp plan"
            )
    variants = [
        Variant(each, size, repeats)
        for each in ranked
        for size in sizes.get(each.name, (Size(),))
        for repeats in sorted(set(each.repeats))
    ]
    choice = Choice(knowledge, variants)
    sets = [(), *choice.rows()]
    chosen = tuple(tuple(variants[v] for v in each) for each in sets)
    table = pd.DataFrame([_row(choice, each, settings) for each in sets]).set_index("tests")
    apart = "No setting agrees with all that was measured: the plan is for all that was explored."
    notes = [apart] * (present.share == 0.0)
    notes += [said for each in ranked if each.scene and (said := _too_small(choice, each))]
    notes += [f"Not judged: {name}: {reason}." for name, reason in why.items()]
    notes += dict.fromkeys(f"{ASSUMED}: {text}." for each in ranked for text in each.assumed)
    return TestPlan(present, table, chosen, tuple(notes))


def _row(choice: Choice, chosen: Chosen, settings: OptimumSettings) -> dict[str, Any]:
    knowledge, information = choice.knowledge, choice.information(chosen)
    names = [factor.name for factor in knowledge.present.factors]
    vector, half_width = knowledge.least_known(information)
    direction = pd.Series([*vector, half_width], index=[*names, "span"])
    return {
        "tests": ", ".join(choice.variants[v].words for v in chosen) or "nothing more",
        "minutes": choice.minutes(chosen),
        "seconds": sum(choice.variants[v].size.seconds for v in chosen),
        **dict(zip(names, 100.0 * knowledge.promised(information), strict=True)),
        "left": 100.0 * knowledge.left(information),
        "open": direction_text(direction) if half_width > settings.unidentified_span else "",
    }


def _too_small(choice: Choice, candidate: Candidate) -> str:
    """Say which size would buy something where a candidate, at its largest, does not; else nothing."""
    own = [v for v in choice.variants if v.candidate is candidate]
    most, knowledge = max(own, key=lambda v: (v.size.growth, v.repeats)), choice.knowledge

    def left(times: float) -> float:
        added = knowledge.added(candidate, most.repeats, times * most.size.growth)
        return knowledge.left(knowledge.base + added)

    if left(1.0) <= NO_HELP:
        return ""
    said = f"{candidate.name} buys nothing" + f" with {most.size.grains:,} grains" * bool(most.size.grains)
    times = next((each for each in LARGER if left(each) <= WORTH), None)
    if times is None:
        return (
            f"{said}, nor would a larger one: it hardly depends on what is open, or its errors are too large."
        )
    return f"{said}: {times:g} times as many, or as long, would leave {left(times):.0%} of the region."
