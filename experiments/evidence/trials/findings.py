"""Findings of the analyses of the trials: one row a trial and view."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import pandas as pd

from doe.discrepancy import Discovery, Interval, Verdict
from experiments.io.files import replacing
from experiments.studyfile.observables import NAMES, OUTLINE, PHOTOGRAPHED

EVERYTHING = "everything"
"""View of an analysis that has every number that is measured of a heap, and no outline."""

PHOTOGRAPHS = "photographs"
"""View of an analysis that has only what a photograph shows."""

OUTLINED = "outlined"
"""View of an analysis that has everything and the outline, as whoever brings numbers and pictures."""

_OUTLINE = tuple(each.name for each in OUTLINE)

VIEWS = {EVERYTHING: NAMES, OUTLINED: (*NAMES, *_OUTLINE), PHOTOGRAPHS: (*PHOTOGRAPHED, *_OUTLINE)}
"""Observables that an analysis has, by its view; of a bank without outlines all have the others."""

CRASH = "crash"
"""Verdict of an analysis that raised."""


@dataclass(frozen=True)
class Crash:
    """An analysis that raised: a result of a trial like any other."""

    traceback: str


@dataclass(frozen=True)
class Finding:
    """Part of an analysis that is kept."""

    trial: str
    view: str
    verdict: str
    """A `Verdict`, or "crash"."""
    named: str = ""
    """Mechanisms of the verdict, parted by blanks."""
    alarm: bool = False
    """True if the base model was found to disagree."""
    size: float = math.nan
    size_low: float = math.nan
    size_high: float = math.nan
    """Size of the first named mechanism, with its 90 % interval; NaN if no mechanism is named."""
    q: float = math.nan
    degrees_of_freedom: float = math.nan
    """P value of the base."""
    held_out_before: float = math.nan
    held_out_after: float = math.nan
    """Q of the held-out conditions without and with the mechanism, from fresh runs; NaN without."""
    held_out_degrees: float = math.nan
    """Their degrees of freedom."""
    fresh_cases: int = 0
    misfit: float = math.nan
    """Score of *unknown* (`misfit_of`); NaN without an alarm, and in older records."""
    reason: str = ""
    """Rule that gave the verdict, or the last line of the crash."""

    @classmethod
    def of(cls, trial: str, view: str, end: Discovery | Crash) -> Finding:
        """Take what is kept from an analysis."""
        if isinstance(end, Crash):
            return cls(trial, view, CRASH, reason=end.traceback.strip().splitlines()[-1])
        named = end.named if end.verdict in (Verdict.NAMED, Verdict.TIE) else ()
        size = Interval(math.nan, math.nan, math.nan)
        if end.chosen is not None and end.verdict is not Verdict.TIE and end.chosen.sizes:
            size = end.chosen.sizes[0]
        held_out = next((part for part in end.before_after if part.held_out), None)
        return cls(
            trial=trial,
            view=view,
            verdict=str(end.verdict),
            named=" ".join(sorted(named)),
            alarm=bool(end.gap and end.gap.found),
            size=size.value,
            size_low=size.low,
            size_high=size.high,
            q=end.base.q if end.base else math.nan,
            degrees_of_freedom=end.base.degrees_of_freedom if end.base else math.nan,
            held_out_before=held_out.before.value if held_out else math.nan,
            held_out_after=held_out.after.value if held_out else math.nan,
            held_out_degrees=held_out.degrees_of_freedom if held_out else math.nan,
            fresh_cases=end.effort.fresh_cases,
            misfit=misfit_of(end),
            reason=end.reason,
        )


COLUMNS = tuple(field.name for field in fields(Finding))


def surprise(p: float, ratio: float) -> float:
    """Minus the logarithm of a p value; those that a bootstrap cannot part sort by Q over its freedom."""
    return -math.log10(p) + 1e-3 * ratio


def misfit_of(found: Discovery) -> float:
    """Compute the `surprise` at the model that was chosen or comes closest, the score of *unknown*."""
    best = found.chosen if found.chosen is not None else found.closest
    return math.nan if best is None else surprise(best.p_value, best.q / max(best.degrees_of_freedom, 1))


def findings_table(findings: Iterable[Finding]) -> pd.DataFrame:
    """One row a finding, sorted by view and trial."""
    table = pd.DataFrame(list(findings), columns=list(COLUMNS))
    return table.sort_values(["view", "trial"], ignore_index=True)


def read_findings(paths: Sequence[Path]) -> pd.DataFrame:
    """Read tables of findings as one."""
    if not paths:
        return findings_table([])
    text = dict.fromkeys(("trial", "view", "verdict", "named", "reason"), str)
    tables = [pd.read_csv(path, dtype=text, keep_default_na=False, na_values=["nan"]) for path in paths]
    return pd.concat(tables).reindex(columns=COLUMNS).sort_values(["view", "trial"], ignore_index=True)


def write_findings(path: Path, table: pd.DataFrame) -> None:
    """Write a table of findings, whole or not at all."""
    with replacing(path) as temporary:
        table.to_csv(temporary, index=False, na_rep="nan", lineterminator="\n", float_format="%.6g")
