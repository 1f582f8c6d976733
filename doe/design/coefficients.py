"""Table of a fit's coefficients, and the analysis of variance by order of the terms."""

from collections.abc import Iterable, Mapping

import numpy as np
import pandas as pd
from statsmodels.regression.linear_model import RegressionResults

from doe.design.anova import ErrorTerm, with_residual
from doe.design.polynomial_terms import Term

ORDERS = ("first order", "two-way interactions", "pure quadratic", "higher order")


def coefficient_table(fit: RegressionResults, robust: bool = False) -> pd.DataFrame:
    """Return estimate, se, t, p and vif of every coefficient.

    The model has an intercept in its first column, or is that of a mixture. Robust standard errors hold when
    the variance differs between runs (HC3: MacKinnon and White, J. Econometrics 29, 1985, p. 305).
    """
    # HC3 divides by 1 - leverage, which is 0 at a run that a term fits alone
    with np.errstate(divide="ignore", invalid="ignore"):
        used = fit.get_robustcov_results("HC3", use_t=True) if robust else fit
        table = pd.DataFrame(
            {
                "estimate": np.asarray(used.params),
                "se": np.asarray(used.bse),
                "t": np.asarray(used.tvalues),
                "p": np.asarray(used.pvalues),
                "vif": variance_inflation(fit),
            },
            index=list(fit.model.exog_names),
        )
    return table.rename_axis("term")


def variance_inflation(fit: RegressionResults) -> np.ndarray:
    """Return the factor by which the others inflate each coefficient's variance; NaN for an intercept.

    It is 1 / (1 - R2) of a column on the others, about its mean where there is an intercept.
    """
    matrix = np.asarray(fit.model.exog)
    constant = np.ptp(matrix, axis=0) == 0.0
    centered = matrix - matrix.mean(axis=0) if constant.any() else matrix
    inflation = np.diag(np.asarray(fit.normalized_cov_params)) * (centered**2).sum(axis=0)
    return np.where(constant, np.nan, inflation)


def anova_by_order(
    fit: RegressionResults, terms: Iterable[Term], blocks: ErrorTerm, replicates: ErrorTerm
) -> pd.DataFrame:
    """Return the analysis of variance by order: the addition of each order of terms to those before it.

    Rows: blocks (if any), first order, two-way interactions, pure quadratic, higher order (those that the
    model has), residual, lack of fit, pure error, total. Each order is tested against the residual. The sums
    of squares are sequential, as in R's ``rsm``: where the orders are not orthogonal (a composite design's
    squares and the rest), an order's addition depends on those before it. The columns of the fit are
    intercept, terms, blocks.
    """
    matrix, response = np.asarray(fit.model.exog), np.asarray(fit.model.endog)
    written = list(terms)
    block_places = list(range(len(written) + 1, matrix.shape[1]))
    residual = ErrorTerm(float(fit.df_resid), float(fit.ssr))
    rows: dict[str, tuple[ErrorTerm, ErrorTerm]] = {}
    if blocks.df > 0:
        rows["blocks"] = (blocks, residual)
    inside, left = [0, *block_places], _residual_sum(matrix[:, [0, *block_places]], response)
    for order in ORDERS:
        places = [place for place, term in enumerate(written, start=1) if _order(term) == order]
        if places:
            inside += places
            remaining = _residual_sum(matrix[:, inside], response)
            rows[order] = (ErrorTerm(float(len(places)), left - remaining), residual)
            left = remaining
    return with_residual(rows, fit, residual, replicates)


def _order(term: Term) -> str:
    if len(term) == 1:
        return ORDERS[0]
    if len(term) == 2:
        return ORDERS[2] if term[0] == term[1] else ORDERS[1]
    return ORDERS[3]


def _residual_sum(matrix: np.ndarray, response: np.ndarray) -> float:
    weights = np.linalg.lstsq(matrix, response, rcond=None)[0]
    left = response - matrix @ weights
    return float(left @ left)


def summary_text(
    title: str, coefficients: pd.DataFrame, anova: pd.DataFrame | None, facts: Mapping[str, object]
) -> str:
    """Return a report of a fit in plain text: coefficients, analysis of variance, facts."""

    def number(value: float) -> str:
        return "" if np.isnan(value) else f"{value:.5g}"

    def chance(value: float) -> str:
        return "" if np.isnan(value) else "<0.0001" if value < 1e-4 else f"{value:.4f}"

    def text(table: pd.DataFrame) -> str:
        return table.to_string(
            formatters={name: chance if name == "p" else number for name in table}, na_rep=""
        )

    parts = [title, "", "Coefficients", text(coefficients)]
    if anova is not None:
        parts += ["", "Analysis of variance", text(anova)]
    parts += ["", *(f"{name}: {value}" for name, value in facts.items())]
    return "\n".join(parts)


def significant_words(coefficients: pd.DataFrame, alpha: float = 0.05) -> str:
    """Name the terms with p below alpha, smallest p first."""
    tested = coefficients.drop(index=["intercept", "Intercept"], errors="ignore")
    found = tested[tested["p"] < alpha].sort_values("p", kind="stable")
    return ", ".join(map(str, found.index)) or "none"
