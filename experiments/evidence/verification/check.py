"""Results of a verification problem for the page: rows with a verdict, curves, and words."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike


@dataclass(frozen=True)
class Row:
    """One number against its reference."""

    problem: str
    case: str
    quantity: str
    """Simulated test, its settings, and the quantity (with its unit)."""
    reference: str
    """Source of the expected value."""
    expected: float
    simulated: float
    error: float
    """Relative to the expected value, or in the quantity's unit where `relative` is false."""
    tolerance: float | None
    """Largest error that passes; None where the number is only stated."""
    relative: bool = True

    @property
    def passed(self) -> bool | None:
        """Verdict; None for a number that is only stated. An error that is not a number fails."""
        return None if self.tolerance is None else bool(self.error <= self.tolerance)


Labels = tuple[str, str, str, str]
"""Problem, case, quantity and reference of a row."""


def relative_row(labels: Labels, expected: ArrayLike, simulated: ArrayLike, tolerance: float | None) -> Row:
    """Row of the worst of several values, relative to each expected value."""
    return _worst_row(labels, expected, simulated, tolerance, np.abs(expected))


def absolute_row(labels: Labels, expected: ArrayLike, simulated: ArrayLike, tolerance: float | None) -> Row:
    """Row of the worst of several values, whose error is in the quantity's own unit."""
    return replace(_worst_row(labels, expected, simulated, tolerance, 1.0), relative=False)


def _worst_row(
    labels: Labels, expected: ArrayLike, simulated: ArrayLike, tolerance: float | None, scale: ArrayLike
) -> Row:
    """Row of the largest error over a scale; one that is not a number is worse than any."""
    arrays = (np.atleast_1d(np.asarray(values, dtype=float)) for values in (expected, simulated, scale))
    want, got, scales = np.broadcast_arrays(*arrays)
    errors = np.abs(got - want) / scales
    worst = np.unravel_index(int(np.argmax(np.where(np.isnan(errors), np.inf, errors))), errors.shape)
    return Row(*labels, float(want[worst]), float(got[worst]), float(errors[worst]), tolerance)


def order_row(
    problem: str, case: str, quantity: str, steps: ArrayLike, errors: ArrayLike, expected: float, least: float
) -> Row:
    """Row of an order of convergence: the slope of errors against steps, at least `least`."""
    slope = -float(np.polyfit(np.log(np.asarray(steps, float)), np.log(np.asarray(errors, float)), 1)[0])
    shortfall = max(expected - slope, 0.0)
    reference = f"order {expected:g} of the scheme, {least:g} at the least"
    return Row(
        problem, case, quantity, reference, expected, slope, shortfall, expected - least, relative=False
    )


def detection_row(problem: str, case: str, quantity: str, least: float, simulated: float) -> Row:
    """Row of something that must be seen, as a wrong law: the simulated number must reach `least`."""
    short = max(least - simulated, 0.0)
    return Row(problem, case, quantity, "at the least", least, simulated, short, 0.0, relative=False)


@dataclass(frozen=True)
class Curve:
    """One curve of a plot."""

    label: str
    x: np.ndarray
    y: np.ndarray
    style: Literal["line", "dashed", "points"] = "line"
    colour: int | None = None
    """Curves of one number share a colour; by default each has its own."""


@dataclass(frozen=True)
class Plot:
    """Curves over one pair of axes."""

    name: str
    """Stem of its files."""
    title: str
    x: str
    y: str
    curves: tuple[Curve, ...]
    logarithmic: bool = False
    """Both axes."""


@dataclass(frozen=True)
class Result:
    """Everything that one problem gave."""

    title: str
    text: str
    """Markdown: what is asked, by which sources, and how an error is to be read."""
    rows: tuple[Row, ...]
    plots: tuple[Plot, ...] = ()


Problem = Callable[[str], Result]
"""A family of comparisons with closed forms or published numbers, run on a device."""
