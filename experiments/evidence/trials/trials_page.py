"""The record of the trials: tables and one page, written from its own files."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from experiments.evidence.record_page import markdown_table, write_page
from experiments.evidence.trials.declaration import Declaration, read_declaration
from experiments.evidence.trials.findings import EVERYTHING, OUTLINED, read_findings
from experiments.evidence.trials.score import (
    Aim,
    aims,
    by_mechanism,
    by_outsider,
    foreign_aims,
    scored,
    unknown_area,
)
from experiments.evidence.trials.trials_folder import (
    DECLARED,
    FINDINGS,
    LABELS,
    NOTES,
    PAGE,
    REALITY,
    RUNS,
    SEALED,
)
from experiments.evidence.trials.truth import opened, read_labels, read_sealed, read_sealed_json, revealed
from experiments.evidence.trials.truths import STRONG

TITLES = {
    EVERYTHING: "With every observable",
    OUTLINED: "With every observable, and the outlines of the photographs",
}

_VERDICTS = {True: "pass", False: "**FAIL**", None: "too few"}

_OURS = """# Blind trials of the search for a missing mechanism

Heaps of the real engine with a hidden effect: drawn and simulated by a generator that runs apart from the
analysis, with seeds, time step and camera of its own."""

_FOREIGN = """# A second reality: blind trials whose heaps {code} makes

Heaps of {code} with a hidden effect: laws, filling, walls, time step, seeds and camera are its own, drawn by
a generator that runs apart from the analysis."""

_SEALED = """The truths were sealed by salted hashes (`sealed.csv`)
before anything was simulated, and revealed (`labels.json`) when the verdicts below were in. What was
declared beforehand, the settings of the analysis by their hash and the smallest effect that it should see of
each mechanism (gamma80), stands in `declared.json`. An effect is the distance of a size from the mechanism's
null, counted in gamma80; *strong* is above 1.5. A verdict is right that names the hidden mechanism (or both)
and nothing else; it is wrong as soon as it names one that is not there. Intervals of shares are 95 %
(Clopper and Pearson).
"""


@dataclass(frozen=True, eq=False)
class Record:
    """A record of trials, its findings judged."""

    declaration: Declaration
    table: pd.DataFrame
    """Rows of `scored`, of every view."""
    sealed: int
    """Number of sealed trials; those that have not been analysed are in no row."""
    reality: dict[str, Any] | None = None
    """Code that made the heaps, and how it makes each effect; None: the engine made them."""

    @property
    def code(self) -> str:
        """Name of the code that made the heaps."""
        return str(self.reality["name"]) if self.reality else "dem-warp"

    @property
    def title(self) -> str:
        """Code, scale and number of trials."""
        scale, done = self.declaration.scale or "as written", self.table["trial"].nunique()
        return f"{self.code}, {scale}, {done} of {self.sealed} trials"

    def in_view(self, view: str = EVERYTHING) -> pd.DataFrame:
        """Return the findings of one view."""
        return self.table[self.table["view"] == view]

    def aims(self, view: str = EVERYTHING) -> tuple[Aim, ...]:
        """Compare one view with its aims."""
        rows = self.in_view(view)
        if self.reality:
            return foreign_aims(rows)
        return aims(rows, [effect.name for effect in self.declaration.library if not effect.resolvable])


def read_record(folder: Path) -> Record:
    """Read a record; labels of trials that have not been analysed may be missing."""
    findings, sealed = read_findings([folder / FINDINGS]), read_sealed(folder / SEALED)
    truths = revealed(read_labels(folder / LABELS), opened(sealed, findings["trial"]))
    reality = folder / REALITY
    made_by = read_sealed_json(reality) if reality.is_file() else None
    return Record(read_declaration(folder / DECLARED), scored(findings, truths, sealed), len(sealed), made_by)


def write_trials_page(folder: Path) -> Path:
    """Write the page of a record from its files, its notes after the introduction."""
    record, notes = read_record(folder), folder / NOTES
    heaps = _FOREIGN.format(code=record.code) if record.reality else _OURS
    parts = [f"{heaps} {_SEALED}", *([notes.read_text(encoding="utf-8")] if notes.is_file() else [])]
    parts += [_runs(folder / RUNS), _declared(record.declaration)]
    if record.reality:
        parts.append(_made(record.reality))
    for view, title in TITLES.items():
        if done := len(record.in_view(view)):
            some = f" of {record.sealed}" if done < record.sealed else ""
            parts += _view(record, view, f"## {title}\n\n{done}{some} trials.")
    return write_page(folder / PAGE, *parts)


def _made(reality: dict[str, Any]) -> str:
    """Say how another code makes each effect."""
    rows = [{"effect": name, "made by": text} for name, text in reality["library"].items()]
    strange = [{"outside the library": name, "what it is": text} for name, text in reality["outside"].items()]
    text = f"## How {reality['name']} makes it\n\n{reality['laws']}.\n\n{markdown_table(pd.DataFrame(rows))}"
    return f"{text}\n{markdown_table(pd.DataFrame(strange))}"


def _runs(path: Path) -> str:
    runs = pd.read_csv(path)
    cases, hours = int(runs["cases"].sum()), runs["seconds"].sum() / 3600
    text = f"{cases} cases in {hours:.2f} h of wall time with the statistics (`{path.name}`)."
    totals = runs.groupby(["what", "machine", "date"], sort=False)[["cases", "seconds"]].sum().reset_index()
    return f"## Runs\n\n{text}\n\n{markdown_table(totals)}"


def _declared(declared: Declaration) -> str:
    table = pd.DataFrame(
        {
            "mechanism": effect.name,
            "null": effect.null,
            "maximum": effect.maximum,
            "gamma80, from the null": effect.detectable,
            "of the range": effect.detectable / abs(effect.maximum - effect.null),
            "distinct": "yes" if effect.told_apart else "no",
            "resolvable": "yes" if effect.resolvable else "no",
            "looks like": ", ".join(effect.kin),
        }
        for effect in declared.library
    ).replace(np.inf, np.nan)
    scale = f", scale {declared.scale}" if declared.scale else ""
    stated = (
        f"{declared.study}{scale}, {declared.plan.replicates} heaps a condition; declared and sealed on "
        f"{declared.drawn_on}; settings of the analysis {declared.settings.sha256}. A mechanism is "
        f"resolvable if it is distinct from every other and its range holds more than {STRONG:g} gamma80; no "
        "other may be named."
    )
    return f"## Declared beforehand\n\n{stated}\n\n{markdown_table(table)}"


def _view(record: Record, view: str, heading: str) -> list[str]:
    rows = record.in_view(view)
    verdict = "verdict" if len(rows) == record.sealed else "verdict so far"
    table = [
        {"question": aim.question, "wanted": aim.wanted, "found": aim.found, verdict: _VERDICTS[aim.passed]}
        for aim in record.aims(view)
    ]
    parts = [
        heading,
        markdown_table(pd.DataFrame(table)),
        "### Strong effects, by mechanism",
        markdown_table(by_mechanism(rows).reset_index()),
    ]
    if len(outside := by_outsider(rows)):
        parts += ["### Effects that may not be named", markdown_table(outside.reset_index())]
    if area := unknown_area(rows):
        parts.append(
            "By the misfit of the closest model what the library lacks is separated from one or two strong "
            f"effects of it with an area under the curve of {area}."
        )
    return parts
