"""Design: the settings of every run, coded and natural, with the order in which to run them."""

from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from doe import arguments
from doe.design.factors import Category, Factor, checked_factors
from doe.design.labels import aligned
from doe.errors import DesignError


@dataclass(frozen=True, eq=False)
class Design:
    """Runs in standard order.

    Parameters
    ----------
    coded : DataFrame, one row per run
        Coded settings: a column for each factor and each dummy, by name. The index holds the runs' labels.
    seed : int, optional
        Seed of ``run_order``. Default: the standard order.
    dummies : names
        Columns of a screening design for no factor, of -1 and +1: their effects estimate error and
        interactions. A column is a dummy by this list, never by its values.
    blocks : Series, optional
        Label of each run's block (day, batch, oven), by run. Blocks are a term of every model of the design.
    notes : sentences
        Remarks for the user: aliases, better designs.
    """

    factors: tuple[Factor, ...]
    coded: pd.DataFrame
    seed: int | None = None
    dummies: tuple[str, ...] = ()
    blocks: pd.Series | None = None
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        factors = checked_factors(self.factors)
        arguments.checked_seed(self.seed)
        arguments.checked_kind("coded, the table of a design,", self.coded, pd.DataFrame)
        names = [factor.name for factor in factors]
        dummies = tuple(arguments.checked_list("dummies", self.dummies))
        coded = _checked_table(self.coded, names, dummies)
        for name in dummies:
            center = (coded[names] == 0.0).all(axis=1) & (coded[name] == 0.0)
            odd = coded.index[~(coded[name].isin([-1.0, 1.0]) | center)]
            if len(odd):
                raise DesignError(
                    f"a dummy must hold only -1 and +1 (0 at the center): column {name!r} holds "
                    f"{coded.loc[odd[0], name]} in run {odd[0]}"
                )
        object.__setattr__(self, "factors", factors)
        object.__setattr__(self, "coded", coded)
        object.__setattr__(self, "dummies", dummies)
        if self.blocks is not None:
            object.__setattr__(self, "blocks", checked_blocks(self.blocks, coded))

    def __repr__(self) -> str:
        factors = ", ".join(f"{f.name} {f.levels_text}" for f in self.factors)
        extras = [f"{len(self.dummies)} dummies"] if self.dummies else []
        if self.blocks is not None:
            extras.append(f"{self.blocks.nunique()} blocks")
        replicated = len(self.coded) - len(self.coded[self.names].drop_duplicates())
        extras += [f"{replicated} repeated settings"] if replicated else []
        return (
            f"{type(self).__name__} of {len(self.coded)} runs in {factors}{''.join(f'; {e}' for e in extras)}"
        )

    @classmethod
    def from_table(
        cls,
        table: pd.DataFrame,
        factors: Iterable[Factor],
        coded: bool | None = None,
        *,
        dummies: Iterable[str] = (),
        block: str | None = None,
    ) -> "Design":
        """Return the design of a table.

        Parameters
        ----------
        table : DataFrame, one row per run
            A column for each factor, each dummy and the blocks; no other.
        coded : bool, optional
            True if the factors' columns are coded, False if they are in natural units. By default they are
            taken as coded where that is unambiguous: each factor's column holds -1 and +1.
        dummies : names
            Columns in -1 and +1 for no factor.
        block : name, optional
            Column of the blocks' labels.

        Raises
        ------
        DesignError
            A factor without column, an unknown column, a value that is not finite, a repeated run label, a
            dummy with other values than -1 and +1, or a table that may be coded or natural.
        """
        factors, dummies = checked_factors(factors), tuple(arguments.checked_list("dummies", dummies))
        if coded is not None:
            arguments.checked_flag("coded, unless it is None,", coded)
        if not isinstance(table, pd.DataFrame):
            raise DesignError(f"table must be a DataFrame, got {type(table).__name__}")
        blocks = None
        if block is not None:
            if not isinstance(block, str) or block not in table.columns:
                raise DesignError(f"no column for the block {block!r}; the table has {list(table.columns)}")
            blocks, table = table[block], table.drop(columns=block)
        if coded is not None and not coded:
            table = table.assign(**coded_points(factors, _checked_natural(table, factors)))
        design = cls(factors, table, dummies=dummies, blocks=blocks)
        if coded is None:
            _check_coded(design)
        return design

    @property
    def names(self) -> list[str]:
        """Names of the factors."""
        return [factor.name for factor in self.factors]

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
        """Run labels in the order of execution, by blocks: ``design.natural.loc[design.run_order]``."""
        if self.seed is None:
            return self.coded.index
        order = np.random.default_rng(int(self.seed)).permutation(len(self.coded))
        if self.blocks is not None:
            order = order[np.argsort(pd.factorize(self.blocks)[0][order], kind="stable")]
        return self.coded.index[order]

    def factor(self, name: str) -> Factor:
        """Return the factor of this name."""
        if not isinstance(name, str):
            raise DesignError(f"a factor's name must be text, got {name!r}")
        for factor in self.factors:
            if factor.name == name:
                return factor
        raise DesignError(f"no factor is named {name!r}; the design has {', '.join(self.names)}")

    def select(self, runs: Sequence) -> "Design":
        """Return a design of these runs, renumbered from 1; a repeated label is a replicate.

        It makes a design of a table of finished cases, some replicated, some missing:
        ``design.select(table["run"])``.
        """
        runs = arguments.checked_list("runs", runs)
        unknown = [run for run in runs if not isinstance(run, Hashable) or run not in self.coded.index]
        if unknown:
            raise DesignError(f"the design has no run {unknown[0]!r}; its runs are {list(self.coded.index)}")
        table = numbered(self.coded.loc[runs])
        blocks = None if self.blocks is None else self.blocks.loc[runs].set_axis(table.index)
        return Design(self.factors, table, dummies=self.dummies, blocks=blocks)


