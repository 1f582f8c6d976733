"""Size classes of a distribution, with the same numbers and mass of grains."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from experiments.grains.sizes.distribution import Distribution

Basis = Literal["number", "volume", "mass"]
"""Quantity of a distribution's shares; volume and mass are the same, as all grains have one density."""

LEAST_APART = 1e-9
"""Relative difference of diameters below which classes are joined."""


@dataclass(frozen=True)
class Classes:
    """Classes of a distribution."""

    diameters: tuple[float, ...]
    """Diameter of the grain of mean mass of each, rising [m]."""
    fractions: tuple[float, ...]
    """Part of the number of grains of each; the sum is 1."""
    mass_lost: float
    """Part of the mass beyond the cuts, or without a diameter in the table."""

    @property
    def mean_mass_diameter(self) -> float:
        """Diameter of the grain of mean mass of all [m]."""
        return float(np.cbrt(np.dot(self.fractions, np.power(self.diameters, 3))))

    @property
    def summary(self) -> str:
        """Number and range of the classes, and the mass that is left out."""
        low, high = 1e3 * self.diameters[0], 1e3 * self.diameters[-1]
        return (
            f"{len(self.diameters)} classes from {low:.4g} to {high:.4g} mm; {100.0 * self.mass_lost:.3g} % "
            "of the mass is beyond the cuts and left out"
        )


def cut_classes(
    distribution: Distribution,
    basis: Basis,
    cut: tuple[float, float],
    count: int,
    unaccounted: float = 0.0,
) -> Classes:
    """Cut a distribution at two quantiles, and divide the rest into classes of equal shares.

    The number and the volume of the grains of each class are those of the distribution: its diameter is that
    of the grain of mean mass. `basis` is the quantity of the shares and quantiles, `unaccounted` the part of
    the whole that is not in the distribution: what passes the finest sieve, or stays on the coarsest. A
    diameter that is not positive raises `ValueError`.
    """
    edges = np.linspace(*cut, count + 1)
    if not distribution.quantile(edges[0] or 1e-12) > 0.0:
        raise ValueError(f"the sizes at the lower cut, {cut[0]:g}, must be positive: raise it")
    numbers, volumes = [], []
    for low, high in pairwise(edges):
        own, other = high - low, distribution.moment(3 if basis == "number" else -3, low, high)
        numbers.append(own if basis == "number" else other)
        volumes.append(other if basis == "number" else own)
    diameters, parts = _joined(np.array(numbers), np.array(volumes))
    kept = cut[1] - cut[0] if basis != "number" else sum(volumes) / distribution.moment(3, 0.0, 1.0)
    mass_lost = 1.0 - (1.0 - unaccounted) * kept
    return Classes(tuple(diameters.tolist()), tuple(parts.tolist()), float(max(mass_lost, 0.0)))


def _joined(numbers: np.ndarray, volumes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return diameters and parts of the number of classes; classes of one diameter are joined."""
    diameters = np.cbrt(volumes / numbers)
    first = np.concatenate([[True], np.diff(diameters) > LEAST_APART * diameters[1:]])
    starts = np.flatnonzero(first)
    numbers, volumes = np.add.reduceat(numbers, starts), np.add.reduceat(volumes, starts)
    return np.cbrt(volumes / numbers), numbers / numbers.sum()
