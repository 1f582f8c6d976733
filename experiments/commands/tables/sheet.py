"""A user's table of runs as a design with its responses."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from doe import Category, Design, Factor, Mixture
from experiments.io.errors import InputError
from experiments.io.rows import Row, read_rows
from experiments.io.texts import is_number, nearest_name, number

RUN = (
    "run", "std", "stdorder", "std order", "standard order", "run no", "run no.", "no", "no.", "nr", "nr.",
    "id", "trial", "test", "experiment", "versuch", "lauf", "essai", "ensayo", "corrida",
)  # fmt: skip
"""Heads of the column with the runs' labels, in small letters."""
ORDER = ("order", "runorder", "run order", "pttype", "pattern", "space type")
"""Heads of columns that other programs write and no analysis needs."""
BLOCK = ("block", "blocks")
DUMMY = re.compile(r"(dummy|d)[ _-]?\d+", re.IGNORECASE)
HEAD = re.compile(r"(?P<name>.*?)\s*[\[(](?P<unit>[^\])]*)[\])]")
LETTER = re.compile(r"^[A-Z]: ?(?=.)")
"""Letter of a factor that Design-Expert writes before its name, which a model's terms could not have."""
LEVELS = re.compile(r"(?P<low>[-+.\deE]+)\s*\.\.\s*(?P<high>[-+.\deE]+)\s*(?P<unit>.*)")


@dataclass(frozen=True)
class Columns:
    """Columns of a table, as the options of a command name them."""

    factors: Sequence[str] = ()
    """``NAME`` or ``NAME=LOW..HIGH UNIT``. Default: the columns before the responses."""
    responses: Sequence[str] = ()
    """Default: the last column."""
    block: str | None = None
    """Default: a column ``block``."""
    dummies: Sequence[str] = ()
    """Default: columns ``dummy 1``, ``dummy 2``, ..."""


@dataclass(frozen=True, eq=False)
class Sheet:
    """A table's design, and its responses by run; a run without a value has NaN."""

    path: Path
    design: Design
    responses: pd.DataFrame

    def observed(self, name: str) -> tuple[Design, pd.Series]:
        """Return the design of the runs that have a response, and their values."""
        values = self.responses[name].dropna()
        if values.empty:
            raise InputError(str(self.path), f"column {name!r} has no value yet")
        if len(values) == len(self.design.coded):
            return self.design, values
        design = self.design.select(list(values.index))
        return design, values.set_axis(design.coded.index)


def read_sheet(path: Path, columns: Columns) -> Sheet:
    """Read a table of runs, with factors in natural or coded units.

    Raises
    ------
    InputError
        A column that is missing or has a cell that is not a number, or a table without runs.
    """
    frame, places = read_frame(path)
    block = _one(path, frame, columns.block, BLOCK)
    run = _one(path, frame, None, RUN)
    responses = [_known(path, frame, name) for name in columns.responses] or [str(frame.columns[-1])]
    dummies = [_known(path, frame, name) for name in columns.dummies]
    dummies = dummies or [name for name in frame.columns if DUMMY.fullmatch(name)]
    given = {text.partition("=")[0].strip(): text.partition("=")[2].strip() for text in columns.factors}
    taken = {block, run, *responses, *dummies}
    before = frame.columns[: min(map(list(frame.columns).index, responses))]
    rest = [name for name in before if name not in taken and name.lower() not in (*RUN, *ORDER)]
    names = [_known(path, frame, name) for name in given] or rest
    if not names:
        raise InputError(str(path), "has no column left for a factor", ", ".join(frame.columns))
    frame.index = _labels(path, frame, run)
    numbers = frame.assign(**{n: _numbers(frame, n, places) for n in (*responses, *dummies)})
    numbers = numbers.assign(**{n: _factor_column(frame, n, places) for n in names})
    parts = dict(zip(names, given.values(), strict=True)) if given else {}
    factors = _factors(numbers[names], parts, places)
    table = numbers[[*names, *dummies, *([block] if block else [])]]
    table = table.rename(columns=dict(zip(names, (factor.name for factor in factors), strict=True)))
    design = Design.from_table(table, factors, coded=False, dummies=dummies, block=block)
    return Sheet(path, design, numbers[responses])


def read_columns(path: Path, names: Sequence[str]) -> pd.DataFrame:
    """Read different columns of numbers by their names, in the rows that have all of them."""
    frame, places = read_frame(path)
    heads = [_known(path, frame, name) for name in names]
    if len(set(heads)) < len(heads):
        raise InputError(str(path), "needs different columns", ", ".join(names))
    return pd.DataFrame({head: _numbers(frame, head, places) for head in heads}).dropna()


def read_mixture(path: Path, responses: Sequence[str]) -> tuple[Mixture, pd.Series]:
    """Read a table of blends, whose other columns are the components' shares."""
    frame, places = read_frame(path)
    name = _known(path, frame, responses[0]) if responses else str(frame.columns[-1])
    run = _one(path, frame, None, RUN)
    frame.index = _labels(path, frame, run)
    names = [each for each in frame.columns if each not in (name, run) and each.lower() not in (*RUN, *ORDER)]
    shares = pd.DataFrame({each: _numbers(frame, each, places) for each in names})
    return Mixture(shares, dict.fromkeys(names, 0.0)), _numbers(frame, name, places)


