"""Optimal designs: the allowed runs that determine a model's coefficients or predictions best."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.stats import qmc

from doe.arguments import MOST, checked_choice, checked_count, checked_kind, checked_list, checked_seed
from doe.design.anova import block_columns
from doe.design.design import Design, natural_points, numbered
from doe.design.factors import Category, Factor, checked_factors
from doe.design.families.augment import join
from doe.design.families.model_columns import model_columns
from doe.errors import DesignError

CANDIDATE_BUDGET = 4_096
"""Largest number of candidate runs; a larger grid is replaced by Sobol points and the corners."""

MOST_PASSES = 100

Constraint = str | Callable[[pd.DataFrame], Any]


def optimal_design(
    factors: Iterable[Factor],
    runs: int,
    model: str = "quadratic",
    *,
    criterion: str = "D",
    constraints: Sequence[Constraint] = (),
    existing: Design | None = None,
    levels: int | None = None,
    starts: int = 5,
    seed: int = 0,
) -> Design:
    """Return an optimal design, by exchange of candidate runs (Fedorov 1972) from several random starts.

    Parameters
    ----------
    factors : iterable of Factor
        Numbers and categories of any number of levels.
    runs : int
        Number of new runs.
    model : {"first-order", "interaction", "quadratic", "three-factor"}
        Polynomial of the later fit; a category has no square.
    criterion : {"D", "I"}
        ``"D"``: largest determinant of X'X, for the coefficients; ``"I"``: smallest variance of a prediction,
        averaged over the allowed part of the box.
    constraints : sequence of str or callable
        Rules for the natural values: ``"v0 < v1 < v2"``, or a function of the table that returns True where
        a row is allowed.
    existing : Design, optional
        Existing runs of the same factors: they come first, as a block of their own, which the criterion
        counts as a term.
    levels : int, optional
        Levels of a number among the candidates. Default: 5, or 3 with many factors.
    starts : int
        Random starts; the best one is returned.

    Raises
    ------
    DesignError
        An unknown criterion, or constraints that allow no run or too few for the model.
    """
    factors = checked_factors(factors)
    checked_choice("criterion", criterion, ("D", "I"))
    runs = checked_count("runs", runs, most=MOST)
    starts = checked_count("starts", starts, most=MOST)
    rng = np.random.default_rng(checked_seed(seed))
    constraints = checked_list("constraints", constraints)
    if existing is not None:
        checked_kind("existing", existing, Design)
    candidates = allowed(factors, _candidates(factors, levels, seed), constraints)
    expanded = model_columns(candidates, factors, model).to_numpy()
    polynomial = expanded.shape[1]
    kept = np.empty((0, polynomial))
    if existing is not None:
        kept, blocks = _kept(existing, factors, model)
        expanded = np.column_stack([expanded, np.broadcast_to(blocks, (len(expanded), len(blocks)))])
    count = expanded.shape[1]
    if len(kept) + runs < count:
        raise DesignError(f"{count} coefficients need as many runs, got {len(kept) + runs}")
    if np.linalg.matrix_rank(np.vstack([expanded, kept])) < count:
        raise DesignError(
            f"the {len(candidates)} runs that the constraints allow cannot distinguish {count} coefficients: "
            "give more levels, a simpler model or looser constraints"
        )
    moments = None
    if criterion == "I":
        moments = np.zeros((count, count))  # predictions do not use the blocks' columns
        moments[:polynomial, :polynomial] = _moments(factors, model, constraints, seed)
    found = (_exchanged(expanded, kept, _start(expanded, kept, runs, rng), moments) for _ in range(starts))
    _, rows = min(found, key=lambda pair: pair[0])
    design = Design(factors, numbered(candidates.iloc[np.sort(rows)].reset_index(drop=True)))
    return design if existing is None else join(existing, design, blocks=("existing", "added"))


def allowed(
    factors: Sequence[Factor], coded: pd.DataFrame, constraints: Sequence[Constraint]
) -> pd.DataFrame:
    """Return coded points whose natural values keep all constraints; raise DesignError without any."""
    natural = natural_points(factors, coded)
    mask = np.ones(len(coded), dtype=bool)
    for rule in checked_list("constraints", constraints):
        if not isinstance(rule, str) and not callable(rule):
            raise DesignError(f"a constraint must be text such as 'v0 < v1' or a function, got {rule!r}")
        try:
            held = natural.eval(rule, engine="python") if isinstance(rule, str) else rule(natural)
        except Exception as error:
            raise DesignError(f"constraint {rule!r} cannot be evaluated: {error}") from error
        held = np.asarray(held)
        if held.shape != (len(coded),) or held.dtype != np.bool_:
            raise DesignError(f"constraint {rule!r} must give True or False for every run, got {held.dtype}")
        mask &= held
    if not mask.any():
        raise DesignError(f"no candidate run keeps the constraints {list(constraints)}")
    return coded[mask]


def _candidates(factors: Sequence[Factor], levels: int | None, seed: int) -> pd.DataFrame:
    """Return the candidate runs: a grid, or Sobol points and the corners where the grid is too large."""
    if levels is None:
        levels = 5 if 5.0 ** len(factors) <= CANDIDATE_BUDGET else 3
    levels = checked_count("levels", levels, least=2, most=MOST)
    grids = [
        np.array(f.codes) if isinstance(f, Category) else np.linspace(-1.0, 1.0, levels) for f in factors
    ]
    names = [factor.name for factor in factors]
    if np.prod([float(len(grid)) for grid in grids]) <= CANDIDATE_BUDGET:
        mesh = np.stack(np.meshgrid(*grids, indexing="ij"), axis=-1).reshape(-1, len(factors))
        return pd.DataFrame(mesh, columns=names)
    unit = qmc.Sobol(len(factors), rng=np.random.default_rng(seed)).random_base2(11)
    inner = np.column_stack([_snapped(unit[:, k], grid) for k, grid in enumerate(grids)])
    ends = [
        grid if isinstance(f, Category) else grid[[0, -1]] for f, grid in zip(factors, grids, strict=True)
    ]
    outer = np.column_stack([_snapped(unit[:, k][::-1], grid) for k, grid in enumerate(ends)])
    return pd.DataFrame(np.unique(np.vstack([inner, outer]), axis=0), columns=names)


def _snapped(unit: NDArray[np.float64], grid: NDArray[np.float64]) -> NDArray[np.float64]:
    return grid[np.minimum((unit * len(grid)).astype(int), len(grid) - 1)]


def _moments(
    factors: Sequence[Factor], model: str, constraints: Sequence[Constraint], seed: int
) -> NDArray[np.float64]:
    """Return the mean of f f' over the allowed part of the box: I = trace((X'X)^-1 of it)."""
    unit = qmc.Sobol(len(factors), rng=np.random.default_rng(seed)).random_base2(11)
    columns = {}
    for place, factor in enumerate(factors):
        if isinstance(factor, Category):
            columns[factor.name] = _snapped(unit[:, place], np.array(factor.codes))
        else:
            columns[factor.name] = 2.0 * unit[:, place] - 1.0
    inside = model_columns(allowed(factors, pd.DataFrame(columns), constraints), factors, model).to_numpy()
    return inside.T @ inside / len(inside)


def _kept(
    existing: Design, factors: tuple[Factor, ...], model: str
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the columns of the existing runs, blocks included, and the blocks' columns of a new run."""
    if existing.factors != factors:
        raise DesignError("existing must be a design of the same factors, with the same ranges")
    labels = ["existing"] * len(existing.coded) if existing.blocks is None else list(existing.blocks)
    blocks = block_columns(pd.Series([*labels, object()], dtype=object), pd.RangeIndex(len(labels) + 1))
    columns = model_columns(existing.points, factors, model)
    return np.column_stack([columns, blocks.iloc[:-1]]), blocks.iloc[-1].to_numpy()


