"""A synthetic world for the statistics: known quadratic responses, correlated noise, known mechanisms."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from doe import discrepancy
from doe.discrepancy import Bank, Measured, MechanismRange, Outcomes, Point, SearchSpace, bank_points

OBSERVABLES = (
    "flank_angle", "concavity", "height", "r50", "r90", "asymmetry",
    "rolled_fraction", "fill_height", "wall_drag", "t75", "t55", "centre_height",
)  # fmt: skip
CONDITIONS = ("base", "fast", "wide", "rough", "fast-wide")
MECHANISMS = ("alpha", "beta", "gamma", "delta", "epsilon", "zeta", "twin")
BLENDED = ("alpha", "delta")
"""Mechanisms that ``blend`` acts as, both of its size."""
BEYOND = 0.45
"""Standard deviation of what it does besides, in that of one run at its largest size."""
SATURATION = 0.3
"""Saturation of ``alpha``, in a range of 2: the first third has nearly the whole effect."""
SETTINGS = discrepancy.Settings(bank_points=128, bank_mechanism_points=64)


def space(mechanisms: Sequence[str] = MECHANISMS) -> SearchSpace:
    """Three factors, five conditions of which the last is held out."""
    return SearchSpace(
        ("mu", "mu_wall", "restitution"),
        (0.1, 0.1, 0.2),
        (0.9, 0.7, 0.8),
        CONDITIONS,
        tuple(name == "fast-wide" for name in CONDITIONS),
        tuple(MechanismRange(name, 0.0, 2.0) for name in mechanisms),
    )


@dataclass(frozen=True, eq=False)
class SyntheticSimulator:
    """Quadratic responses in coded units, in units of the noise, times an observable's own scale.

    ``twin`` acts as ``alpha`` does, but for one part in a hundred; ``blend`` nearly as ``alpha`` and
    ``delta`` do together; ``outsider`` is in no library.
    """

    space: SearchSpace
    noise: float = 1.0
    observables: tuple[str, ...] = OBSERVABLES

    def __call__(self, points: Sequence[Point]) -> Outcomes:
        values = np.array([self._run(point) for point in points]).reshape(len(points), len(self.observables))
        return Outcomes(values, ("",) * len(points))

    def mean(self, theta: Sequence[float], sizes: Mapping[str, float], condition: str) -> np.ndarray:
        """Return expected observables, (observables,)."""
        coded = self.space.coded_theta(np.array(theta))
        linear, curved = _base(condition)
        total = (
            3.0 * np.arange(1, len(OBSERVABLES) + 1)
            + coded @ linear
            + np.outer(coded, coded).ravel() @ curved
        )
        for name, size in sizes.items():
            g = size / 2.0
            direct, turned = _signature(name, condition)
            total = total + g * (1.0 + 0.15 * g) * direct + g * coded @ turned
        return total * SCALES

    def _run(self, point: Point) -> np.ndarray:
        rng = np.random.default_rng(point.seed)
        scatter = _triangle() @ rng.standard_normal(len(OBSERVABLES))
        return self.mean(point.theta, dict(point.sizes), point.condition) + self.noise * scatter * SCALES


SCALES = np.geomspace(0.01, 10.0, len(OBSERVABLES))


@cache
def _triangle() -> np.ndarray:
    rng = np.random.default_rng(7)
    loading = rng.standard_normal((len(OBSERVABLES), 3)) * 0.8
    covariance = loading @ loading.T + np.eye(len(OBSERVABLES))
    sd = np.sqrt(np.diag(covariance))
    return np.linalg.cholesky(covariance / np.outer(sd, sd))


@cache
def _base(condition: str) -> tuple[np.ndarray, np.ndarray]:
    common, own = np.random.default_rng(11), np.random.default_rng([12, CONDITIONS.index(condition)])
    size = (3, len(OBSERVABLES))
    linear = 4.0 * common.standard_normal(size) + 1.5 * own.standard_normal(size)
    curved = 0.7 * common.standard_normal((9, size[1])) + 0.3 * own.standard_normal((9, size[1]))
    return linear, curved


@cache
def _signature(name: str, condition: str) -> tuple[np.ndarray, np.ndarray]:
    if name == "twin":
        direct, turned = _signature("alpha", condition)
        nudge = np.random.default_rng([15, CONDITIONS.index(condition)]).standard_normal(len(OBSERVABLES))
        return direct + 0.05 * nudge, turned
    if name == "blend":
        parts = [_signature(part, condition) for part in BLENDED]
        nudge = np.random.default_rng([18, CONDITIONS.index(condition)]).standard_normal(len(OBSERVABLES))
        return sum(direct for direct, _ in parts) + BEYOND * nudge, sum(turned for _, turned in parts)
    number = (*MECHANISMS, "outsider").index(name)
    common = np.random.default_rng([13, number])
    own = np.random.default_rng([14, number, CONDITIONS.index(condition)])
    # Mechanisms act through a few ways to change the observables, so their signatures are alike.
    ways = _ways(condition)
    size = len(OBSERVABLES)
    direct = 2.0 * common.standard_normal(len(ways)) @ ways + 0.8 * own.standard_normal(size)
    return direct, 0.4 * common.standard_normal((3, size))


@cache
def _ways(condition: str) -> np.ndarray:
    common, own = np.random.default_rng(16), np.random.default_rng([17, CONDITIONS.index(condition)])
    size = (4, len(OBSERVABLES))
    return common.standard_normal(size) + 0.5 * own.standard_normal(size)


@cache
def bank(mechanisms: tuple[str, ...] = MECHANISMS) -> Bank:
    """Return the bank of the synthetic world."""
    points = bank_points(space(mechanisms), SETTINGS, seed=1)
    simulator = SyntheticSimulator(space(mechanisms))
    return discrepancy.make_bank(space(mechanisms), OBSERVABLES, points, simulator(points))


@cache
def emulator(mechanisms: tuple[str, ...] = MECHANISMS) -> discrepancy.Emulator:
    """Return the emulator of the synthetic world's bank."""
    return discrepancy.fit_emulator(bank(mechanisms))


