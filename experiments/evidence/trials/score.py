"""The score of the analysis: findings against the revealed truths, and both against what was aimed at."""

import math
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from scipy import stats
from scipy.stats import binomtest

from doe.discrepancy import Verdict
from experiments.evidence.trials.findings import CRASH
from experiments.evidence.trials.truth import Kind, Label, Sealed
from experiments.evidence.trials.truths import STRONG

_JUDGED = ("kind", "truth", "true_size", "multiple", "right", "tied", "wrong")

DRAWS = 2000
"""Draws of a bootstrap over trials."""

POWER_EDGES = (0.0, 0.5, 1.0, 1.5, 2.0, 3.0, math.inf)
"""Ends of the classes of size, in detectable ones."""


@dataclass(frozen=True)
class Share:
    """A count out of a number of trials."""

    count: int
    trials: int

    @property
    def value(self) -> float:
        """The share; NaN without trials."""
        return self.count / self.trials if self.trials else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """Its 95 % interval (Clopper and Pearson 1934); everything without trials."""
        if not self.trials:
            return 0.0, 1.0
        ends = binomtest(self.count, self.trials).proportion_ci(0.95, method="exact")
        return float(ends.low), float(ends.high)

    def __str__(self) -> str:
        if not self.trials:
            return "no trials"
        low, high = self.interval
        return f"{self.count} of {self.trials}, {100 * low:.0f} to {100 * high:.0f} %"


@dataclass(frozen=True)
class Aim:
    """One thing that the trials must show."""

    question: str
    wanted: str
    """In words, as it was fixed beforehand."""
    found: str
    """With its interval."""
    passed: bool | None
    """True if the aim is met, None if nothing was counted."""


def scored(findings: pd.DataFrame, labels: Mapping[str, Label], sealed: Sequence[Sealed]) -> pd.DataFrame:
    """Set every finding against the truth.

    The findings get the columns ``part``, ``kind``, ``truth`` (names parted by blanks), ``true_size`` and
    ``multiple`` (of a pair the smaller), and the judgement: ``right`` (that name, or both, and no other),
    ``tied`` (a tie with the truth in it), ``wrong`` (a name that is not in the truth).
    """
    parts = {trial.trial: trial.part for trial in sealed}
    rows = [_judged(row, labels[row["trial"]]) for row in findings.to_dict("records")]
    judged = pd.DataFrame(rows, index=findings.index, columns=list(_JUDGED)).astype(
        {"right": bool, "tied": bool, "wrong": bool}
    )
    return pd.concat([findings, judged], axis=1).assign(part=findings["trial"].map(parts))


def _judged(finding: dict[Hashable, Any], label: Label) -> dict[str, object]:
    truth, named = set(label.mechanisms), set(str(finding["named"]).split())
    naming = finding["verdict"] == Verdict.NAMED
    known = label.kind in (Kind.SINGLE, Kind.UNRESOLVED, Kind.PAIR)
    return {
        "kind": str(label.kind),
        "truth": " ".join(label.mechanisms),
        "true_size": label.sizes[0][1] if label.sizes else math.nan,
        "multiple": min(label.multiples, default=0.0),
        "right": bool(known and finding["verdict"] == Verdict.NAMED and named == truth),
        "tied": bool(known and finding["verdict"] == Verdict.TIE and truth <= named),
        "wrong": bool(naming and not (known and named <= truth)),
    }


def strong_singles(table: pd.DataFrame) -> pd.DataFrame:
    """Trials of one mechanism that was to be named."""
    return table[(table["kind"] == Kind.SINGLE) & (table["multiple"] > STRONG)]


def share(column: pd.Series) -> Share:
    """Count the true of a boolean column."""
    return Share(int(column.sum()), len(column))


def by_mechanism(table: pd.DataFrame) -> pd.DataFrame:
    """For each mechanism of the library: its strong trials and how they ended, each in one column."""
    strong = strong_singles(table)
    verdicts, tied = strong["verdict"], strong["tied"]
    ends = {
        "trials": verdicts.notna(),
        "right": strong["right"],
        "tied": tied,
        "tie of others": (verdicts == Verdict.TIE) & ~tied,
        "wrong": strong["wrong"],
        "unknown": verdicts == Verdict.UNKNOWN,
        "unseen": verdicts == Verdict.NONE,
        "crash": verdicts == CRASH,
    }
    return pd.DataFrame(ends).groupby(strong["truth"]).sum().rename_axis("mechanism")


def by_outsider(table: pd.DataFrame) -> pd.DataFrame:
    """For each effect that may not be named: its trials and how they ended."""
    outside = table[table["kind"].isin([Kind.UNRESOLVED, Kind.WITHHELD, Kind.OUTSIDE])]
    hidden = outside["truth"] + " (" + outside["kind"] + ")"
    return pd.crosstab(hidden, outside["verdict"], rownames=["effect"], colnames=[None])


