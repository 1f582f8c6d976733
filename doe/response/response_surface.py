"""Response surfaces: polynomial fits of a designed experiment, their quality and their predictions."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from scipy import stats
from statsmodels.regression.linear_model import RegressionResults

from doe import arguments
from doe.design.anova import ErrorTerm, anova_table, block_columns, block_sum, least_squares, pure_error
from doe.design.coefficients import anova_by_order, coefficient_table, significant_words, summary_text
from doe.design.design import Design, coded_points, observations
from doe.design.factors import Category, two_level_factors
from doe.design.polynomial_terms import (
    INTERCEPT,
    Term,
    contains,
    equation_text,
    find_term,
    model_matrix,
    model_terms,
    model_values,
    natural_coefficients,
    parsed_terms,
    term_name,
)
from doe.errors import DesignError
from doe.response import contour as contours
from doe.response import region, surface_points
from doe.response.quadratic import QuadraticForm
from doe.samples.sample import Sample


@dataclass(frozen=True, eq=False)
class Surface:
    """A polynomial fitted to a design's response; made by ``fit_surface``.

    Terms are written "E", "E:F" and "E^2". The model is hierarchical: it keeps every part of a term.
    """

    design: Design
    points: pd.DataFrame
    """Coded settings, one row per observation."""
    response: pd.Series
    """One row per observation, labelled by its run."""
    terms: tuple[Term, ...]
    dropped: tuple[str, ...] = ()
    """Removed terms, in that order."""
    selected_from: "Surface | None" = None
    """Model from which ``reduce`` chose these terms by the data; None without such a choice."""

    def __post_init__(self) -> None:
        if len(self.points) <= len(self.terms) + 1:
            raise DesignError(
                f"too few runs for the terms: {len(self.points)} observations leave no residual for "
                f"intercept, {', '.join(map(term_name, self.terms))}"
            )
        self.fit  # noqa: B018  (dependent columns are an error now, not at the first use)

    @property
    def unselected(self) -> "Surface":
        """Model before the data chose terms, whose intervals hold; the surface itself without a choice."""
        return self if self.selected_from is None else self.selected_from

    @cached_property
    def fit(self) -> RegressionResults:
        """Least squares fit (statsmodels) in coded units: intercept, terms, then the blocks' columns."""
        matrix = model_matrix(self.points, self.terms)
        blocks = block_columns(self.blocks, matrix.index)
        return least_squares(pd.concat([matrix, blocks], axis=1), self.response)

    @property
    def blocks(self) -> pd.Series | None:
        """Block of every observation; None without blocks."""
        return None if self.design.blocks is None else self.design.blocks.loc[self.response.index]

    @cached_property
    def pure_error(self) -> ErrorTerm:
        """Spread of the replicated settings."""
        return pure_error(self.points, self.response, self.blocks)

    @cached_property
    def anova(self) -> pd.DataFrame:
        """Analysis of variance by source (see ``doe.design.anova.anova_table``)."""
        return anova_table(self.fit, self.pure_error, blocks=block_sum(self.response, self.blocks))

    @cached_property
    def anova_by_order(self) -> pd.DataFrame:
        """Analysis of variance by order of the terms (see ``doe.design.coefficients.anova_by_order``)."""
        return anova_by_order(self.fit, self.terms, block_sum(self.response, self.blocks), self.pure_error)

    @cached_property
    def coefficient_table(self) -> pd.DataFrame:
        """Estimate, se, t, p and variance inflation of every coefficient in coded units, blocks included."""
        return coefficient_table(self.fit)

    def summary(self) -> str:
        """Return coefficients, analysis of variance by order and quality as text."""
        p = self.anova.loc["lack of fit", "p"]
        facts = {
            "R2": f"{self.r2:.4f}, adjusted {self.r2_adjusted:.4f}, predicted {self.r2_predicted:.4f}",
            "residual sd": f"{np.sqrt(self.residual_ms):.5g} on {self.residual_df:g} degrees of freedom",
            "lack of fit": "no replicates to test it" if np.isnan(p) else f"p = {p:.4f}",
            "significant at 0.05": significant_words(self.coefficient_table),
            "in natural units": self.equation(digits=4),
        }
        if self.dropped:
            facts["removed"] = ", ".join(self.dropped)
        if self.selected_from is not None:
            facts["chosen by the data"] = (
                "se and p of what stayed are too small; predict and regions take those of the model before"
            )
        title = f"Surface of {self.design!r}, coded units"
        return summary_text(title, self.coefficient_table, self.anova_by_order, facts)

    def __repr__(self) -> str:
        terms = ", ".join(map(term_name, self.terms)) or "the mean alone"
        return f"Surface in {terms}: {len(self.response)} observations, R2 {self.r2:.4f}"

    @cached_property
    def coded_coefficients(self) -> pd.Series:
        """Coefficients by term, in coded units; with blocks, the intercept is that of the average block."""
        return self.fit.params.iloc[: len(self.terms) + 1].copy()

    @cached_property
    def coefficients(self) -> pd.Series:
        """Coefficients by term, in natural units."""
        coded = dict(zip((INTERCEPT, *self.terms), self.coded_coefficients, strict=True))
        natural = natural_coefficients(coded, self.design.factors)
        return pd.Series({term_name(term): value for term, value in natural.items()})

    def equation(self, units: str = "natural", digits: int = 6) -> str:
        """Return the fitted polynomial as text, in natural or coded units."""
        arguments.checked_choice("units", units, ("natural", "coded"))
        coefficients = self.coefficients if units == "natural" else self.coded_coefficients
        return equation_text({str(name): value for name, value in coefficients.items()}, digits)

    @cached_property
    def quadratic_form(self) -> QuadraticForm:
        """The fitted polynomial as c + b'x + x'Bx in coded units."""
        return QuadraticForm.of(self.design.names, self.terms, self.coded_coefficients)

    @property
    def residual_df(self) -> float:
        """Degrees of freedom of the residual."""
        return float(self.fit.df_resid)

    @property
    def residual_ms(self) -> float:
        """Mean square of the residual."""
        return float(self.fit.mse_resid)

    @property
    def fitted(self) -> pd.Series:
        """Fitted response of every observation."""
        return pd.Series(self.fit.fittedvalues.to_numpy(), index=self.response.index, name="fitted")

    @property
    def residuals(self) -> pd.Series:
        """Response less fitted response."""
        return (self.response - self.fitted).rename("residual")

    @cached_property
    def leverage(self) -> pd.Series:
        """Diagonal of the hat matrix: the influence of each observation on its own fit."""
        matrix = self.fit.model.exog
        hat = np.einsum("ij,jk,ik->i", matrix, self.fit.normalized_cov_params, matrix)
        return pd.Series(hat, index=self.response.index, name="leverage")

    @property
    def studentized_residuals(self) -> pd.Series:
        """Residuals over their standard errors (internally studentized); NaN where the leverage is 1."""
        spread = np.sqrt(self.residual_ms * (1.0 - self.leverage).clip(lower=0.0))
        return (self.residuals / spread.where(spread > 0.0)).rename("studentized residual")

    @property
    def r2(self) -> float:
        """Share of the sum of squares about the mean that the model explains."""
        return float(self.fit.rsquared)

    @property
    def r2_adjusted(self) -> float:
        """R2 with both variances by their degrees of freedom."""
        return float(self.fit.rsquared_adj)

    @property
    def press(self) -> float:
        """Sum of squares of each observation less its prediction from the others; infinite at leverage 1."""
        left = (1.0 - self.leverage).to_numpy()
        if np.any(left < 1e-12):
            return np.inf
        return float(np.sum((self.residuals.to_numpy() / left) ** 2))

    @property
    def r2_predicted(self) -> float:
        """R2 of predictions that leave the predicted observation out (from ``press``)."""
        return float(1.0 - self.press / self.fit.centered_tss)

    @property
    def cv_percent(self) -> float:
        """Coefficient of variation: residual standard deviation in percent of the mean response's size."""
        mean = abs(float(self.response.mean()))
        return 100.0 * float(np.sqrt(self.residual_ms)) / mean if mean > 0.0 else np.inf

    @property
    def adequate_precision(self) -> float:
        """Range of the fitted responses over their mean standard error (Box and Draper); should exceed 4."""
        mean_variance = len(self.fit.params) * self.residual_ms / len(self.response)
        with np.errstate(divide="ignore", invalid="ignore"):  # an exact fit has no error
            return float((self.fitted.max() - self.fitted.min()) / np.sqrt(mean_variance))

    def drop(self, *names: str) -> "Surface":
        """Return the refit without these terms; raise DesignError for a part of a term that stays.

        The refit's intervals take it as given that the terms are zero: name them before the data are seen. To
        leave out insignificant terms, use ``reduce``.
        """
        out = [find_term(name, self.terms) for name in names]
        kept = tuple(term for term in self.terms if term not in out)
        for term in out:
            multiples = [term_name(other) for other in kept if contains(other, term)]
            if multiples:
                raise DesignError(
                    f"the model is hierarchical: {term_name(term)} is part of {multiples[0]}, which stays"
                )
        return replace(self, terms=kept, dropped=(*self.dropped, *map(term_name, out)))

    def reduce(self, alpha: float = 0.05) -> "Surface":
        """Return the model after hierarchical backward elimination.

        The least significant term goes repeatedly, among those with p above alpha that are part of no other.
        The coefficients, means and contours are those of the terms that stay. Standard errors, intervals and
        regions are those of the model before and hold their level (those of the terms that stay cover .77 to
        .93 instead of .95). The p values of the terms that stay ignore the choice.
        """
        arguments.checked_level(alpha)
        surface = self
        while True:
            p = surface.fit.pvalues  # of t, as of F in the analysis of variance, which takes longer
            free = [t for t in surface.terms if not any(contains(other, t) for other in surface.terms)]
            weakest = max(free, key=lambda term: p[term_name(term)], default=None)
            if weakest is None or not p[term_name(weakest)] > alpha:
                return self if surface is self else replace(surface, selected_from=self.unselected)
            surface = surface.drop(term_name(weakest))

    def evaluate(self, coded: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return fitted mean and its standard error at coded points, shape (points, factors).

        After ``reduce`` the standard error is that of the model before (see ``unselected``).
        """
        points = arguments.checked_points(coded, len(self.design.names))
        return self._mean(points), self.unselected._standard_error(points)

    def _mean(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        return model_values(points, self.design.names, self.terms) @ self._coefficients

    @cached_property
    def _coefficients(self) -> NDArray[np.float64]:
        return self.coded_coefficients.to_numpy()

    @cached_property
    def _covariance(self) -> NDArray[np.float64]:
        count = len(self.terms) + 1
        return self.fit.cov_params().to_numpy()[:count, :count]

    def _standard_error(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        matrix, covariance = model_values(points, self.design.names, self.terms), self._covariance
        return np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", matrix, covariance, matrix), 0.0))

    def predict(
        self, points: pd.DataFrame | Mapping[str, float], alpha: float = 0.05, coded: bool = False
    ) -> pd.DataFrame:
        """Predict the response.

        Parameters
        ----------
        points : DataFrame with a column for each factor, or one point as a mapping
            Natural units, or coded ones with ``coded``.
        alpha : float
            The intervals hold with probability 1 - alpha.

        Returns
        -------
        DataFrame, index of ``points``
            mean, se (of the mean), confidence_low, confidence_high (of the mean), prediction_low,
            prediction_high (of one further observation). After ``reduce`` the mean is that of the terms that
            stayed; se and intervals are those of the model before, about its own mean.

        Raises
        ------
        DesignError
            A factor without value, a value that is not finite, a level outside 0 to 1.
        """
        level = arguments.checked_level(alpha)
        table = (
            points
            if isinstance(points, pd.DataFrame)
            else pd.DataFrame([arguments.checked_map("points", points)])
        )
        inside = self._coded_table(table, arguments.checked_flag("coded", coded)).to_numpy()
        honest = self.unselected
        center, se = honest.evaluate(inside)
        t = stats.t.isf(0.5 * level, honest.residual_df)
        single = np.sqrt(se**2 + honest.residual_ms)
        columns = {"mean": self._mean(inside), "se": se}
        columns |= {"confidence_low": center - t * se, "confidence_high": center + t * se}
        columns |= {"prediction_low": center - t * single, "prediction_high": center + t * single}
        return pd.DataFrame(columns, index=table.index)

    def _coded_table(self, table: pd.DataFrame, coded: bool) -> pd.DataFrame:
        """Return the coded settings of points; raise DesignError when one is missing or not finite."""
        missing = [name for name in self.design.names if name not in table.columns]
        if missing:
            raise DesignError(f"no value for factor {missing[0]!r}; the points have {list(table.columns)}")
        if not coded:
            named = [factor for factor in self.design.factors if isinstance(factor, Category)]
            table = table.assign(**{factor.name: factor.to_coded(table[factor.name]) for factor in named})
        numbers = {
            name: arguments.real_array(f"the points' values of factor {name!r}", table[name])
            for name in self.design.names
        }
        for name, values in numbers.items():
            bad = np.flatnonzero(~np.isfinite(values))
            if bad.size:
                raise DesignError(
                    f"a point's settings must be finite: {name!r} is {values[bad[0]]} in row "
                    f"{table.index[bad[0]]!r}"
                )
        inside = pd.DataFrame(numbers, index=table.index)
        if coded:
            return inside
        plain = [factor for factor in self.design.factors if not isinstance(factor, Category)]
        return inside.assign(**coded_points(plain, inside))

    # functions of a fitted surface, as methods
    contour = contours.contour
    nearest = surface_points.nearest
    stationary_point = surface_points.stationary_point
    compatible_region = region.compatible_region
    band = region.band

    def agrees(
        self, point: Mapping[str, float], target: Sample, alpha: float = 0.05, coded: bool = False
    ) -> bool:
        """Return True if a target does not contradict one setting: the rule of ``compatible_region``."""
        one = pd.DataFrame([arguments.checked_map("point", point)])
        inside = self._coded_table(one, arguments.checked_flag("coded", coded))
        return region.agrees(self, inside.to_numpy(), target, alpha)


def fit_surface(design: Design, response: ArrayLike, model: str | Iterable[str] = "quadratic") -> Surface:
    """Fit a polynomial to a design's response by least squares in coded units.

    Parameters
    ----------
    design : Design
        Its blocks are a term of the model; dummy columns are not used.
    response : array-like, shape (runs,) or (runs, replicates)
    model : {"first-order", "interaction", "quadratic", "three-factor"} or terms
        Linear terms; with the products of two factors; with the squares too; with products of two and three
        factors. Or the terms themselves: ``["A", "B", "C", "A:B", "A:C", "B:C", "A:B:C", "A^2"]``.

    Raises
    ------
    DesignError
        A response that is not finite or does not vary, too few runs for the terms, or terms that the runs
        cannot distinguish.
    """
    arguments.checked_kind("design", design, Design)
    coded, values = observations(design, response)
    two_level_factors(design.factors, "a polynomial")
    terms = model_terms(design.names, model) if isinstance(model, str) else parsed_terms(model, design.names)
    return Surface(design, coded[design.names], values, terms)
