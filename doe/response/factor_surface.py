"""A factor as a response of its own: what a measurement of the factor itself is compared with."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from doe.arguments import checked_number, checked_points
from doe.design.design import Design
from doe.errors import DesignError
from doe.response.quadratic import QuadraticForm


@dataclass(frozen=True, eq=False)
class FactorSurface:
    """The value of one factor over a design, in natural units: a surface without runs or lack of fit.

    As the surface of a ``Goal`` it lets a direct measurement of the factor take part in a ``joint_fit``.
    """

    design: Design
    """Design of the surfaces that it is fitted with."""
    factor: str
    """Name of the factor."""
    se: float = 0.0
    """Standard error, known, by which the factor may differ from what was measured, in natural units."""

    def __post_init__(self) -> None:
        if self.factor not in self.design.names:
            known = ", ".join(self.design.names)
            raise DesignError(f"no factor is named {self.factor!r}; the design has {known}")
        checked_number("se", self.se, least=0.0)

    @property
    def quadratic_form(self) -> QuadraticForm:
        """The value as c + b'x in coded units."""
        names, factor = self.design.names, self.design.factor(self.factor)
        slopes = np.where(np.array(names) == self.factor, factor.half_range, 0.0)
        return QuadraticForm(factor.center, slopes, np.zeros((len(names), len(names))))

    @property
    def residual_df(self) -> float:
        """Degrees of freedom of the standard error: infinite, as it is known."""
        return np.inf

    def evaluate(self, coded: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the factor's value and its standard error at coded points, shape (points, factors)."""
        points = checked_points(coded, len(self.design.names))
        factor = self.design.factor(self.factor)
        values = factor.to_natural(points[:, self.design.names.index(self.factor)])
        return np.asarray(values, np.float64), np.full(len(points), self.se)
