"""An emulator in the place of the simulator, so that the statistics can be tried on a frozen bank."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from experiments.discover.emulator import Emulator
from experiments.discover.measured import Measured
from experiments.discover.simulator import Outcomes, Point


class EmulatedSimulator:
    """Answers points by the emulator's means and its noise.

    It shows whether the rules hold where the emulator is the truth, and not whether it is.

    Parameters
    ----------
    emulator : Emulator
        Its whole library; a search may know less of it.
    """

    def __init__(self, emulator: Emulator) -> None:
        names = [""] * (max(emulator.columns) + 1)
        for name, column in zip(emulator.observables, emulator.columns, strict=True):
            names[column] = name
        self.emulator = emulator
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
        return np.asarray(surfaces.predict(x[None], names)[0] + scatter)


def emulated_heaps(
    emulator: Emulator,
    theta: Sequence[float],
    sizes: Mapping[str, float],
    replicates: int,
    seed: int,
    systematic: float = 0.0,
) -> Measured:
    """Measured heaps of every condition in an emulated world.

    Parameters
    ----------
    emulator : Emulator
    theta : sequence of float
        Factors in natural units.
    sizes : mapping
        Mechanisms with their sizes in natural units.
    replicates, seed : int
    systematic : float
        Standard deviation, in units of that of one run, of what shifts all replicates of a condition alike.
    """
    simulator = EmulatedSimulator(emulator)
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
