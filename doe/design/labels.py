"""Labels: a Series or DataFrame is read by its labels, an array by its position."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from doe.arguments import real_array
from doe.errors import DesignError


def aligned(name: str, values: ArrayLike, labels: pd.Index) -> NDArray[np.float64]:
    """Return values in the order of some labels, shape (labels,) or (labels, columns).

    A Series or DataFrame is sorted by its index, which holds the same labels, each once. Other values are in
    that order already.

    Raises DesignError: other labels, a repeated label, several columns that are not numbered as replicates
    are, or values that are no numbers.
    """
    if isinstance(values, pd.Series | pd.DataFrame):
        if isinstance(values, pd.DataFrame):
            check_replicates(name, values)
        check_labels(name, values.index, labels)
        values = values.loc[labels]
    return real_array(name, values)


def in_rows(name: str, values: ArrayLike, rows: pd.Index) -> pd.Series:
    """Return values as a Series with these row labels, finite, one per row.

    A Series with the same labels in another order is sorted; labels may repeat where the order is the same
    already, as those of replicated runs do.
    """
    if isinstance(values, pd.Series | pd.DataFrame) and not values.index.equals(rows):
        if rows.has_duplicates:
            twice = _text(rows[rows.duplicated()][0])
            raise DesignError(
                f"{name} aligns by label, each label once: {twice} comes again; number the rows"
            )
        numbers = aligned(name, values, rows)
    else:
        numbers = real_array(name, values)
    if numbers.shape != (len(rows),):
        raise DesignError(
            f"{name} must be one number for each of {len(rows)} rows, got shape {numbers.shape}"
        )
    bad = np.flatnonzero(~np.isfinite(numbers))
    if bad.size:
        raise DesignError(f"{name} must be finite: {numbers[bad[0]]} in row {_text(rows[bad[0]])}")
    return pd.Series(numbers, index=rows, name="response")


def check_labels(name: str, received: pd.Index, labels: pd.Index) -> None:
    """Raise DesignError unless the received labels are the expected ones, each once, in any order."""
    by_position = "pass its .to_numpy() to have it read by position"
    twice = received[received.duplicated()]
    if len(twice):
        raise DesignError(
            f"{name} is labelled and aligns by label, each label once: {_text(twice[0])} comes again; give "
            f"replicates as columns, or {by_position}"
        )
    for expected, given, problem in ((labels, received, "lacks"), (received, labels, "has")):
        other = expected[~expected.isin(given)]
        if len(other):
            raise DesignError(
                f"{name} is labelled and aligns by label: it {problem} {_text(other[0])} "
                f"{'of' if problem == 'lacks' else 'besides'} the labels {_listed(labels)}; {by_position}"
            )


def check_replicates(name: str, table: pd.DataFrame) -> None:
    """Raise DesignError unless the columns of a table are numbered, as replicates of one response are."""
    numbered = pd.api.types.is_integer_dtype(table.columns) or table.columns.name == "replicate"
    if table.shape[1] > 1 and not numbered:
        raise DesignError(
            f"{name}: the columns {_listed(table.columns)} of a table are different responses, not "
            "replicates: give one of them, or number the columns of replicates (0, 1, ...)"
        )


def same_labels(names: Sequence[str], tables: Sequence[Any]) -> list[Any]:
    """Return arguments of one length, the labelled ones in the order of the first of them.

    Raises DesignError: two arguments with other labels, or a repeated label in an argument whose order
    differs.
    """
    kept = [(name, table) for name, table in zip(names, tables, strict=True) if isinstance(table, pd.Series)]
    if not kept:
        return list(tables)
    first, order = kept[0][0], kept[0][1].index
    ordered = []
    for name, table in zip(names, tables, strict=True):
        if isinstance(table, pd.Series) and not table.index.equals(order):
            if order.has_duplicates:
                twice = order[order.duplicated()][0]
                raise DesignError(
                    f"{first} and {name} align by label, each label once: {twice!r} comes again"
                )
            check_labels(name, table.index, order)
            table = table.loc[order]
        ordered.append(table)
    return ordered


def _text(label: object) -> str:
    """Write a label: text in quotes, numbers bare."""
    return repr(label) if isinstance(label, str) else str(label)


def _listed(labels: pd.Index, most: int = 8) -> str:
    shown = ", ".join(str(label) for label in labels[:most])
    return shown if len(labels) <= most else f"{shown}, ... ({len(labels)} in all)"
