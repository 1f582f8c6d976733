"""Formulas of the bench, the same for readings of real grains and of simulated ones."""

import math
from typing import TypeVar

import numpy as np

Number = TypeVar("Number", float, np.ndarray)


def rebound(fall: float, height: Number) -> Number:
    """Return the restitution of a grain that falls and rises by some heights."""
    return (height / fall) ** 0.5


def rolling_run(slope: float, distance: float, run: Number) -> Number:
    """Return the rolling friction of a grain that rolls a distance down a slope [rad], and on by a run."""
    return distance * math.sin(slope) / (distance * math.cos(slope) + run)