def covered(table: pd.DataFrame) -> pd.Series:
    """Return True where the 90 % interval holds the true size, for each right name of one mechanism."""
    right = table[table["right"] & (table["kind"] == Kind.SINGLE)]
    return right["true_size"].between(right["size_low"], right["size_high"])


def aims(
    table: pd.DataFrame, nulls: pd.DataFrame, best: tuple[str, int] | None, foreign: bool
) -> tuple[Aim, ...]:
    """Hold one view's trials, rows of `scored`, against what was aimed at.

    Parameters
    ----------
    nulls : pandas.DataFrame
        Trials that hide nothing, of all series that were sealed together.
    best : (str, int) or None
        Other method that gives the most right names to the strong effects, and their number.
    foreign : bool
        Another code made the heaps.
    """
    kind, verdict, strong = table["kind"], table["verdict"], strong_singles(table)
    unknown = verdict[kind.isin([Kind.WITHHELD, Kind.OUTSIDE])] == Verdict.UNKNOWN
    above, named = "one mechanism above 1.5 gamma80: the right name", int(strong["right"].sum())
    rival = "no answers" if best is None else f"{named}, {best[0]} {best[1]}, of {len(strong)}"
    pooled, pairs = share(nulls["alarm"]), table.loc[kind == Kind.PAIR, "right"]
    return (
        _limit("nothing hidden: alarms", "at most 2.5 %", table.loc[kind == Kind.NULL, "alarm"], most=0.025),
        Aim(
            "nothing hidden: alarms, with the series sealed together",
            "upper limit below 8 %",
            str(pooled),
            pooled.interval[1] < 0.08 if pooled.trials else None,
        ),
        _limit(above, "at least 92 %", strong["right"], least=0.92),
        Aim(above, "as many as the best other method", rival, None if best is None else named >= best[1]),
        _limit("any trial: a wrong name", "at most 1 %", table["wrong"], most=0.01),
        _limit("outside the library: unknown", "at least 95 %", unknown, least=0.95),
        *([_limit("two mechanisms: both named", "at least 60 %", pairs, least=0.60)] if foreign else []),
        _limit("named: size within its 90 % interval", "87 to 93 %", covered(table), least=0.87, most=0.93),
        _limit("analyses that crashed", "none", verdict == CRASH, most=0.0),
    )


def unknown_area(table: pd.DataFrame) -> str:
    """Area under the curve of *unknown*, by the misfit of the closest model, of one view's trials, as text.

    What the library lacks against one or two strong mechanisms of it. A trial without an alarm has the least
    score: nothing was said to be missing. Empty where no finding has a score, as in older records.
    """
    if not table["misfit"].notna().any():
        return ""
    strong = pd.concat([strong_singles(table), table[table["kind"] == Kind.PAIR]])
    foreign = table[table["kind"].isin([Kind.WITHHELD, Kind.OUTSIDE])]
    scores = (rows["misfit"].astype(float).fillna(-np.inf).to_numpy() for rows in (foreign, strong))
    return area_text(*scores)


def _limit(question: str, wanted: str, column: pd.Series, least: float = 0.0, most: float = 1.0) -> Aim:
    found = share(column)
    passed = least <= found.value <= most if found.trials else None
    value = f"{100 * found.value:.1f} % ({found})" if found.trials else str(found)
    return Aim(question, wanted, value, passed)


def auroc(positive: np.ndarray, negative: np.ndarray) -> float:
    """Return the probability that a positive score is the larger; ties count half (Mann and Whitney 1947)."""
    if not len(positive) or not len(negative):
        return float("nan")
    return float(_areas(positive, negative))


def _areas(positive: np.ndarray, negative: np.ndarray) -> np.ndarray:
    """Areas of classes along the last axis."""
    first, second = positive.shape[-1], negative.shape[-1]
    ranks = stats.rankdata(np.concatenate([positive, negative], axis=-1), axis=-1)
    above = ranks[..., :first].sum(axis=-1) - first * (first + 1) / 2.0
    return np.asarray(above / (first * second))


def area_text(positive: np.ndarray, negative: np.ndarray) -> str:
    """Format the area with its 95 % interval, by a bootstrap over the trials of each class."""
    if not len(positive) or not len(negative):
        return "no trials"
    rng = np.random.default_rng(0)
    classes = (positive, negative)
    drawn = [[rng.choice(each, len(each)) for each in classes] for _ in range(DRAWS)]
    low, high = np.quantile(_areas(*map(np.array, zip(*drawn, strict=True))), [0.025, 0.975])
    return f"{auroc(positive, negative):.3f} ({low:.2f} to {high:.2f})"
