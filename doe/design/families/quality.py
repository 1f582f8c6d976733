"""Quality of a design before its runs: efficiencies, variance inflation, and power."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import stats
from scipy.stats import qmc

from doe.arguments import (
    checked_count,
    checked_kind,
    checked_level,
    checked_list,
    checked_number,
    checked_seed,
)
from doe.design.anova import block_columns
from doe.design.design import Design
from doe.design.factors import Category
from doe.design.families.model_columns import model_columns
from doe.design.families.optimal import Constraint, allowed
from doe.errors import DesignError


@dataclass(frozen=True, eq=False)
class DesignQuality:
    """Numbers about a design and a model, for an error variance of 1; made by ``design_quality``."""

    d_efficiency: float
    """``|X'X|^(1/p) / N`` in percent: 100 is an orthogonal two-level design of as many runs."""
    a_efficiency: float
    """p / (N trace (X'X)^-1) in percent, the same scale."""
    g_efficiency: float
    """p / (N largest prediction variance in the box) in percent."""
    variances: NDArray[np.float64]
    """Variances of predictions at points spread over the box, ascending."""
    vif: pd.Series
    """Variance inflation of each coefficient by the others: 1 for orthogonal ones."""

    def __str__(self) -> str:
        worst = f"{self.vif.idxmax()} {self.vif.max():.2f}" if len(self.vif) else "none"
        return (
            f"D {self.d_efficiency:.1f} %, A {self.a_efficiency:.1f} %, G {self.g_efficiency:.1f} %; mean "
            f"prediction variance {self.variances.mean():.3f} of one observation's; largest VIF {worst}"
        )


def design_quality(
    design: Design, model: str = "quadratic", *, constraints: Sequence[Constraint] = (), seed: int = 0
) -> DesignQuality:
    """Return the efficiencies of a design for a model, blocks included.

    Parameters
    ----------
    model : {"first-order", "interaction", "quadratic", "three-factor"}
    constraints : sequence of str or callable
        Rules for the natural values that limit the place of predictions (see ``optimal_design``).
    seed : int
        Seed of the Sobol points that predictions are averaged over.

    Raises
    ------
    DesignError
        The design cannot distinguish the model's terms.
    """
    checked_kind("design", design, Design)
    matrix = _full_matrix(design, model)
    columns = model_columns(design.points, design.factors, model)
    count, runs = columns.shape[1], len(columns)
    inverse = np.linalg.inv(matrix.T @ matrix)[:count, :count]
    unit = qmc.Sobol(len(design.factors), rng=np.random.default_rng(checked_seed(seed))).random_base2(11)
    box = pd.concat([_points(design, unit), _points(design, np.round(unit))], ignore_index=True)
    inside = allowed(design.factors, box, constraints)
    columns_inside = model_columns(inside, design.factors, model).to_numpy()
    variance = np.einsum("ij,jk,ik->i", columns_inside, inverse, columns_inside)
    average = variance[inside.index.to_numpy() < len(unit)]  # the corners count for the largest one alone
    log_determinant = -np.linalg.slogdet(inverse)[1]
    return DesignQuality(
        d_efficiency=float(100.0 * np.exp(log_determinant / count) / runs),
        a_efficiency=float(100.0 * count / (runs * np.trace(inverse))),
        g_efficiency=float(100.0 * count / (runs * variance.max())),
        variances=np.sort(average),
        vif=_inflation(columns, inverse),
    )


def power_table(
    design: Design,
    effects: Sequence[float] = (1.0, 2.0),
    *,
    model: str = "first-order",
    sd: float = 1.0,
    replicates: int = 1,
    alpha: float = 0.05,
) -> pd.DataFrame:
    """Return the probability that each term is found significant, before its runs.

    An effect is the change of the response from -1 to +1, twice the coefficient; for a square it is the
    change from the center to +1, the coefficient itself. Powers are those of the t test with the residual of
    the model (noncentral t), which blocks, replicates and dummies affect.

    Parameters
    ----------
    effects : sequence of float
        Sizes of effects, in the unit of ``sd``.
    model : {"first-order", "interaction", "quadratic", "three-factor"}
    sd : float
        Standard deviation of one observation.
    replicates : int
        Observations of every run.

    Returns
    -------
    DataFrame, one row per term
        se (of the effect), vif, df (of the error), and ``power at E`` for each effect.

    Raises
    ------
    DesignError
        No degrees of freedom for the error, or terms that the runs cannot distinguish.
    """
    checked_kind("design", design, Design)
    sd, replicates = checked_number("sd", sd, above=0.0), checked_count("replicates", replicates)
    alpha = checked_level(alpha)
    sizes = [checked_number("an effect", effect) for effect in checked_list("effects", effects)]
    if not sizes:
        raise DesignError("effects must be one or more, got an empty list")
    matrix = _full_matrix(design, model)
    columns = model_columns(design.points, design.factors, model)
    count = columns.shape[1]
    df = replicates * len(matrix) - matrix.shape[1]
    if df < 1:
        raise DesignError(
            f"{replicates * len(matrix)} observations leave no degrees of freedom for the error of "
            f"{matrix.shape[1]} coefficients: replicate, take more runs, or test by Lenth's error"
        )
    inverse = np.linalg.inv(matrix.T @ matrix)[:count, :count] / replicates
    scale = np.array([1.0 if "^" in name else 2.0 for name in columns])
    se = pd.Series(scale * sd * np.sqrt(np.diag(inverse)), index=columns.columns).iloc[1:]
    table = pd.DataFrame({"se": se, "vif": _inflation(columns, inverse * replicates), "df": float(df)})
    critical = stats.t.isf(0.5 * alpha, df)
    for effect in sizes:
        shift = np.abs(effect) / se
        table[f"power at {effect:g}"] = stats.nct.sf(critical, df, shift) + stats.nct.sf(critical, df, -shift)
    return table.rename_axis("term")


def _full_matrix(design: Design, model: str) -> np.ndarray:
    """Return the model's columns and those of the blocks; raise DesignError when they are dependent."""
    columns = model_columns(design.points, design.factors, model)
    matrix = np.column_stack([columns, block_columns(design.blocks, columns.index)])
    if np.linalg.matrix_rank(matrix) < matrix.shape[1]:
        raise DesignError(
            f"{len(matrix)} runs cannot distinguish the {matrix.shape[1]} coefficients of the {model} model "
            "(blocks included)"
        )
    return matrix


def _inflation(columns: pd.DataFrame, inverse: np.ndarray) -> pd.Series:
    """Return variances over those that the same columns would have alone (with the intercept)."""
    centered = columns - columns.mean()
    alone = (centered**2).sum().to_numpy()
    return pd.Series(np.diag(inverse) * alone, index=columns.columns).iloc[1:]


def _points(design: Design, unit: np.ndarray) -> pd.DataFrame:
    """Return coded points of points in the unit cube."""
    columns = {}
    for place, factor in enumerate(design.factors):
        if isinstance(factor, Category):
            codes = np.array(factor.codes)
            columns[factor.name] = codes[
                np.minimum((unit[:, place] * len(codes)).astype(int), len(codes) - 1)
            ]
        else:
            columns[factor.name] = 2.0 * unit[:, place] - 1.0
    return pd.DataFrame(columns)