def _start(
    expanded: NDArray[np.float64], kept: NDArray[np.float64], runs: int, rng: np.random.Generator
) -> NDArray[np.int64]:
    """Return random rows whose X'X is regular."""
    for _ in range(200):
        rows = rng.integers(len(expanded), size=runs)
        if np.linalg.cond(np.vstack([expanded[rows], kept])) < 1e10:
            return rows
    # random rows seldom span a narrow region: take the rows that add most, one after the other
    matrix = kept.T @ kept + 1e-6 * np.eye(expanded.shape[1])
    greedy = []
    for _ in range(runs):
        spread = np.einsum("ij,ij->i", expanded @ np.linalg.inv(matrix), expanded)
        greedy.append(int(spread.argmax()))
        matrix += np.outer(expanded[greedy[-1]], expanded[greedy[-1]])
    return np.array(greedy)


def _exchanged(
    expanded: NDArray[np.float64],
    kept: NDArray[np.float64],
    rows: NDArray[np.int64],
    moments: NDArray[np.float64] | None,
) -> tuple[float, NDArray[np.int64]]:
    """Return criterion (smaller is better) and rows after exchanging each row for its best candidate."""
    rows = rows.copy()
    matrix = expanded[rows].T @ expanded[rows] + kept.T @ kept
    value = _criterion(matrix, moments)
    for _ in range(MOST_PASSES):
        before = value
        for place in range(len(rows)):
            without = matrix - np.outer(expanded[rows[place]], expanded[rows[place]])
            scores = _scores(without, expanded, moments)
            best = int(scores.argmin())
            trial = without + np.outer(expanded[best], expanded[best])
            trial_value = _criterion(trial, moments)
            if trial_value < value - 1e-12 * max(1.0, abs(value)):
                rows[place], matrix, value = best, trial, trial_value
        if value == before:
            break
    return value, rows


def _criterion(matrix: NDArray[np.float64], moments: NDArray[np.float64] | None) -> float:
    sign, log_determinant = np.linalg.slogdet(matrix)
    if sign <= 0.0:
        return np.inf
    return -float(log_determinant) if moments is None else float(np.trace(np.linalg.solve(matrix, moments)))


def _scores(
    without: NDArray[np.float64], expanded: NDArray[np.float64], moments: NDArray[np.float64] | None
) -> NDArray[np.float64]:
    """Return for every candidate the criterion after it joins the other runs.

    det(M + xx') = det(M) (1 + x'Vx) and (M + xx')^-1 = V - Vxx'V / (1 + x'Vx), with V the inverse of M, which
    a small ridge makes regular where the run that left was needed.
    """
    ridge = 1e-9 * np.trace(without) / len(without)
    inverse = np.linalg.inv(without + ridge * np.eye(len(without)))
    spread = expanded @ inverse
    gain = np.einsum("ij,ij->i", spread, expanded)
    if moments is None:
        return -gain
    return -np.einsum("ij,jk,ik->i", spread, moments, spread) / (1.0 + gain)
