"""An emulator in the place of the simulator: heaps and fresh runs of a world that it knows."""

from collections.abc import Mapping, Sequence

import numpy as np

from doe.discrepancy import Emulator, Measured, Outcomes, Point


class EmulatedSimulator:
    """Answers points by an emulator's means and its noise."""

    def __init__(self, emulator: Emulator) -> None:
        names = [""] * (max(emulator.columns) + 1)
        for name, column in zip(emulator.observables, emulator.columns, strict=True):
            names[column] = name
        self.emulator, self.observables = emulator, tuple(names)

    def __call__(self, points: Sequence[Point]) -> Outcomes:
        values = np.zeros((len(points), len(self.observables)))
        for row, point in enumerate(points):
            values[row, list(self.emulator.columns)] = self._run(point)
        return Outcomes(values, ("",) * len(points))

    def _run(self, point: Point) -> np.ndarray:
        space, surfaces = self.emulator.space, self.emulator.surfaces[point.condition]
        sizes = [space.coded_size(name, size) for name, size in point.sizes]
        names = tuple(name for name, _ in point.sizes)
        x = np.array([*space.coded_theta(np.array(point.theta)), *sizes])
        triangle = np.linalg.cholesky(surfaces.noise_covariance(x, names))
        scatter = triangle @ np.random.default_rng(point.seed).standard_normal(len(triangle))
        return np.asarray(surfaces.predict(x[None], names)[0] + scatter)


def emulated_heaps(
    simulator: EmulatedSimulator,
    theta: Sequence[float],
    sizes: Mapping[str, float],
    replicates: int,
    seed: int,
) -> Measured:
    """Measured heaps of every condition; factors and sizes of mechanisms are in natural units."""
    emulator, rng = simulator.emulator, np.random.default_rng(seed)
    hidden, values = tuple(sorted(sizes.items())), {}
    for condition in emulator.space.conditions:
        seeds = rng.integers(2**31, size=replicates)
        points = [Point(tuple(theta), hidden, condition, int(number)) for number in seeds]
        values[condition] = simulator(points).values[:, list(emulator.columns)]
    return Measured(emulator.space.conditions, emulator.observables, values)
