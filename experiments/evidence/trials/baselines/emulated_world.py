"""An emulator in the place of the simulator, so that the statistics can be tried on a frozen bank.

Where the analysis has that very emulator, its errors never show. So a bank may be drawn from it with fresh
noise, and the analysis have the emulator of that; bent by what no polynomial follows, the first is never
quite in the reach of the second.
"""

from collections.abc import Mapping, Sequence
from functools import cache
from zlib import crc32

import numpy as np

from doe.discrepancy import (
    Bank,
    Emulator,
    Measured,
    Outcomes,
    Point,
    Settings,
    bank_points,
    fit_emulator,
    make_bank,
)
from experiments.discover.search import Search
from experiments.evidence.trials.generate_trials import STUDY, bank_beside
from experiments.studyfile import load_study

SCALE = "bench"
BEND = 0.3
"""Standard deviation of the part of the truth that no polynomial follows, in those of one run."""
REPLICATES = 8
"""Heaps a condition."""
BEND_LENGTH = 0.7
"""Length over which a bend changes, in half ranges: a polynomial follows the larger part of it."""
WAVES = 64
"""Cosines that a bend is the sum of."""


class EmulatedSimulator:
    """Answers points by the emulator's means and its noise.

    It shows whether the rules hold where the emulator is the truth, and not whether it is.

    Parameters
    ----------
    emulator : Emulator
        Its whole library; a search may know less of it.
    bend : float
        Standard deviation, in units of that of one run, of a smooth random function of the parameters that is
        added to the base and, times its size, to every mechanism.
    """

    def __init__(self, emulator: Emulator, bend: float = 0.0) -> None:
        names = [""] * (max(emulator.columns) + 1)
        for name, column in zip(emulator.observables, emulator.columns, strict=True):
            names[column] = name
        self.emulator = emulator
        self.bend = bend
        self.observables = tuple(names)

    def __call__(self, points: Sequence[Point]) -> Outcomes:
        """Observables of every point, scattered by its seed."""
        values = np.zeros((len(points), len(self.observables)))
        for row, point in enumerate(points):
            values[row, list(self.emulator.columns)] = self._run(point)
        return Outcomes(values, ("",) * len(points))

    def _run(self, point: Point) -> np.ndarray:
        space, surfaces = self.emulator.space, self.emulator.surfaces[point.condition]
        theta = space.coded_theta(np.array(point.theta))
        sizes = [space.coded_size(name, size) for name, size in point.sizes]
        names = tuple(name for name, _ in point.sizes)
        x = np.array([*theta, *sizes])
        triangle = np.linalg.cholesky(surfaces.noise_covariance(x, names))
        scatter = triangle @ np.random.default_rng(point.seed).standard_normal(len(triangle))
        return np.asarray(surfaces.predict(x[None], names)[0] + self._bent(theta, point) + scatter)

    def _bent(self, theta: np.ndarray, point: Point) -> np.ndarray:
        space = self.emulator.space
        surfaces = self.emulator.surfaces[point.condition]
        bent = _waves(point.condition, "", theta, self.emulator.observables) * ~surfaces.silent
        for name, size in point.sizes:
            coded = space.coded_size(name, size)
            # Sizes run from 0 to 1, factors from -1 to 1.
            at = np.append(theta, 2.0 * coded - 1.0)
            waves = _waves(point.condition, name, at, self.emulator.observables)
            bent = bent + coded * waves * ~surfaces.additions[name].silent
        return np.asarray(self.bend * np.sqrt(surfaces.noise.variance(np.zeros_like(theta))) * bent)


@cache
def true_world() -> tuple[EmulatedSimulator, Settings]:
    """Return the simulator that stands for reality, and the rules of its study."""
    search = Search.of(load_study(STUDY, SCALE))
    return EmulatedSimulator(fit_emulator(search.read_bank(bank_beside(SCALE))), BEND), search.settings


def fresh_runs(points: Sequence[Point]) -> Outcomes:
    """Observables of points in the true world, as an analysis may ask for them."""
    return true_world()[0](points)


def _waves(condition: str, mechanism: str, at: np.ndarray, observables: tuple[str, ...]) -> np.ndarray:
    """Smooth random functions of variance 1 at one point, (observables,); the same in every process."""
    vectors, phases = _cosines(f"{condition} {mechanism}", len(at), len(observables))
    return np.asarray(np.sqrt(2.0 / WAVES) * np.cos(vectors @ at + phases).sum(axis=1))


@cache
def _cosines(title: str, parameters: int, observables: int) -> tuple[np.ndarray, np.ndarray]:
    """Wave vectors (observables, waves, parameters) and phases of a squared-exponential covariance."""
    rng = np.random.default_rng(crc32(title.encode()))
    vectors = rng.standard_normal((observables, WAVES, parameters)) / BEND_LENGTH
    return vectors, rng.uniform(0.0, 2.0 * np.pi, (observables, WAVES))


def redrawn_bank(simulator: EmulatedSimulator, settings: Settings, seed: int) -> Bank:
    """Bank of the library waves, as an emulated world answers them."""
    space = simulator.emulator.space
    points = bank_points(space, settings, seed)
    return make_bank(space, simulator.observables, points, simulator(points))


def emulated_heaps(
    simulator: EmulatedSimulator,
    theta: Sequence[float],
    sizes: Mapping[str, float],
    replicates: int,
    seed: int,
    systematic: float = 0.0,
) -> Measured:
    """Measured heaps of every condition in an emulated world.

    Factors `theta` and `sizes` of mechanisms are in natural units. `systematic` is the standard deviation, in
    units of that of one run, of what shifts all replicates of a condition alike.
    """
    emulator = simulator.emulator
    rng, shifts = np.random.default_rng(seed), np.random.default_rng([seed, 1])
    hidden = tuple(sorted(sizes.items()))
    values = {}
    for condition in emulator.space.conditions:
        seeds = rng.integers(2**31, size=replicates)
        points = [Point(tuple(theta), hidden, condition, int(number)) for number in seeds]
        variance = emulator.surfaces[condition].noise.variance(emulator.space.coded_theta(np.array(theta)))
        shift = systematic * np.sqrt(variance) * shifts.standard_normal(len(variance))
        values[condition] = simulator(points).values[:, list(emulator.columns)] + shift
    return Measured(emulator.space.conditions, emulator.observables, values)
