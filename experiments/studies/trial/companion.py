"""Companion of the trial study: what was hidden in the heaps that come with it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from doe.discrepancy import Discovery
from experiments.report.discovery.terms import Terms
from experiments.report.kit.html import Chapter
from experiments.report.kit.numbers import MISSING, estimate, trimmed
from experiments.report.kit.table import Layout, Table, columns, make_table
from experiments.report.study_companion import Companion

NORMAL_90 = 1.645
"""Standard errors to either side that hold a normal value with 90 %."""

TEXT = (
    "These heaps were simulated, so that the search can be held against the truth. It knew nothing of it: "
    "this chapter was added when the verdict was in."
)


@dataclass(frozen=True)
class Truth:
    """Settings of the simulation that stood for reality."""

    factors: Mapping[str, float]
    """In natural units."""
    mechanisms: Mapping[str, float]
    """Sizes of the effects that the study lacks."""


TRUTHS = {"tilted-bench.csv": Truth({"mu_gg": 0.55, "mu_gw": 0.45, "e_gg": 0.35}, {"plate_tilt": 5.0})}
"""Truth of each file of heaps in this folder; the head of the file has it too."""


class TrialCompanion(Companion):
    """Truth behind the shipped data, next to the findings of the search."""

    def discovery_chapters(self, found: Discovery, terms: Terms, data: Path) -> Sequence[Chapter]:
        """Chapter on what was hidden, where the data are shipped ones; a copy of them counts."""
        text = data.read_text(encoding="utf-8")
        for name, truth in TRUTHS.items():
            if Path(__file__).with_name(name).read_text(encoding="utf-8") == text:
                tables = {"hidden": truth_table(truth, found, terms)}
                return [Chapter("hidden", "What was hidden", tables, text=TEXT)]
        return ()


def truth_table(truth: Truth, found: Discovery, terms: Terms) -> Table:
    """Compare what was hidden with what was found: effects, then factors."""
    fit = found.chosen if found.named else found.base
    effects = dict(zip(fit.mechanisms, fit.sizes, strict=True)) if fit else {}
    rows = []
    for name in dict.fromkeys([*truth.mechanisms, *effects]):
        hidden, size = truth.mechanisms.get(name, 0.0), effects.get(name)
        rows.append(
            {
                "what": terms.title(name),
                "hidden": terms.value(name, hidden),
                "found": terms.short_size(name, size) if size else "not named",
                "within": _within(hidden, size.low, size.high) if size else MISSING,
            }
        )
    thetas = zip(found.factors, fit.theta, fit.theta_se, strict=True) if fit else ()
    for name, value, error in thetas:
        hidden, low, high = truth.factors[name], value - NORMAL_90 * error, value + NORMAL_90 * error
        row = {"what": terms.factors[name].label, "hidden": trimmed(hidden, 3)}
        rows.append(row | {"found": estimate(value, low, high, 3), "within": _within(hidden, low, high)})
    shown: Layout = ["what", "hidden", *columns(found="found, 90 % interval", within="interval holds it")]
    return make_table("hidden", pd.DataFrame(rows), shown, "Truth and findings.")


def _within(value: float, low: float, high: float) -> str:
    return "yes" if low <= value <= high else "no"


COMPANION = TrialCompanion()
