"""The protocol of a method: what it is given of a trial, and what it answers."""

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

import numpy as np

from doe.discrepancy import Emulator, Measured, Settings
from doe.discrepancy.fitting.fitted_model import Model, Stack
from doe.discrepancy.fitting.measured_means import Block, Evidence, gather
from doe.discrepancy.fitting.model_fit import Fitted, fit
from experiments.io.errors import InputError

LEVEL = 0.025
"""Probability of a false alarm that methods with p values declare: that of the search."""
ODDS = 20.0
"""Odds from which on methods with Bayes factors raise an alarm or name: *strong* (Kass and Raftery 1995)."""
SIZES = (0.25, 0.75)
"""Coded sizes that fits of a mechanism start from."""
PAIRS = 4
"""Pairs of mechanisms that are fitted: those that the residuals of the single ones promise most of."""

Mechanisms = tuple[str, ...]


@dataclass(frozen=True)
class Answer:
    """Answer of a method to one trial."""

    score: float
    """Score of the alarm: the larger, the surer that something is missing."""
    alarm: bool
    """Alarm at the method's declared level."""
    named: Mechanisms = ()
    """Mechanisms that it names, sorted; without an alarm none."""
    tied: bool = False
    """They are rivals, of which one is right."""
    unknown: bool = False
    """It says that what is missing is not in the library."""
    outside: float = math.nan
    """Score of that: the larger, the surer; NaN where the method has none."""

    def __post_init__(self) -> None:
        if (self.named or self.unknown) and not self.alarm:
            raise InputError("Answer", "names nothing, and says not unknown, without an alarm", self.named)
        if self.named and self.unknown:
            raise InputError("Answer", "names what is missing, or says that it is unknown", self.named)


@dataclass(frozen=True, eq=False)
class Problem:
    """One trial as every method sees it; fits of models are kept for the next method."""

    trial: str
    emulator: Emulator
    """Mechanisms of the bank, without what is withheld."""
    measured: Measured
    settings: Settings
    """Settings of the search; from these the others take the systematic part of the errors."""
    seed: int
    """Seed of a method's own draws."""
    _fits: dict[Mechanisms, Fitted] = field(default_factory=dict, init=False, repr=False)

    @cached_property
    def evidence(self) -> Evidence:
        """Measured means, cut to what the emulator knows."""
        return gather(self.measured, self.emulator)

    @property
    def blocks(self) -> tuple[Block, ...]:
        """Means of all conditions; that some are held out is a rule of the search alone."""
        return (*self.evidence.training, *self.evidence.held_out)

    def stack(self, mechanisms: Mechanisms) -> Stack:
        """Return a model against all means."""
        systematic = self.settings.systematic
        return Stack(Model(self.emulator, mechanisms, systematic, views=self.evidence.views), self.blocks)

    @property
    def key(self) -> tuple[object, ...]:
        """Library, bank and number of means: trials that have them alike share what was learned."""
        stack = self.stack(())
        center = stack.model.predict(np.zeros((1, len(stack.model.lower))), stack.blocks[0].condition)
        return self.emulator.space.names, float(center.sum()), len(stack.target)

    def fitted(self, mechanisms: Mechanisms = ()) -> Fitted:
        """Return a model at its largest likelihood."""
        if mechanisms not in self._fits:
            starts = None
            if mechanisms:
                factors = len(self.emulator.space.factors)
                base = self.fitted(mechanisms[:-1]).x
                starts = np.array([[*base, size] for size in SIZES]).reshape(
                    len(SIZES), factors + len(mechanisms)
                )
            self._fits[mechanisms] = fit(self.stack(mechanisms), starts, count=2)
        return self._fits[mechanisms]

    @property
    def singles(self) -> tuple[Mechanisms, ...]:
        """Models of one mechanism."""
        return tuple((name,) for name in self.emulator.space.names)

    @cached_property
    def pairs(self) -> tuple[Mechanisms, ...]:
        """Models of two mechanisms that promise most: those of the best single ones, by their scores."""
        order = sorted(self.singles, key=lambda one: self.fitted(one).score)
        best = [name for (name,) in order]
        ranked = [(i + j, tuple(sorted((best[i], best[j])))) for j in range(len(best)) for i in range(j)]
        return tuple(pair for _, pair in sorted(ranked)[:PAIRS])

    @property
    def models(self) -> tuple[Mechanisms, ...]:
        """The base, every mechanism, and some pairs."""
        return ((), *self.singles, *self.pairs)


class Method(Protocol):
    """A way to criticise a model."""

    @property
    def name(self) -> str:
        """Word for it in tables."""

    @property
    def source(self) -> str:
        """Publication that it follows."""

    @property
    def level(self) -> str:
        """Level at which it raises an alarm, in words."""

    def __call__(self, problem: Problem) -> Answer:
        """Answer one trial."""
