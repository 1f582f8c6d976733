"""Linear models beyond polynomials of numbers: free formulas, categories, mixtures."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np
import pandas as pd
import statsmodels.formula.api as smf
from numpy.typing import ArrayLike
from statsmodels.regression.linear_model import RegressionResults
from statsmodels.stats.anova import anova_lm

from doe.arguments import checked_choice, checked_flag, checked_kind, checked_level, checked_map, real_array
from doe.design.coefficients import coefficient_table, significant_words, summary_text
from doe.design.design import Design, observations
from doe.design.families.mixture import Mixture
from doe.errors import DesignError

MIXTURE_MODELS = ("linear", "quadratic", "special cubic")


@dataclass(frozen=True, eq=False)
class LinearFit:
    """A linear model of any terms; made by ``fit_formula`` and ``fit_mixture``."""

    fit: RegressionResults
    """The statsmodels least squares fit."""
    formula: str
    """Text of the model."""
    table: pd.DataFrame
    """The data of the fit, one row an observation."""

    @cached_property
    def coefficient_table(self) -> pd.DataFrame:
        """Estimate, se, t, p and vif by coefficient."""
        return coefficient_table(self.fit).rename(index=_unquoted)

    @cached_property
    def robust_table(self) -> pd.DataFrame:
        """The same with robust standard errors (HC3)."""
        return coefficient_table(self.fit, robust=True).rename(index=_unquoted)

    @property
    def fitted(self) -> pd.Series:
        """Fitted response by observation."""
        return self.fit.fittedvalues

    @cached_property
    def studentized_residuals(self) -> pd.Series:
        """Residuals over their standard errors (internally studentized)."""
        return pd.Series(self.fit.get_influence().resid_studentized_internal, index=self.table.index)

    @cached_property
    def anova(self) -> pd.DataFrame:
        """Partial sums of squares (type II) by term: df, sum_sq, mean_sq, F, p."""
        table = anova_lm(self.fit, typ=2)
        table = table.rename(columns={"PR(>F)": "p"}).rename(index={"Residual": "residual"})
        table = table.rename(index=_unquoted)
        table["mean_sq"] = table["sum_sq"] / table["df"]
        return table[["df", "sum_sq", "mean_sq", "F", "p"]].rename_axis("source")

    def predict(self, points: pd.DataFrame | Mapping[str, Any], alpha: float = 0.05) -> pd.DataFrame:
        """Return mean, se, confidence and prediction limits at natural settings (columns as ``Surface``)."""
        alpha = checked_level(alpha)
        table = points if isinstance(points, pd.DataFrame) else pd.DataFrame([checked_map("points", points)])
        try:
            frame = self.fit.get_prediction(table).summary_frame(alpha=alpha)
        except Exception as error:
            raise DesignError(
                f"the model {self.formula!r} cannot be evaluated at these points: {error}"
            ) from error
        names = {
            "mean": "mean", "mean_se": "se",
            "mean_ci_lower": "confidence_low", "mean_ci_upper": "confidence_high",
            "obs_ci_lower": "prediction_low", "obs_ci_upper": "prediction_high",
        }  # fmt: skip
        return frame.rename(columns=names)[list(names.values())].set_axis(table.index)

    def summary(self) -> str:
        """Return the fit as text."""
        facts = {
            "R2": f"{self.fit.rsquared:.4f}",
            "residual sd": f"{np.sqrt(self.fit.mse_resid):.5g} on {self.fit.df_resid:g} degrees of freedom",
            "significant at 0.05": significant_words(self.coefficient_table),
        }
        anova = None if "- 1" in self.formula else self.anova
        return summary_text(f"Fit of {_unquoted(self.formula)}", self.coefficient_table, anova, facts)

    def __repr__(self) -> str:
        return f"LinearFit {self.formula!r}: {len(self.table)} observations, R2 {self.fit.rsquared:.4f}"


def _unquoted(term: str) -> str:
    """Return a term without the quotation of names in a formula, e.g. ``a:b`` of ``Q('a'):Q('b')``."""
    return re.sub(r"Q\((['\"])(.*?)\1\)", r"\2", term)


def fit_formula(design: Design, response: ArrayLike, formula: str, *, coded: bool = True) -> LinearFit:
    """Fit a model given by a formula, with the syntax of R and patsy.

    Parameters
    ----------
    design : Design
        Its factors are the formula's variables, and ``block`` if it has blocks; a category has its levels'
        names.
    response : array-like, shape (runs,) or (runs, replicates)
    formula : str
        The right-hand side: ``"A * B * C"``, ``"A + I(A**2) + variety"``, ``"C(block) + np.log(A)"``. Blocks
        of the design are always a term.
    coded : bool
        Factors that are numbers are coded; False takes natural values.

    Raises
    ------
    DesignError
        An invalid formula, an unknown name, terms that the runs cannot distinguish.
    """
    checked_kind("design", design, Design)
    if not isinstance(formula, str):
        raise DesignError(f"formula must be text such as 'A * B', got {formula!r}")
    if "~" in formula:
        raise DesignError(f"formula must be the right-hand side alone, such as 'A * B', got {formula!r}")
    observed, values = observations(design, response)
    table = (design.points if checked_flag("coded", coded) else design.natural).loc[observed.index].copy()
    for factor in design.factors:
        if hasattr(factor, "levels"):
            table[factor.name] = pd.Categorical(
                design.natural.loc[observed.index, factor.name], factor.levels
            )
    taken = [name for name in design.names if name in ("response", "block")]
    if taken:
        raise DesignError(f"a formula writes {taken[0]!r} for something else: give the factor another name")
    if design.blocks is not None:
        table["block"] = design.blocks.loc[observed.index].astype(str)
        formula = formula if "block" in formula else f"C(block) + {formula}"
    table["response"] = values
    return _fitted(f"response ~ {formula}", table)


def fit_mixture(mixture: Mixture, response: ArrayLike, model: str = "quadratic") -> LinearFit:
    """Fit Scheffe's polynomial to a mixture: no intercept, each coefficient that of a pure component.

    Parameters
    ----------
    response : array-like, shape (blends,) or (blends, replicates)
    model : {"linear", "quadratic", "special cubic"}
        Components; with their products of two; and of three (Scheffe 1958).
    """
    checked_kind("mixture", mixture, Mixture)
    checked_choice("model", model, MIXTURE_MODELS)
    values = real_array("response", response)
    if values.ndim not in (1, 2) or len(values) != len(mixture.shares) or not np.isfinite(values).all():
        raise DesignError(
            f"a response must have a finite value for each of {len(mixture.shares)} blends, got shape "
            f"{values.shape}"
        )
    if isinstance(response, pd.Series | pd.DataFrame) and not response.index.equals(mixture.shares.index):
        raise DesignError("a labelled response must have the labels of the blends, in their order")
    values = values.reshape(len(values), -1)
    table = mixture.shares.iloc[np.repeat(np.arange(len(values)), values.shape[1])].copy()
    table["response"] = values.ravel()
    names = [f"Q({name!r})" for name in mixture.names]
    highest = 1 + MIXTURE_MODELS.index(model)
    products = [":".join(chosen) for size in range(1, highest + 1) for chosen in combinations(names, size)]
    return _fitted(f"response ~ {' + '.join(products)} - 1", table)


def _fitted(formula: str, table: pd.DataFrame) -> LinearFit:
    try:
        model = smf.ols(formula, table)
    except Exception as error:
        raise DesignError(f"the formula {formula!r} is not understood: {error}") from error
    matrix = np.asarray(model.exog)
    rank = np.linalg.matrix_rank(matrix)
    if rank < matrix.shape[1]:
        raise DesignError(
            f"the runs cannot distinguish the terms of {formula!r}: rank {rank}, {matrix.shape[1]} terms"
        )
    if len(matrix) <= rank:
        raise DesignError(f"{len(matrix)} observations leave no error for {rank} coefficients of {formula!r}")
    return LinearFit(model.fit(), formula, table)