def design_of_blocks(
    factors: tuple[Factor, ...], parts: Sequence[NDArray[np.float64]], seed: int | None
) -> Design:
    """Return the design of coded runs in parts, which are blocks if there are several."""
    table = numbered(pd.DataFrame(np.vstack(parts), columns=[factor.name for factor in factors]))
    labels = np.repeat(range(1, len(parts) + 1), [len(part) for part in parts])
    blocks = pd.Series(labels, index=table.index) if len(parts) > 1 else None
    return Design(factors, table, seed, blocks=blocks)


def numbered(table: pd.DataFrame) -> pd.DataFrame:
    """Return the table with runs numbered from 1."""
    return table.set_axis(pd.RangeIndex(1, len(table) + 1, name="run"))


def observations(design: Design, response: ArrayLike) -> tuple[pd.DataFrame, pd.Series]:
    """Return coded settings and response with one row per observation.

    A Series or DataFrame is read by its labels, which are the design's runs in any order; an array by its
    position, in the design's row order. Columns of a DataFrame are replicates and are numbered. Raises
    DesignError: other labels, another shape, or a value that is not finite (with its run and replicate).
    """
    arguments.checked_kind("design", design, Design)
    values = aligned("a response", response, design.coded.index)
    runs = len(design.coded)
    if values.ndim not in (1, 2) or values.shape[0] != runs or values.size == 0:
        raise DesignError(f"a response must have shape ({runs},) or ({runs}, replicates), got {values.shape}")
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


def checked_setting(name: str, point: Any, factors: Iterable[Factor]) -> dict[str, Any]:
    """Return the natural settings of factors; raise DesignError when one is missing or wrong."""
    given = arguments.checked_map(name, point)
    missing = [factor.name for factor in factors if factor.name not in given]
    if missing:
        raise DesignError(f"no value for factor {missing[0]!r} in {name}: {given}")
    for factor in factors:
        if isinstance(factor, Category):
            factor.to_coded(given[factor.name])
        else:
            arguments.checked_number(f"the value of {factor.name!r} in {name}", given[factor.name])
    return {factor.name: given[factor.name] for factor in factors}


def coded_setting(name: str, point: Any, factors: Sequence[Factor]) -> NDArray[np.float64]:
    """Return coded settings of factors that are numbers; raise DesignError when one is missing or wrong."""
    given = checked_setting(name, point, factors)
    return np.array([float(factor.to_coded(given[factor.name])) for factor in factors])


