"""Design: the settings of every run, coded and natural, with the order in which to run them."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from doe.errors import DesignError
from doe.factors import Factor, checked_factors, coded_points, natural_points
from doe.labels import aligned


@dataclass(frozen=True, eq=False)
class Design:
    """Runs in standard order.

    Parameters
    ----------
    factors : tuple of Factor
    coded : DataFrame, one row a run
        Coded settings: first a column for each factor (by name), then the dummy columns of a screening
        design, which stand for no factor and hold -1 and +1. The index holds the runs' labels.
    seed : int, optional
        Seed of ``run_order``; None keeps the standard order.
    """

    factors: tuple[Factor, ...]
    coded: pd.DataFrame
    seed: int | None = None

    def __post_init__(self) -> None:
        factors = checked_factors(self.factors)
        coded = _checked_table(self.coded, [factor.name for factor in factors])
        for name in coded.columns[len(factors) :]:
            odd = coded.index[~coded[name].isin([-1.0, 1.0])]
            if len(odd):
                raise DesignError(
                    f"a further column is a dummy and holds only -1 and +1: column {name!r} holds "
                    f"{coded[name][odd[0]]} in run {odd[0]} (drop it when it is no dummy)"
                )
        object.__setattr__(self, "factors", factors)
        object.__setattr__(self, "coded", coded)

    @classmethod
    def from_table(cls, table: pd.DataFrame, factors: Iterable[Factor], coded: bool = True) -> "Design":
        """Return the design that a table holds.

        Parameters
        ----------
        table : DataFrame, one row a run
            A column for each factor; every further column is a dummy in -1 and +1.
        factors : iterable of Factor
        coded : bool
            Whether the factors' columns are coded (else in natural units).

        Raises
        ------
        DesignError
            A factor without column, a value that is not finite, a run label that comes twice, or a dummy
            with other values than -1 and +1.
        """
        factors = checked_factors(factors)
        table = _checked_table(table, [factor.name for factor in factors])
        if not coded:
            table[[factor.name for factor in factors]] = coded_points(factors, table)
        return cls(factors, table)

    @property
    def names(self) -> list[str]:
        """Names of the factors."""
        return [factor.name for factor in self.factors]

    @property
    def dummies(self) -> list[str]:
        """Names of the dummy columns."""
        return list(self.coded.columns[len(self.factors) :])

    @property
    def points(self) -> pd.DataFrame:
        """Coded settings without the dummy columns."""
        return self.coded[self.names]

    @cached_property
    def natural(self) -> pd.DataFrame:
        """Natural settings, one column a factor."""
        return natural_points(self.factors, self.coded)

    @cached_property
    def run_order(self) -> pd.Index:
        """Run labels in the order of execution: ``design.natural.loc[design.run_order]``."""
        if self.seed is None:
            return self.coded.index
        order = np.random.default_rng(self.seed).permutation(len(self.coded))
        return self.coded.index[order]

    def factor(self, name: str) -> Factor:
        """Return the factor of this name."""
        for factor in self.factors:
            if factor.name == name:
                return factor
        raise DesignError(f"no factor is named {name!r}; the design has {', '.join(self.names)}")

    def select(self, runs: Sequence) -> "Design":
        """Return a design of these runs, renumbered from 1; a label that comes again is a replicate.

        So a table of finished cases, some replicated and some missing, becomes a design again:
        ``design.select(table["run"])``.
        """
        unknown = [run for run in runs if run not in self.coded.index]
        if unknown:
            raise DesignError(f"the design has no run {unknown[0]!r}; its runs are {list(self.coded.index)}")
        return Design(self.factors, numbered(self.coded.loc[list(runs)]))


def numbered(table: pd.DataFrame) -> pd.DataFrame:
    """Return the table with runs numbered from 1."""
    return table.set_axis(pd.RangeIndex(1, len(table) + 1, name="run"))


def observations(design: Design, response: ArrayLike) -> tuple[pd.DataFrame, pd.Series]:
    """Return coded settings and response with one row an observation.

    Parameters
    ----------
    design : Design
    response : array-like, shape (runs,) or (runs, replicates)
        A Series or DataFrame is read by its labels, which are the design's runs in any order; an array by its
        position, in the design's row order. Columns of a DataFrame are replicates and are numbered.

    Raises
    ------
    DesignError
        Other labels, another shape, or a value that is not finite (with its run and replicate).
    """
    values = aligned("a response", response, design.coded.index)
    runs = len(design.coded)
    if values.ndim not in (1, 2) or values.shape[0] != runs or values.size == 0:
        raise DesignError(f"a response has shape ({runs},) or ({runs}, replicates), received {values.shape}")
    values = values.reshape(runs, -1)
    bad = np.argwhere(~np.isfinite(values))
    if len(bad):
        run, replicate = bad[0]
        raise DesignError(
            f"a response must be finite: {values[run, replicate]} in run {design.coded.index[run]}, "
            f"replicate {replicate + 1}"
        )
    rows = np.repeat(np.arange(runs), values.shape[1])
    coded = design.coded.iloc[rows]
    return coded, pd.Series(values.ravel(), index=coded.index, name="response")


def _checked_table(table: pd.DataFrame, names: list[str]) -> pd.DataFrame:
    """Return a float copy with the factors' columns first; raise DesignError when it is no table of runs."""
    missing = [name for name in names if name not in table.columns]
    if missing:
        raise DesignError(f"no column for factor {missing[0]!r}; the table has {list(table.columns)}")
    for what, labels in (("run label", table.index), ("column", table.columns)):
        if labels.has_duplicates:
            raise DesignError(f"each {what} comes once, received again: {labels[labels.duplicated()][0]}")
    if table.empty:
        raise DesignError("a design has at least one run, received an empty table")
    further = [name for name in table.columns if name not in names]
    try:
        table = table[names + further].astype(np.float64)
    except (TypeError, ValueError) as error:
        raise DesignError(f"every column of a design holds numbers: {error}") from None
    values = table.to_numpy()
    bad = np.argwhere(~np.isfinite(values))
    if len(bad):
        row, column = bad[0]
        raise DesignError(
            f"settings must be finite: {values[row, column]} in run {table.index[row]}, "
            f"column {table.columns[column]!r}"
        )
    return table
