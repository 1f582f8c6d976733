"""Interface of a fitted surface for contours, optima and regions."""

from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from doe.design.design import Design
from doe.response.quadratic import QuadraticForm


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

    After terms were chosen by the data this is the model before the choice (``doe.Surface.unselected``): the
    errors of the chosen one do not know that it was chosen, and are too small. Any other surface is its own.
    """
    return getattr(surface, "unselected", surface)