def measure(
    sizes: Mapping[str, float],
    seed: int,
    theta: Sequence[float] | None = None,
    replicates: int = 5,
    conditions: Sequence[str] = CONDITIONS,
    noise: float = 1.0,
) -> Measured:
    """Replicates of every condition with mechanisms of natural sizes at random (or given) factors."""
    rng = np.random.default_rng([seed, 99])
    simulator = SyntheticSimulator(space(), noise)
    if theta is None:
        theta = tuple(simulator.space.natural_theta(rng.uniform(-0.9, 0.9, 3)))
    values = {}
    for condition in conditions:
        seeds = rng.integers(2**31, size=replicates)
        points = [Point(tuple(theta), tuple(sorted(sizes.items())), condition, int(s)) for s in seeds]
        values[condition] = simulator(points).values
    return Measured(tuple(conditions), OBSERVABLES, values)


class Saturating(SyntheticSimulator):
    """The synthetic world with an ``alpha`` that saturates."""

    def __call__(self, points: Sequence[Point]) -> Outcomes:
        evened = MechanismRange("alpha", 0.0, 2.0, saturation=SATURATION)
        seen = [
            replace(point, sizes=tuple((name, 2.0 * evened.coded(size)) for name, size in point.sizes))
            for point in points
        ]
        return super().__call__(seen)


def saturating_bank() -> tuple[Saturating, Bank]:
    """Return a bank of that world, of sizes all over the range, which knows nothing of it."""
    world = Saturating(space(("alpha",)))
    points = bank_points(world.space, SETTINGS, seed=5)
    return world, discrepancy.make_bank(world.space, OBSERVABLES, points, world(points))
