"""Answers of several methods to the same trials, against the truth and against one another."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from scipy import stats

from experiments.evidence.trials.score import POWER_EDGES, Share, area_text, share
from experiments.evidence.trials.truth import Kind, Label
from experiments.evidence.trials.truths import STRONG

FOREIGN = (Kind.WITHHELD, Kind.OUTSIDE)
"""Kinds of trials whose hidden effect is not in the library."""


def judged(answers: pd.DataFrame, labels: Mapping[str, Label]) -> pd.DataFrame:
    """Set answers (with the columns ``method`` and ``trial``) against the truths.

    They get ``kind``, ``multiple`` (of a pair the smaller), and the judgement: ``named_right`` (what is
    hidden and nothing else), ``tied_right`` (a tie with it among the rivals), ``wrong`` (a name, not a tie,
    that is not hidden, or not in the library), ``right`` (no alarm where nothing is hidden, the right name,
    unknown where the library lacks it). A mechanism that was declared not resolvable is in the library.
    """
    rows = [_judged(row, labels[str(row["trial"])]) for row in answers.to_dict("records")]
    return pd.concat([answers.reset_index(drop=True), pd.DataFrame(rows)], axis=1)


def _judged(answer: Mapping[Any, Any], label: Label) -> dict[str, object]:
    named, truth = set(str(answer["named"]).split()), set(label.mechanisms)
    known = label.kind in (Kind.SINGLE, Kind.PAIR, Kind.UNRESOLVED)
    name_right = known and not answer["tied"] and named == truth
    right = name_right
    if label.kind is Kind.NULL:
        right = not answer["alarm"]
    elif label.kind in FOREIGN:
        right = bool(answer["unknown"])
    return {
        "kind": str(label.kind),
        "multiple": min(label.multiples, default=0.0),
        "named_right": name_right,
        "tied_right": bool(known and answer["tied"] and truth <= named),
        "wrong": bool(named and not answer["tied"] and not (known and named <= truth)),
        "right": bool(right),
    }


def held(answers: pd.DataFrame, allowed: Sequence[str]) -> pd.DataFrame:
    """Hold answers to names that were declared resolvable: one that has another becomes *unknown*."""
    names = answers["named"].astype(str).str.split()
    other = names.map(lambda named: bool(set(named) - set(allowed))).astype(bool)
    beyond = other & ~answers["tied"].astype(bool)
    unknown = answers["unknown"].astype(bool) | beyond
    return answers.assign(unknown=unknown, named=answers["named"].mask(beyond, ""))


@dataclass(frozen=True, eq=False)
class Parts:
    """Answers of one method, by kind of trial."""

    table: pd.DataFrame
    """Rows of `judged`."""

    @property
    def nulls(self) -> pd.DataFrame:
        """Nothing hidden."""
        return self.table[self.table["kind"] == Kind.NULL]

    @property
    def hidden(self) -> pd.DataFrame:
        """Something hidden."""
        return self.table[self.table["kind"] != Kind.NULL]

    @property
    def singles(self) -> pd.DataFrame:
        """One mechanism of the library, of any size."""
        return self.table[self.table["kind"] == Kind.SINGLE]

    @property
    def strong(self) -> pd.DataFrame:
        """One mechanism of the library of one and a half detectable sizes or more."""
        return self.singles[self.singles["multiple"] >= STRONG]

    @property
    def pairs(self) -> pd.DataFrame:
        """Two mechanisms of the library."""
        return self.table[self.table["kind"] == Kind.PAIR]

    @property
    def foreign(self) -> pd.DataFrame:
        """An effect that the library lacks."""
        return self.table[self.table["kind"].isin(FOREIGN)]


def alarm_scores(parts: Parts) -> tuple[np.ndarray, np.ndarray]:
    """Scores of the alarm with and without something hidden."""
    return _scores(parts.hidden["score"]), _scores(parts.nulls["score"])


def outside_scores(parts: Parts) -> tuple[np.ndarray, np.ndarray]:
    """Scores of *not in the library* where that is so, and where one or two strong mechanisms of it act.

    A trial without a score has the least: nothing was said to be missing.
    """
    return _scores(parts.foreign["outside"]), _scores(pd.concat([parts.strong, parts.pairs])["outside"])


def _scores(column: pd.Series) -> np.ndarray:
    return column.astype(float).fillna(-1e9).to_numpy()


def has_outside(parts: Parts) -> bool:
    """Return True for a method that scores *not in the library*."""
    return bool(parts.table["outside"].notna().any())


def summary(table: pd.DataFrame) -> pd.DataFrame:
    """One row a method, in the order of its first answer: its counts and areas, as text."""
    return pd.DataFrame([_summed(name, Parts(rows)) for name, rows in table.groupby("method", sort=False)])


def _summed(name: str, parts: Parts) -> dict[str, str]:
    strong, seconds = parts.strong, float(parts.table["seconds"].mean())
    return {
        "method": name,
        "false alarms": _count(share(parts.nulls["alarm"])),
        "one effect: alarm": _count(share(strong["alarm"])),
        "named": _count(share(strong["named_right"])),
        "in a tie": _count(share(strong["tied_right"])),
        "wrong": _count(share(strong["wrong"])),
        "two: both named": _count(share(parts.pairs["named_right"])),
        "two: wrong": _count(share(parts.pairs["wrong"])),
        "not in the library: unknown": _count(share(parts.foreign["unknown"])),
        "a name for it": _count(share(parts.foreign["wrong"])),
        "seconds": f"{seconds:.1f}" if np.isfinite(seconds) else "",
    }


def _count(found: Share) -> str:
    return f"{found.count} of {found.trials}"


def areas(table: pd.DataFrame) -> pd.DataFrame:
    """Areas under the curves of the alarm and of *unknown* by method, with their intervals, as text."""
    rows = []
    for name, answers in table.groupby("method", sort=False):
        parts = Parts(answers)
        weak = parts.singles[parts.singles["multiple"] < STRONG]
        hidden, nulls = alarm_scores(parts)
        rows.append(
            {
                "method": name,
                "alarm, everything hidden": area_text(hidden, nulls),
                "alarm, weak effects": area_text(_scores(weak["score"]), nulls),
                "unknown": area_text(*outside_scores(parts)) if has_outside(parts) else "no score",
            }
        )
    return pd.DataFrame(rows)


def power(table: pd.DataFrame, column: str) -> pd.DataFrame:
    """Share of trials of one mechanism with something true (``alarm``, ``named_right``), by size.

    Rows are classes of sizes by the mean of their multiples of the detectable one, columns methods; the first
    column is the number of trials.
    """
    singles = table[table["kind"] == Kind.SINGLE]
    classes = pd.cut(singles["multiple"], POWER_EDGES, labels=False)
    singles = singles.assign(multiple=singles.groupby(classes)["multiple"].transform("mean").round(2))
    shares = singles.pivot_table(index="multiple", columns="method", values=column, aggfunc="mean", sort=True)
    shares = shares[list(dict.fromkeys(singles["method"]))]
    shares.insert(0, "trials", singles.groupby("multiple")["trial"].nunique())
    return shares


@dataclass(frozen=True)
class Paired:
    """Two methods on the same trials."""

    first: int
    second: int
    """Trials in which only the first, and only the second, is right."""
    trials: int

    @property
    def p(self) -> float:
        """Exact p value of McNemar's test (1947)."""
        both = self.first + self.second
        return float(stats.binomtest(self.first, both).pvalue) if both else 1.0

    def __str__(self) -> str:
        return f"{self.first} : {self.second} of {self.trials}, p = {self.p:.2g}"


