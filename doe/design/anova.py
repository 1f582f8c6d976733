"""Least squares of a design's terms and the analysis of variance made from it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from scipy import stats
from statsmodels.regression.linear_model import OLS, RegressionResults

from doe.arguments import checked_kind
from doe.design.labels import check_labels, in_rows
from doe.errors import DesignError

ALIAS_TOLERANCE = 1e-8
"""Least length of a column's addition to those before it, relative to its own length."""

SAME_SETTING_DECIMALS = 9
"""Decimals up to which coded settings of replicates agree."""

COLUMNS = ("df", "sum_sq", "mean_sq", "F", "p")


@dataclass(frozen=True)
class ErrorTerm:
    """A sum of squares that estimates an error, with its degrees of freedom."""

    df: float
    sum_sq: float

    @property
    def mean_sq(self) -> float:
        """Mean square; NaN without degrees of freedom."""
        return self.sum_sq / self.df if self.df > 0 else np.nan


def block_numbers(blocks: pd.Series, rows: pd.Index) -> NDArray[np.intp]:
    """Return the number of each row's block; raise DesignError unless every row has one."""
    checked_kind("blocks", blocks, pd.Series)
    if not blocks.index.equals(rows):
        if rows.has_duplicates:
            raise DesignError("blocks must have the labels of the rows, in their order where a label repeats")
        check_labels("blocks", blocks.index, rows)
        blocks = blocks.loc[rows]
    if blocks.isna().any():
        raise DesignError(f"blocks: row {blocks.index[blocks.isna()][0]} has no block")
    return pd.factorize(blocks)[0]


def least_squares(matrix: pd.DataFrame, response: pd.Series) -> RegressionResults:
    """Return the statsmodels fit of the response on the columns of a model matrix.

    Raises DesignError: too few observations, a constant response, or dependent columns (all are named).
    """
    if len(matrix) < matrix.shape[1]:
        raise DesignError(
            f"too few runs for the terms: {matrix.shape[1]} coefficients ({', '.join(matrix.columns)}) "
            f"from {len(matrix)} observations"
        )
    if response.min() == response.max():
        raise DesignError(f"nothing to fit: all {len(response)} observations are {response.iloc[0]:g}")
    aliased = _aliased_columns(matrix)
    if aliased:
        raise DesignError(f"the design cannot distinguish these terms: {'; '.join(aliased)}")
    with np.errstate(divide="ignore", invalid="ignore"):  # a saturated fit has no residual variance
        return OLS(response.to_numpy(), matrix).fit()


def pure_error(coded: pd.DataFrame, response: ArrayLike, blocks: pd.Series | None = None) -> ErrorTerm:
    """Return the spread of replicates about the mean of their setting.

    Rows of ``coded`` that agree (in one block, where there are blocks) are replicates of one setting; the
    degrees of freedom are the observations less the distinct settings. A labelled response, and labelled
    blocks, are read by the labels of ``coded``, an array by its position.
    """
    if not isinstance(coded, pd.DataFrame) or not len(coded.columns):
        raise DesignError(f"coded must be a table of settings, one row per observation, got {coded!r}")
    values = in_rows("a response", response, coded.index)
    setting = settings_of(coded)
    if blocks is not None:
        label = block_numbers(blocks, coded.index)
        setting = np.unique(np.column_stack([setting, label]), axis=0, return_inverse=True)[1].ravel()
    within = values.to_numpy() - values.groupby(setting).transform("mean").to_numpy()
    return ErrorTerm(float(len(values) - len(np.unique(setting))), float(within @ within))


def settings_of(coded: pd.DataFrame) -> np.ndarray:
    """Return the number of every row's setting; rows that agree share it."""
    # Adding zero makes -0.0 (from rounding) the same setting as 0.0.
    return (
        coded.round(SAME_SETTING_DECIMALS)
        .add(0.0)
        .groupby(list(coded.columns), sort=False)
        .ngroup()
        .to_numpy()
    )


def block_columns(blocks: pd.Series | None, index: pd.Index) -> pd.DataFrame:
    """Return the columns of the blocks in a model: one fewer than blocks, each adding up to zero over them.

    The intercept is then that of the average block. Without blocks there is no column.
    """
    if blocks is None:
        return pd.DataFrame(index=index)
    labels = list(dict.fromkeys(blocks))
    last = (blocks == labels[-1]).to_numpy(dtype=float)
    columns = {f"block {label}": (blocks == label).to_numpy(dtype=float) - last for label in labels[:-1]}
    return pd.DataFrame(columns, index=index)


