"""Drawing the hidden truths of the trials."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from itertools import combinations

import numpy as np

from doe import Factor
from experiments.evidence.trials.findings import EVERYTHING, VIEWS
from experiments.evidence.trials.truth import Kind, Label, Sealed
from experiments.io.errors import InputError

STRONG = 1.5
"""Sizes above this many detectable ones are to be named."""

WEAK = 0.3
"""Least size of a weak trial, in detectable ones."""

UPPER = 0.5
"""Effects outside the library have at least this part of their range."""


@dataclass(frozen=True)
class Plan:
    """Numbers of trials of each kind, and of heaps that each has."""

    nulls: int = 100
    """With nothing hidden."""
    strong: int = 15
    weak: int = 4
    """A resolvable mechanism: above 1.5 detectable sizes, and between 0.3 and 1.5."""
    unresolved: int = 3
    """A mechanism that was declared not resolvable, anywhere in its range."""
    withheld: int = 5
    """A resolvable mechanism, strong, which the analysis must do without."""
    outside: int = 7
    """An effect that the library never has."""
    pairs: int = 30
    """Trials of two resolvable mechanisms, both strong."""
    replicates: int = 8
    """Heaps a condition."""
    mechanisms: tuple[str, ...] = ()
    """Those of the library that are hidden; none: all. The analysis knows the whole library."""
    view: str = EVERYTHING
    """View whose detectable sizes are declared: what is strong is counted in what it shows."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "mechanisms", tuple(self.mechanisms))  # a list, where it comes from a file
        if self.view not in VIEWS:
            raise InputError("Plan.view", f"must be one of {', '.join(VIEWS)}", self.view)
        for field in fields(self):
            if field.name in ("mechanisms", "view"):
                continue
            least = 2 if field.name == "replicates" else 0
            if (count := getattr(self, field.name)) < least:
                raise InputError(f"Plan.{field.name}", f"is at least {least}", count)


@dataclass(frozen=True)
class Declared:
    """A mechanism with what was declared of it."""

    name: str
    null: float
    maximum: float
    """Its range."""
    detectable: float = math.inf
    """Distance from the null that is found and distinguished from every other with 80 % probability; infinite
    where the range has no such size."""
    told_apart: bool = True
    """True if the data tell it, at the end of its range, from every other, nearly everywhere in the ranges of
    the factors."""
    kin: tuple[str, ...] = ()
    """Mechanisms that look like it after calibration."""

    @property
    def strongest(self) -> float:
        """Size at the end of the range, in detectable ones."""
        return abs(self.maximum - self.null) / self.detectable

    @property
    def resolvable(self) -> bool:
        """True if it may be named: it is distinct, and its range has strong sizes."""
        return self.told_apart and self.strongest > STRONG

    def size(self, multiple: float) -> float:
        """Size of a multiple of the detectable one."""
        return self.null + math.copysign(multiple * self.detectable, self.maximum - self.null)


@dataclass(frozen=True)
class _Draft:
    """A truth before it has a place among the others."""

    part: str
    kind: Kind
    sizes: tuple[tuple[str, float], ...] = ()
    multiples: tuple[float, ...] = ()
    withheld: tuple[str, ...] = ()


def draw(
    plan: Plan,
    factors: Sequence[Factor],
    library: Sequence[Declared],
    outside: Sequence[Declared],
    rng: np.random.Generator,
    salt: Callable[[], str],
) -> tuple[tuple[Label, Sealed], ...]:
    """Draw every trial.

    Theta is uniform in the ranges of the factors, the size of a mechanism in its own part of its range.
    Within each part ("alone", "outside", "pairs") the trials are shuffled, so that a name says nothing. The
    analysis knows the mechanisms of the library, and never those outside it.
    """
    if foreign := set(plan.mechanisms) - {effect.name for effect in library}:
        raise InputError("Plan.mechanisms", "must be mechanisms of the library", sorted(foreign))
    library = [effect for effect in library if not plan.mechanisms or effect.name in plan.mechanisms]
    drafts = [*_alone(plan, library, rng), *_outside(plan, library, outside, rng)]
    drafts += _pairs(plan, [effect for effect in library if effect.resolvable], rng)
    trials = []
    for part in dict.fromkeys(draft.part for draft in drafts):
        members = [draft for draft in drafts if draft.part == part]
        for number, index in enumerate(rng.permutation(len(members)), start=1):
            name = f"{part}-{number:03d}"
            trials.append(_sealed(name, members[index], factors, rng, salt()))
    return tuple(trials)


