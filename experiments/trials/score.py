"""The score of the analysis: findings against the revealed truths, and both against what was aimed at."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import binomtest

from doe.discrepancy import Verdict
from experiments.discover.library import FORMER_NAMES
from experiments.trials.drawing import STRONG, Declared
from experiments.trials.findings import CRASH
from experiments.trials.truth import Kind, Label, Sealed

_JUDGED = ("kind", "truth", "true_size", "multiple", "right", "tied", "wrong")

OTHERS = ("weak single", *map(str, Kind), "two names", *map(str, Verdict), CRASH)
"""Labels of a confusion that name no mechanism."""

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
    """None where too few trials ran to say."""


def scored(findings: pd.DataFrame, labels: Mapping[str, Label], sealed: Sequence[Sealed]) -> pd.DataFrame:
    """Set every finding against the truth.

    Parameters
    ----------
    findings
        As `findings_table` builds it.
    labels
        Revealed labels by trial.
    sealed
        What was known beforehand.

    Returns
    -------
    pandas.DataFrame
        The findings with ``part``, ``kind``, ``truth`` (names parted by blanks), ``true_size`` and
        ``multiple`` (of a pair the smaller), and the judgement: ``right`` (that name, or both, and no
        other), ``tied`` (a tie with the truth in it), ``wrong`` (a name that is not in the truth).
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


def confusion(table: pd.DataFrame) -> pd.DataFrame:
    """Count answers (columns) by truth (rows).

    A mechanism's row has its trials above 1.5 detectable sizes; the weaker ones of all are one row. Two names
    are one column, as are the verdicts without a name.
    """
    strong = (table["kind"] == Kind.SINGLE) & (table["multiple"] > STRONG)
    weak = (table["kind"] == Kind.SINGLE) & ~strong
    truth = table["truth"].where(strong, table["kind"].mask(weak, "weak single"))
    names, naming = table["named"].str.split(), table["verdict"] == Verdict.NAMED
    answer = table["verdict"].mask(naming, table["named"]).mask(naming & (names.str.len() > 1), "two names")
    counts = pd.crosstab(truth, answer, rownames=["truth"], colnames=["answer"])
    return counts.reindex(index=_names_first(counts.index), columns=_names_first(counts.columns))


def _names_first(labels: Iterable[str]) -> list[str]:
    """Sort labels: mechanisms by name, then kinds of trials or verdicts."""
    return sorted(labels, key=lambda label: (OTHERS.index(label) if label in OTHERS else -1, label))


def power_curve(table: pd.DataFrame) -> pd.DataFrame:
    """Shares of alarms and of right names by effect, over all trials of one resolvable mechanism.

    Returns
    -------
    pandas.DataFrame
        One row a class of size: its ends ``least`` and ``most`` (in detectable ones), ``trials``, and for
        ``alarm`` and ``right`` the share with the ends of its interval.
    """
    singles = table[(table["kind"] == Kind.SINGLE) & (table["multiple"] > 0)]
    rows = []
    classes = pd.cut(singles["multiple"], POWER_EDGES, labels=False)
    for number, members in singles.groupby(classes):
        least, most = POWER_EDGES[int(number) : int(number) + 2]  # type: ignore[call-overload]
        row = {"least": least, "most": most, "trials": len(members)}
        for name in ("alarm", "right"):
            counted = share(members[name])
            row |= {
                name: counted.value,
                f"{name}_low": counted.interval[0],
                f"{name}_high": counted.interval[1],
            }
        rows.append(row)
    return pd.DataFrame(rows)


def by_mechanism(table: pd.DataFrame) -> pd.DataFrame:
    """For each mechanism of the library: its strong trials and how they ended, each in one column."""
    rows = {}
    for name, members in strong_singles(table).groupby("truth"):
        verdicts = members["verdict"]
        rows[name] = {
            "trials": len(members),
            "right": int(members["right"].sum()),
            "tied": int(members["tied"].sum()),
            "tie of others": int(((verdicts == Verdict.TIE) & ~members["tied"]).sum()),
            "wrong": int(members["wrong"].sum()),
            "unknown": int((verdicts == Verdict.UNKNOWN).sum()),
            "unseen": int((verdicts == Verdict.NONE).sum()),
            "crash": int((verdicts == CRASH).sum()),
        }
    return pd.DataFrame.from_dict(rows, orient="index").rename_axis("mechanism")


def by_outsider(table: pd.DataFrame) -> pd.DataFrame:
    """For each effect that may not be named: its trials and how they ended."""
    outside = table[table["kind"].isin([Kind.UNRESOLVED, Kind.WITHHELD, Kind.STRANGER])]
    hidden = outside["truth"] + " (" + outside["kind"] + ")"
    return pd.crosstab(hidden, outside["verdict"], rownames=["effect"], colnames=[None])


def removed(table: pd.DataFrame) -> np.ndarray:
    """Share of the held-out excess that is gone, of every right name whose held-out gap was there before.

    The excess is Q less its degrees of freedom, 0 at the least; without one, there is nothing to remove.
    """
    right = table[table["right"]]
    before = np.maximum(right["held_out_before"] - right["held_out_degrees"], 0.0)
    after = np.maximum(right["held_out_after"] - right["held_out_degrees"], 0.0)
    there = before > 0
    return np.asarray(1.0 - after[there] / before[there], dtype=np.float64)