def checked_blocks(blocks: pd.Series, coded: pd.DataFrame) -> pd.Series:
    """Return the runs' blocks in the order of the runs; raise DesignError unless each run has one."""
    if (
        not isinstance(blocks, pd.Series)
        or not blocks.index.is_unique
        or set(blocks.index) != set(coded.index)
    ):
        raise DesignError(
            "blocks must be a Series with a label for each run of the design, by the runs' labels"
        )
    blocks = blocks.loc[coded.index].rename("block")
    if blocks.isna().any():
        raise DesignError(f"blocks: run {blocks.index[blocks.isna()][0]} has no block")
    names = {f"block {label}" for label in blocks.unique()} & set(coded.columns)
    if names:
        raise DesignError(f"{min(names)!r} names a block's column in the model: give the factor another name")
    return blocks


def _check_coded(design: Design) -> None:
    """Raise DesignError unless it is clear that a table's factors are coded."""
    for factor in design.factors:
        values = design.coded[factor.name].to_numpy()
        if isinstance(factor, Category):
            continue  # its levels are names
        coded, natural = (
            all(np.isclose(values, end, rtol=1e-9, atol=1e-9 * factor.half_range).any() for end in ends)
            for ends in ((-1.0, 1.0), (factor.low, factor.high))
        )
        if not coded or (natural and (factor.low, factor.high) != (-1.0, 1.0)):
            raise DesignError(
                f"it is not clear whether the table is coded or in natural units: factor {factor.name!r} has "
                f"the levels {factor.low:g} and {factor.high:g}, its column runs from {values.min():g} to "
                f"{values.max():g}; say coded=False (natural units) or coded=True"
            )


def _checked_natural(table: pd.DataFrame, factors: tuple[Factor, ...]) -> pd.DataFrame:
    """Return the factors' columns, numbers as floats; raise DesignError when one is missing."""
    columns = {}
    for factor in factors:
        if factor.name not in table.columns:
            raise DesignError(f"no column for factor {factor.name!r}; the table has {list(table.columns)}")
        column = table[factor.name]
        if not isinstance(factor, Category):
            column = arguments.real_array(f"every column of a design holds numbers: {factor.name!r}", column)
        columns[factor.name] = column
    return pd.DataFrame(columns, index=table.index)


def _checked_table(table: pd.DataFrame, names: list[str], dummies: tuple[str, ...]) -> pd.DataFrame:
    """Return a float copy with the factors' columns first; raise DesignError for an invalid table."""
    for what, wanted in (("factor", names), ("dummy", dummies)):
        missing = [name for name in wanted if name not in table.columns]
        if missing:
            raise DesignError(f"no column for {what} {missing[0]!r}; the table has {list(table.columns)}")
    for what, labels in (("run label", table.index), ("column", table.columns)):
        if labels.has_duplicates:
            raise DesignError(f"each {what} must come once, got again: {labels[labels.duplicated()][0]}")
    if table.empty:
        raise DesignError("a design must have at least one run, got an empty table")
    unknown = [name for name in table.columns if name not in (*names, *dummies)]
    if unknown:
        raise DesignError(
            f"column {unknown[0]!r} is no factor: name it among the dummies (dummies=[...]), as the block "
            f"(block={unknown[0]!r}), or drop it"
        )
    if set(names) & set(dummies):
        raise DesignError(
            f"a column is a factor or a dummy: {min(set(names) & set(dummies))!r} is named as both"
        )
    columns = {
        name: arguments.real_array(f"every column of a design holds numbers: {name!r}", table[name])
        for name in (*names, *dummies)
    }
    table = pd.DataFrame(columns, index=table.index)
    values = table.to_numpy()
    bad = np.argwhere(~np.isfinite(values))
    if len(bad):
        row, column = bad[0]
        raise DesignError(
            f"settings must be finite: {values[row, column]} in run {table.index[row]}, "
            f"column {table.columns[column]!r}"
        )
    return table


def natural_points(factors: Iterable[Factor], coded: pd.DataFrame) -> pd.DataFrame:
    """Return the natural values of coded points: columns are the factors' names, same index."""
    return pd.DataFrame({f.name: f.to_natural(coded[f.name]) for f in factors}, index=coded.index)


def coded_points(factors: Iterable[Factor], natural: pd.DataFrame) -> pd.DataFrame:
    """Return the coded values of natural points: columns are the factors' names, same index."""
    return pd.DataFrame({f.name: f.to_coded(natural[f.name]) for f in factors}, index=natural.index)