def _sealed(
    name: str, draft: _Draft, factors: Sequence[Factor], rng: np.random.Generator, salt: str
) -> tuple[Label, Sealed]:
    theta = tuple(float(rng.uniform(factor.low, factor.high)) for factor in factors)
    seed = int(rng.integers(2**31))
    label = Label(name, draft.kind, theta, draft.sizes, draft.multiples, seed, salt)
    return label, Sealed(name, draft.part, draft.withheld, label.hash)


def _alone(plan: Plan, library: Sequence[Declared], rng: np.random.Generator) -> Iterator[_Draft]:
    """Nothing hidden, or one mechanism of the library."""
    yield from (_Draft("alone", Kind.NULL) for _ in range(plan.nulls))
    for effect in library:
        if effect.resolvable:
            yield from (_strong("alone", Kind.SINGLE, effect, rng) for _ in range(plan.strong))
            for _ in range(plan.weak):
                yield _of("alone", Kind.SINGLE, effect, rng.uniform(WEAK, STRONG))
        else:
            for _ in range(plan.unresolved):
                yield _somewhere("alone", Kind.UNRESOLVED, effect, rng, 0.0)


def _outside(
    plan: Plan, library: Sequence[Declared], outside: Sequence[Declared], rng: np.random.Generator
) -> Iterator[_Draft]:
    """Trials of what the analysis does not have in its library."""
    for effect in library:
        if effect.resolvable:
            for _ in range(plan.withheld):
                draft = _strong("outside", Kind.WITHHELD, effect, rng)
                yield replace(draft, withheld=tuple(sorted({effect.name, *effect.kin})))
    for effect in outside:
        yield from (_somewhere("outside", Kind.OUTSIDE, effect, rng, UPPER) for _ in range(plan.outside))


def _pairs(plan: Plan, resolvable: Sequence[Declared], rng: np.random.Generator) -> Iterator[_Draft]:
    """Two mechanisms that can be distinguished."""
    partners = [(one, other) for one, other in combinations(resolvable, 2) if other.name not in one.kin]
    if plan.pairs and not partners:
        raise InputError("Plan.pairs", "pairs need two resolvable mechanisms", [e.name for e in resolvable])
    for _ in range(plan.pairs):
        chosen = partners[rng.integers(len(partners))]
        halves = [_strong("pairs", Kind.PAIR, effect, rng) for effect in chosen]
        drawn = sorted((half.sizes[0], half.multiples[0]) for half in halves)
        yield _Draft("pairs", Kind.PAIR, tuple(size for size, _ in drawn), tuple(s for _, s in drawn))


def _strong(part: str, kind: Kind, effect: Declared, rng: np.random.Generator) -> _Draft:
    """Draw an effect above the limit, uniform in its logarithm: as many close above it as far from it."""
    return _of(part, kind, effect, float(np.exp(rng.uniform(np.log(STRONG), np.log(effect.strongest)))))


def _somewhere(part: str, kind: Kind, effect: Declared, rng: np.random.Generator, least: float) -> _Draft:
    size = effect.null + rng.uniform(least, 1.0) * (effect.maximum - effect.null)
    multiple = abs(size - effect.null) / effect.detectable
    return _Draft(part, kind, ((effect.name, float(size)),), (float(multiple),))


def _of(part: str, kind: Kind, effect: Declared, multiple: float) -> _Draft:
    return _Draft(part, kind, ((effect.name, float(effect.size(multiple))),), (float(multiple),))
