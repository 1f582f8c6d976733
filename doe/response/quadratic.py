"""Fitted surfaces as c + b'x + x'Bx in coded units: values, gradients, roots along an axis."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from doe.design.design import Design
from doe.design.polynomial_terms import Term, term_name
from doe.errors import DesignError


@dataclass(frozen=True, eq=False)
class QuadraticForm:
    """A polynomial of second degree."""

    constant: float
    slopes: NDArray[np.float64]
    """b, shape (factors,)."""
    matrix: NDArray[np.float64]
    """B, symmetric, shape (factors, factors)."""

    @classmethod
    def of(
        cls, names: Sequence[str], terms: Iterable[Term], coefficients: Iterable[float]
    ) -> "QuadraticForm":
        """Return the form of a coded polynomial; the coefficients start with the intercept's.

        Raises DesignError: a term of third or higher degree.
        """
        terms = tuple(terms)
        higher = [term_name(term) for term in terms if len(term) > 2]
        if higher:
            raise DesignError(
                f"a model with contours, regions, stationary points must be of second degree, got {higher[0]}"
            )
        constant, *others = coefficients
        slopes, matrix = np.zeros(len(names)), np.zeros((len(names), len(names)))
        for term, value in zip(terms, others, strict=True):
            index = [names.index(name) for name in term]
            if len(index) == 1:
                slopes[index[0]] = value
            else:
                matrix[index[0], index[1]] += 0.5 * value
                matrix[index[1], index[0]] += 0.5 * value
        return cls(float(constant), slopes, matrix)

    def value(self, points: NDArray[np.floating]) -> NDArray[np.floating]:
        """Return the value at points, shape (..., factors)."""
        return self.constant + points @ self.slopes + np.einsum("...j,jk,...k", points, self.matrix, points)

    def gradient(self, point: NDArray[np.floating]) -> NDArray[np.float64]:
        """Return the gradient at one point, shape (factors,)."""
        return self.slopes + 2.0 * self.matrix @ point

    def roots_along(self, axis: int, lines: NDArray[np.float64], target: float) -> NDArray[np.float64]:
        """Return the roots of lines parallel to an axis as coordinates on it, shape (lines, 2).

        ``lines`` holds a point of each line, shape (lines, factors). Missing roots are NaN or infinite.
        """
        base = lines.copy()
        base[:, axis] = 0.0
        a = self.matrix[axis, axis]
        b = self.slopes[axis] + 2.0 * base @ self.matrix[:, axis]
        c = self.value(base) - target
        with np.errstate(invalid="ignore", divide="ignore"):
            # q/a and c/q lose no digits where a is near zero and one root runs off to infinity.
            q = -0.5 * (b + np.where(b < 0.0, -1.0, 1.0) * np.sqrt(b * b - 4.0 * a * c))
            return np.column_stack([q / a, c / q])


class FittedSurface(Protocol):
    """A polynomial of second degree that was fitted to a design, such as ``doe.Surface``."""

    @property
    def design(self) -> Design:
        """The design, with its factors and their coding."""

    @property
    def quadratic_form(self) -> QuadraticForm:
        """The polynomial in coded units."""

    @property
    def residual_df(self) -> float:
        """Degrees of freedom of the residual."""

    def evaluate(self, coded: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return mean and its standard error at coded points, shape (points, factors)."""


def unselected(surface: FittedSurface) -> FittedSurface:
    """Return the model that intervals and regions come from.

    After the data chose terms this is the model before (``doe.Surface.unselected``): the errors of the chosen
    one ignore the choice and are too small. For any other surface it is the surface itself.
    """
    return getattr(surface, "unselected", surface)