def read_frame(path: Path) -> tuple[pd.DataFrame, list[Row]]:
    """Return a table's cells as texts, and its rows with their places."""
    rows = list(read_rows(path, (), None))
    return pd.DataFrame([{n: row[n] for n in rows[0].cells if n} for row in rows]), rows


def _known(path: Path, frame: pd.DataFrame, name: str) -> str:
    """Return the column of a name, which may leave out the unit of its head."""
    found = [head for head in frame.columns if name == head]
    found = found or [head for head in frame.columns if name == _split_head(head)[0]]
    if len(found) > 1:
        raise InputError(str(path), f"has several columns {name!r}: name one with its unit", ", ".join(found))
    if not found:
        raise InputError(str(path), f"has no column {name!r}; {nearest_name(name, list(frame.columns))}")
    return str(found[0])


def _one(path: Path, frame: pd.DataFrame, given: str | None, usual: Sequence[str]) -> str | None:
    if given is not None:
        return _known(path, frame, given)
    return next((name for name in frame.columns if name.lower() in usual), None)


def _split_head(head: str) -> tuple[str, str]:
    parts = HEAD.fullmatch(head := LETTER.sub("", head))
    return (parts["name"], parts["unit"].strip()) if parts else (head, "")


def _labels(path: Path, frame: pd.DataFrame, run: str | None) -> pd.Index:
    """Return the runs' labels; those of the table if each has its own."""
    if run is None or frame[run].duplicated().any() or (frame[run] == "").any():
        return pd.RangeIndex(1, len(frame) + 1, name="run")
    whole = frame[run].str.fullmatch(r"\d+").all()
    return pd.Index(frame[run].astype(int) if whole else frame[run], name="run")


def _numbers(frame: pd.DataFrame, name: str, places: Sequence[Row]) -> pd.Series:
    """Return a column's numbers; NaN for an empty cell."""
    for row in places:
        if re.fullmatch(r"[+-]?[1-9]\d{0,2}(,\d{3})+", row[name]):
            raise row.error("may be thousands or a decimal number: write it without a comma", name)
        if row[name] and not is_number(row[name]):
            raise row.error("must be a number, or empty", name)
    return frame[name].map(lambda cell: number(cell) if cell else np.nan).astype(float)


def _factor_column(frame: pd.DataFrame, name: str, places: Sequence[Row]) -> pd.Series:
    """Return a factor's numbers, or its texts if it has names as levels."""
    for row in places:
        if not row[name]:
            raise row.error("must have a setting", name)
    return _numbers(frame, name, places) if all(map(is_number, frame[name])) else frame[name]


def _factors(settings: pd.DataFrame, given: dict[str, str], places: Sequence[Row]) -> list[Factor]:
    """Return the factors of a table's columns, with the levels that were given or that the runs show."""
    texts = settings.select_dtypes(exclude="number").columns
    numbers = settings.drop(columns=texts)
    factors: list[Factor] = []
    for name in settings.columns:
        if name in texts:
            factors.append(Category(_split_head(name)[0], levels=tuple(dict.fromkeys(settings[name]))))
        elif given.get(name):
            factors.append(read_factor(f"{_split_head(name)[0]}={given[name]}"))
        else:
            low, high = coded_levels(numbers, name)
            if not low < high:
                raise places[0].error("must have two levels or more", name)
            factors.append(Factor(_split_head(name)[0], low, high, _split_head(name)[1]))
    return factors


def coded_levels(numbers: pd.DataFrame, name: str) -> tuple[float, float]:
    """Return the levels of a factor that are coded -1 and +1: its range without axial runs.

    An axial run has all other factors at their centers, and this one not.
    """
    centers = (numbers.min() + numbers.max()) / 2.0
    is_center = np.isclose(numbers, centers, rtol=1e-9, atol=1e-9 * (numbers.max() - numbers.min()))
    own = numbers.columns.get_loc(name)
    axial = np.delete(is_center, own, axis=1).all(axis=1) & ~is_center[:, own]
    column = numbers[name]
    kept = column[~axial] if np.ptp(column[~axial]) > 0.0 else column
    return float(kept.min()), float(kept.max())


def read_factor(text: str, place: str = "--factor") -> Factor:
    """Read ``NAME=LOW..HIGH UNIT``, or the levels of a category ``NAME=one,two,three``."""
    name, _, levels = (part.strip() for part in text.partition("="))
    parts = LEVELS.fullmatch(levels)
    if parts and is_number(parts["low"], ",") and is_number(parts["high"], ","):
        return Factor(name, float(parts["low"]), float(parts["high"]), parts["unit"].strip("[] "))
    if "," in levels:
        return Category(name, levels=tuple(level.strip() for level in levels.split(",")))
    hint = "Write NAME=LOW..HIGH, NAME=LOW..HIGH UNIT, or NAME=one,two for a category."
    raise InputError(place, "needs a name and its levels", text, hint)
