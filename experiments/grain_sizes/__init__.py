"""Sizes of grains as they are measured: sieves, image analysers, distributions; and classes of them."""

from experiments.grain_sizes.classes import Classes, cut_classes
from experiments.grain_sizes.diameters import DIAMETERS
from experiments.grain_sizes.distribution import Continuous, Distribution, Tabulated
from experiments.grain_sizes.tables import read_counts, read_sieves

__all__ = [
    "DIAMETERS",
    "Classes",
    "Continuous",
    "Distribution",
    "Tabulated",
    "cut_classes",
    "read_counts",
    "read_sieves",
]
