"""Screening: effects of two-level factors, tested against dummies, replicates or Lenth's pseudo error."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from scipy import stats
from statsmodels.regression.linear_model import RegressionResults

from doe.arguments import checked_choice, checked_flag, checked_kind, checked_level
from doe.design import polynomial_terms
from doe.design.anova import (
    ErrorTerm,
    anova_table,
    block_columns,
    block_sum,
    least_squares,
    partial_sums,
    pure_error,
)
from doe.design.coefficients import summary_text
from doe.design.design import Design, observations
from doe.errors import DesignError
from doe.screen.two_level_effects import LENTH_DRAWS, SEED, orthogonal_null, pseudo_error

ERRORS = ("pooled", "dummies", "pure", "lenth")
"""Errors against which effects can be tested."""


@dataclass(frozen=True, eq=False)
class ScreenResult:
    """Effects of a screening design and their tests; made by ``screen``."""

    design: Design
    response: pd.Series
    """One row an observation, labelled by its run."""
    fit: RegressionResults
    """Least squares of the response on the intercept and every factor (dummies are left to the error)."""
    pure_error: ErrorTerm
    error: ErrorTerm
    """Error that the effects are tested against, by the rule ``error_rule``."""
    error_rule: str
    """One of ``ERRORS``; without dummies "lack of fit": what the factors leave of the runs' means."""

    def summary(self) -> str:
        """Return effects, analysis of variance and significant factors as text."""
        facts = {
            "tested against": f"{self.error_rule}, {self.error_df:.3g} degrees of freedom",
            "significant at 0.05": ", ".join(self.significant(0.05)) or "none",
            "significant at 0.10": ", ".join(self.significant(0.10)) or "none",
        } | {f"note {number}": note for number, note in enumerate(self.design.notes, start=1)}
        columns = self.table.sort_values("rank").drop(columns=["rank", "sum_sq", "F"])
        return summary_text(f"Screening by a {self.design!r}", columns, self.anova, facts)

    def __repr__(self) -> str:
        found = ", ".join(self.significant(0.05)) or "none"
        names = ", ".join(self.design.names)
        return f"Screening of {names}: significant at 0.05 against {self.error_rule}: {found}"

    @property
    def error_df(self) -> float:
        """Degrees of freedom of the error."""
        return self.error.df

    @property
    def error_ms(self) -> float:
        """Mean square of the error."""
        return self.error.mean_sq

    @property
    def standard_error(self) -> pd.Series:
        """Standard error of each factor's effect."""
        variances = np.diag(self.fit.normalized_cov_params)[1 : len(self.design.names) + 1]
        return pd.Series(2.0 * np.sqrt(self.error_ms * variances), index=self.design.names)

    @property
    def coded_coefficients(self) -> pd.Series:
        """Intercept and half effects: the first-order model in coded units."""
        return self.fit.params.iloc[: len(self.design.names) + 1].copy()

    @property
    def blocks(self) -> pd.Series | None:
        """Block of every observation; None without blocks."""
        return None if self.design.blocks is None else self.design.blocks.loc[self.response.index]

    @property
    def coefficients(self) -> pd.Series:
        """The first-order model in natural units."""
        terms: list[polynomial_terms.Term] = [
            (),
            *polynomial_terms.model_terms(self.design.names, "first-order"),
        ]
        coded = dict(zip(terms, self.coded_coefficients, strict=True))
        natural = polynomial_terms.natural_coefficients(coded, self.design.factors)
        return pd.Series({polynomial_terms.term_name(term): value for term, value in natural.items()})

    @cached_property
    def effects(self) -> pd.Series:
        """Effects of every column, with dummies unless missing runs leave too few for them."""
        return _all_effects(self.design, self.response)

    @cached_property
    def table(self) -> pd.DataFrame:
        """Tests by factor: effect, sum_sq, F, t, p, percent (of the total sum of squares), rank."""
        sums = partial_sums(self.fit)[self.design.names]
        effect = 2.0 * self.fit.params[self.design.names]
        t = effect / self.standard_error
        table = pd.DataFrame(
            {
                "effect": effect,
                "sum_sq": sums,
                "F": t**2,
                "t": t,
                "p": self._p(t.abs()),
                "percent": 100.0 * sums / self.fit.centered_tss,
                "rank": sums.rank(ascending=False, method="first").astype(int),
            }
        )
        return table.rename_axis("factor")

    @cached_property
    def anova(self) -> pd.DataFrame:
        """Analysis of variance by source; model and factors are tested against the chosen error."""
        table = anova_table(self.fit, self.pure_error, self.error, block_sum(self.response, self.blocks))
        if self.error_rule == "lenth":  # F has no F distribution against a pseudo error
            table["p"] = table["p"].where(table.index.isin(["lack of fit"]))
            table.loc[self.design.names, "p"] = self.table["p"]
        return table

    def critical_t(self, alpha: float = 0.05, bonferroni: bool = False) -> float:
        """Return the absolute t above which an effect is significant at a two-sided level.

        With ``bonferroni`` the level is shared among all columns of the design, dummies included.
        """
        whole = self.design.coded.shape[1] if checked_flag("bonferroni", bonferroni) else 1
        shared = checked_level(alpha) / whole
        if self.error_rule == "lenth":
            return float(np.quantile(self._lenth_null, 1.0 - shared))
        return float(stats.t.isf(0.5 * shared, self.error_df))

    def significant(self, alpha: float = 0.05) -> list[str]:
        """Return the factors with p below alpha, largest effect first."""
        return list(self.table[self.table["p"] < checked_level(alpha)].sort_values("rank").index)

    def _p(self, size: pd.Series) -> pd.Series:
        """Return the p values of absolute t: Student's, or the share of drawn inert effects as large."""
        if self.error_rule != "lenth":
            return pd.Series(2.0 * stats.t.sf(size, self.error_df), index=size.index)
        drawn = self._lenth_null
        below = np.searchsorted(drawn, size.to_numpy(), side="left")
        return pd.Series((len(drawn) - below + 1.0) / (len(drawn) + 1.0), index=size.index)

    @cached_property
    def _lenth_null(self) -> NDArray[np.float64]:
        """Absolute t that inert effects of this design show against Lenth's error, ascending."""
        solver = _effect_solver(self.design, self.response.index)[1]
        products = solver @ solver.T
        if np.allclose(products, products[0, 0] * np.eye(len(solver)), atol=1e-9 * products[0, 0]):
            return orthogonal_null(len(solver))
        draws = max(1, min(LENTH_DRAWS, LENTH_DRAWS * 100 // len(self.response)))
        noise = np.random.default_rng(SEED).standard_normal((draws, len(self.response)))
        factors = 2.0 * np.linalg.pinv(self.fit.model.exog)[1 : len(self.design.names) + 1]
        size = np.linalg.norm(factors, axis=1) * np.sqrt(len(self.response)) / 2.0
        return np.sort(
            np.abs(noise @ factors.T) / (pseudo_error(noise @ solver.T)[:, None] * size), axis=None
        )


def screen(design: Design, response: ArrayLike, error: str | None = None) -> ScreenResult:
    """Estimate every factor's effect (mean at +1 less mean at -1) and test it.

    Parameters
    ----------
    design : Design
        Two-level design, with or without center runs, whose distance from the plane is a row ``curvature`` of
        the analysis of variance. With missing runs (``Design.select``) least squares replaces the plain
        contrasts.
    response : array-like, shape (runs,) or (runs, replicates)
    error : {"dummies", "lenth", "pooled", "pure"}, optional
        Error of the tests. ``"dummies"``: the columns without factor alone, which hold interactions too;
        ``"lenth"``: Lenth's pseudo standard error (Technometrics 31, 1989, p. 469), for a design without
        dummies in which few effects are active, with limits drawn from inert effects (Ye and Hamada, Journal
        of Quality Technology 32, 2000, p. 57); ``"pooled"``: the whole residual, dummies and replicates
        together; ``"pure"``: the replicates alone. Default: the dummies; without them what the factors leave
        of the runs' means, which interactions make larger; Lenth's where nothing is left. All keep their
        level when two factors interact in 12 runs; against the replicates a strong interaction is found
        significant on whichever column it falls.

    Raises
    ------
    DesignError
        A response that is not finite or does not vary, terms that the runs cannot distinguish, or no degrees
        of freedom for the chosen error.
    """
    if error is not None:
        checked_choice("error", error, ERRORS)
    checked_kind("design", design, Design)
    coded, values = observations(design, response)
    blocks = None if design.blocks is None else design.blocks.loc[values.index]
    columns = polynomial_terms.model_matrix(coded, polynomial_terms.model_terms(design.names, "first-order"))
    center = (coded[design.names] == 0.0).all(axis=1)
    if center.any() and not center.all():  # curvature at the center is not part of the error
        columns["curvature"] = center.to_numpy(dtype=float)
    fit = least_squares(pd.concat([columns, block_columns(blocks, columns.index)], axis=1), values)
    replicates = pure_error(coded, values, blocks)
    rule = error or ("dummies" if fit.df_resid > replicates.df else "lenth")
    chosen = _error_term(design, values, fit, replicates, rule)
    named = "lack of fit" if rule == "dummies" and not design.dummies else rule
    return ScreenResult(design, values, fit, replicates, chosen, named)


def _error_term(
    design: Design, response: pd.Series, fit: RegressionResults, replicates: ErrorTerm, rule: str
) -> ErrorTerm:
    """Return the error of a rule; raise DesignError without degrees of freedom."""
    residual = ErrorTerm(float(fit.df_resid), float(fit.ssr))
    if rule == "lenth":
        return _lenth_error(_all_effects(design, response), len(response))
    chosen = {
        "pooled": residual,
        "dummies": ErrorTerm(residual.df - replicates.df, residual.sum_sq - replicates.sum_sq),
        "pure": replicates,
    }[rule]
    if chosen.df <= 0:
        raise DesignError(
            f"no degrees of freedom for the error {rule!r}: {len(response)} observations, "
            f"{len(design.names)} factors, {len(design.dummies)} dummies, {replicates.df:g} df of "
            "replicates; use a larger design (spare columns are dummies), replicate the runs, or choose "
            "error='lenth'"
        )
    return chosen


def _all_effects(design: Design, response: pd.Series) -> pd.Series:
    """Return effects of factors and dummies; of the factors alone with too few runs for more."""
    columns, solver = _effect_solver(design, response.index)
    return pd.Series(solver @ response.to_numpy(), index=columns)


def _effect_solver(design: Design, runs: pd.Index) -> tuple[list[str], NDArray[np.float64]]:
    """Return the columns with estimable effects, and the matrix from observations to effects."""
    coded = design.coded.loc[runs]
    blocks = None if design.blocks is None else design.blocks.loc[runs]
    base = np.column_stack([np.ones(len(coded)), block_columns(blocks, coded.index).to_numpy()])
    columns = list(coded.columns)
    matrix = np.column_stack([base, coded.to_numpy()])
    if np.linalg.matrix_rank(matrix) < matrix.shape[1]:
        columns = design.names
        matrix = matrix[:, : base.shape[1] + len(columns)]
    return columns, 2.0 * np.linalg.pinv(matrix)[base.shape[1] :]


def _lenth_error(effects: pd.Series, observation_count: int) -> ErrorTerm:
    """Return Lenth's error: m / 3 degrees of freedom, and the mean square of its pseudo error."""
    error = float(pseudo_error(effects.to_numpy()[None, :])[0])
    if not error > 1e-12 * float(effects.abs().max()):
        raise DesignError("effects for Lenth's error must not be zero: more than half of them are")
    df = len(effects) / 3.0
    return ErrorTerm(df, df * error**2 * observation_count / 4.0)