def block_sum(response: pd.Series, blocks: pd.Series | None) -> ErrorTerm:
    """Return the sum of squares of the blocks alone: the spread of their means about the overall mean."""
    if blocks is None:
        return ErrorTerm(0.0, 0.0)
    between = response.groupby(blocks.to_numpy()).transform("mean").to_numpy() - response.mean()
    return ErrorTerm(float(blocks.nunique() - 1), float(between @ between))


def partial_sums(fit: RegressionResults) -> pd.Series:
    """Return the sum of squares of each column beyond all others: b^2 over its element of (X'X)^-1."""
    return fit.params**2 / np.diag(fit.normalized_cov_params)


def f_ratio(effect: ErrorTerm, error: ErrorTerm) -> tuple[float, float]:
    """Return F and its p value; NaN where a mean square is missing or both are zero."""
    if not effect.df > 0 or not error.df > 0 or (effect.mean_sq == 0.0 and error.mean_sq == 0.0):
        return np.nan, np.nan
    ratio = effect.mean_sq / error.mean_sq if error.mean_sq > 0.0 else np.inf
    return ratio, float(stats.f.sf(ratio, effect.df, error.df))


def anova_table(
    fit: RegressionResults,
    replicates: ErrorTerm,
    error: ErrorTerm | None = None,
    blocks: ErrorTerm | None = None,
) -> pd.DataFrame:
    """Return the analysis of variance of a fit: the intercept is its first column, the blocks its last.

    Rows: blocks (if any, alone), model (beyond the blocks), every term (partial sum of squares: types II and
    III of a hierarchical model in coded units), residual, lack of fit (residual less pure error, tested
    against pure error), pure error, total (about the mean). Columns: df, sum_sq, mean_sq, F, p; NaN where a
    row has no such value.

    Parameters
    ----------
    replicates : ErrorTerm
        Pure error, from ``pure_error``.
    error : ErrorTerm, optional
        Error of the tests of blocks, model and terms. Default: the residual.
    blocks : ErrorTerm, optional
        Sum of squares of the blocks, from ``block_sum``; its columns are the last of the fit.
    """
    residual = ErrorTerm(float(fit.df_resid), float(fit.ssr))
    error = residual if error is None else error
    blocks = blocks or ErrorTerm(0.0, 0.0)
    rows = {"blocks": (blocks, error)} if blocks.df > 0 else {}
    rows["model"] = (ErrorTerm(fit.df_model - blocks.df, float(fit.ess) - blocks.sum_sq), error)
    for name, sum_sq in partial_sums(fit).iloc[1 : len(fit.params) - int(blocks.df)].items():
        rows[str(name)] = (ErrorTerm(1.0, sum_sq), error)
    return with_residual(rows, fit, residual, replicates)


def with_residual(
    rows: dict[str, tuple[ErrorTerm, ErrorTerm]],
    fit: RegressionResults,
    residual: ErrorTerm,
    replicates: ErrorTerm,
) -> pd.DataFrame:
    """Return the table of rows, each with its error, and of residual, lack of fit, pure error and total."""
    no_test = ErrorTerm(0.0, 0.0)
    df = residual.df - replicates.df
    lack = ErrorTerm(df, max(residual.sum_sq - replicates.sum_sq, 0.0) if df > 0 else 0.0)
    last = {"residual": (residual, no_test), "lack of fit": (lack, replicates)}
    rows = {**rows, **last, "pure error": (replicates, no_test)}
    table = {
        name: (row.df, row.sum_sq, row.mean_sq, *f_ratio(row, error)) for name, (row, error) in rows.items()
    }
    table["total"] = (float(fit.nobs - 1), float(fit.centered_tss), np.nan, np.nan, np.nan)
    return pd.DataFrame.from_dict(table, orient="index", columns=list(COLUMNS)).rename_axis("source")


def _aliased_columns(matrix: pd.DataFrame) -> Sequence[str]:
    """Return a description of each column that is a combination of those before it."""
    values, names = matrix.to_numpy(), list(matrix.columns)
    described = []
    for position in range(1, len(names)):
        before, column = values[:, :position], values[:, position]
        weights = np.linalg.lstsq(before, column, rcond=None)[0]
        if np.linalg.norm(column - before @ weights) > ALIAS_TOLERANCE * np.sqrt(len(column)):
            continue
        partners = [name for name, w in zip(names, weights, strict=False) if abs(w) > ALIAS_TOLERANCE]
        described.append(
            f"{names[position]} with {' + '.join(partners) or 'nothing: it is zero in every run'}"
        )
    return described