def paired(first: pd.Series, second: pd.Series) -> Paired:
    """Compare what is true of two methods, both by trial."""
    both = first.index.intersection(second.index)
    one, other = first.loc[both].astype(bool), second.loc[both].astype(bool)
    return Paired(int((one & ~other).sum()), int((other & ~one).sum()), len(both))


def due(answers: pd.DataFrame) -> pd.Series:
    """Return True where one answer is due: all but weak effects, and what was declared not resolvable."""
    weak = (answers["kind"] == Kind.SINGLE) & (answers["multiple"] < STRONG)
    return ~weak & (answers["kind"] != Kind.UNRESOLVED)


def comparisons(table: pd.DataFrame, reference: str) -> pd.DataFrame:
    """Paired comparisons of a reference with every other method, as text.

    Quiet where nothing is hidden; an alarm where something is; the whole answer right, of nulls, strong
    effects, pairs and what the library lacks.
    """
    own = table[table["method"] == reference].set_index("trial")
    rows = []
    for name, answers in table[table["method"] != reference].groupby("method", sort=False):
        other = answers.set_index("trial")
        nulls = own["kind"] == Kind.NULL
        full = due(own)
        rows.append(
            {
                "method": name,
                "no false alarm": str(
                    paired(~own.loc[nulls, "alarm"].astype(bool), ~other["alarm"].astype(bool))
                ),
                "alarm": str(paired(own.loc[~nulls, "alarm"], other["alarm"])),
                "right answer": str(paired(own.loc[full, "right"], other["right"])),
            }
        )
    return pd.DataFrame(rows)


def common(table: pd.DataFrame, methods: Sequence[str]) -> pd.DataFrame:
    """Keep the trials that every method has answered."""
    counts = table[table["method"].isin(methods)].groupby("trial")["method"].nunique()
    return table[table["trial"].isin(counts.index[counts == len(methods)])]