def covered(table: pd.DataFrame) -> Share:
    """Count the stated 90 % intervals that hold the true size, over right names of single mechanisms."""
    right = table[table["right"] & (table["kind"] == Kind.SINGLE)]
    inside = (right["size_low"] <= right["true_size"]) & (right["true_size"] <= right["size_high"])
    return share(inside)


def aims(table: pd.DataFrame, unresolvable: Sequence[str]) -> tuple[Aim, ...]:
    """Hold one view's trials against what was aimed at.

    Parameters
    ----------
    table
        Rows of `scored` of one view.
    unresolvable
        Mechanisms that were declared not resolvable beforehand.
    """
    strong = strong_singles(table)
    crashes = share(table["verdict"] == CRASH)
    return (
        *_null_aims(table[table["kind"] == Kind.NULL]),
        *_naming_aims(strong),
        *_honesty_aims(table, unresolvable),
        *_size_aims(table),
        *_pair_aims(table[table["kind"] == Kind.PAIR]),
        Aim("analyses that crashed", "none", str(crashes), crashes.count == 0 if len(table) else None),
    )


MUST_RESOLVE = (
    "contact_adhesion",
    "liquid_bridges",
    "size_spread",
    "plate_tilt",
    "vibration",
    "rolling_torque",
)
"""Mechanisms that must be resolvable at half of their range; that of rolling is missing from the base."""


def declared_aim(library: Sequence[Declared]) -> Aim:
    """Hold what was declared beforehand against the mechanisms that must be resolvable."""
    # Sealed records keep the names that they were sealed with.
    sealed = {FORMER_NAMES.get(effect.name, effect.name): effect.name for effect in library}
    wanted = [sealed.get(name, name) for name in MUST_RESOLVE]
    seen = {effect.name for effect in library if effect.resolvable and effect.strongest >= 2.0}
    missing = [name for name in wanted if name not in seen]
    found = f"not {', '.join(missing)}" if missing else "every one"
    question = f"resolvable at half of their range: {', '.join(wanted)}"
    return Aim(question, "every one", found, not missing)


def _null_aims(nulls: pd.DataFrame) -> tuple[Aim, ...]:
    alarms, wrong = share(nulls["alarm"]), share(nulls["wrong"])
    return (
        _limit("nothing hidden: alarms", "at most 5 in 100", alarms, most=0.05),
        _limit("nothing hidden: wrong names", "at most 1 in 100", wrong, most=0.01),
    )


def _naming_aims(strong: pd.DataFrame) -> tuple[Aim, ...]:
    above = "one mechanism above 1.5 gamma80"
    counts = by_mechanism(strong)
    enough = len(counts) >= 8 and bool((counts["trials"] >= 15).all())
    least = f"{len(counts)} mechanisms, {counts['trials'].min()} trials at least" if len(counts) else "none"
    each = [f"{name} {row.right} of {row.trials}" for name, row in counts.iterrows()]
    return (
        Aim("mechanisms with strong trials", "8 mechanisms, 15 trials each", least, enough),
        _limit(f"{above}: the right name", "at least 80 %", share(strong["right"]), least=0.80),
        Aim(
            f"{above}: the right name, each mechanism",
            "at least 11 of 15",
            ", ".join(each) or "no trials",
            bool((counts["right"] >= 11 / 15 * counts["trials"]).all()) if len(counts) else None,
        ),
        _limit(
            f"{above}: right or in a tie",
            "at least 90 %",
            share(strong["right"] | strong["tied"]),
            least=0.90,
        ),
        _limit(f"{above}: a wrong name", "at most 3 %", share(strong["wrong"]), most=0.03),
    )


def _honesty_aims(table: pd.DataFrame, unresolvable: Sequence[str]) -> tuple[Aim, ...]:
    outside = table[table["kind"].isin([Kind.WITHHELD, Kind.STRANGER])]
    named = table.loc[table["verdict"] == Verdict.NAMED, "named"].str.split()
    forbidden = share(named.map(lambda names: bool(set(names) & set(unresolvable))).astype(bool))
    unknown = share(outside["verdict"] == Verdict.UNKNOWN)
    return (
        _limit("outside the library: unknown", "at least 90 % of 60", unknown, least=0.90),
        Aim(
            "names that were declared not resolvable",
            "none",
            str(forbidden),
            forbidden.count == 0 if forbidden.trials else None,
        ),
    )


def _size_aims(table: pd.DataFrame) -> tuple[Aim, ...]:
    gone, inside = removed(table), covered(table)
    median = float(np.median(gone)) if len(gone) else math.nan
    return (
        Aim(
            "named: held-out excess removed, median",
            "at least 80 %",
            f"{100 * median:.0f} %, {len(gone)} trials" if len(gone) else "no trials",
            median >= 0.80 if len(gone) else None,
        ),
        _limit("named: size within its 90 % interval", "82 to 96 %", inside, least=0.82, most=0.96),
    )


def _pair_aims(pairs: pd.DataFrame) -> tuple[Aim, ...]:
    clean = share(~pairs["wrong"].astype(bool))
    return (
        _limit("two mechanisms: both named", "at least half", share(pairs["right"]), least=0.50),
        _limit("two mechanisms: no wrong name", "at least 95 %", clean, least=0.95),
    )


def _limit(question: str, wanted: str, found: Share, least: float = 0.0, most: float = 1.0) -> Aim:
    passed = least <= found.value <= most if found.trials else None
    value = f"{100 * found.value:.0f} % ({found})" if found.trials else str(found)
    return Aim(question, wanted, value, passed)
