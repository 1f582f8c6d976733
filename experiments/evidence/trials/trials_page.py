"""The record of the trials: tables and one page, written from its own files."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from experiments.evidence.record_page import markdown_table, write_page
from experiments.evidence.trials.baselines.answers_table import FOLDER, read_answers
from experiments.evidence.trials.baselines.method_tables import judged
from experiments.evidence.trials.declaration import Declaration, read_declaration
from experiments.evidence.trials.findings import EVERYTHING, OUTLINED, read_findings
from experiments.evidence.trials.score import (
    aims,
    by_mechanism,
    by_outsider,
    scored,
    strong_singles,
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
from experiments.evidence.trials.truth import (
    Kind,
    Label,
    opened,
    read_labels,
    read_sealed,
    read_sealed_json,
    revealed,
)
from experiments.evidence.trials.truths import STRONG

TITLES = {
    EVERYTHING: "With every observable",
    OUTLINED: "With every observable, and the outlines of the photographs",
}

_VERDICTS = {True: "pass", False: "**FAIL**", None: "open"}

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
(Clopper and Pearson). The aims are those of the eighteenth and the nineteenth series; earlier ones had milder
aims ([all series](../README.md)). *Sealed together* are series of one day, scale and settings.
"""


@dataclass(frozen=True, eq=False)
class Record:
    """A record of trials, its findings judged."""

    declaration: Declaration
    table: pd.DataFrame
    """Rows of `scored`, of every view."""
    labels: dict[str, Label]
    """Truths of the trials that have been analysed."""
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

    @property
    def occasion(self) -> tuple[str, str, str]:
        """Day of the sealing, scale and settings."""
        return self.declaration.drawn_on, self.declaration.scale, self.declaration.settings.sha256

    def in_view(self, view: str = EVERYTHING) -> pd.DataFrame:
        """Return the findings of one view."""
        return self.table[self.table["view"] == view]


def read_record(folder: Path) -> Record:
    """Read a record; labels of trials that have not been analysed may be missing."""
    findings, sealed = read_findings([folder / FINDINGS]), read_sealed(folder / SEALED)
    truths = revealed(read_labels(folder / LABELS), opened(sealed, findings["trial"]))
    reality = folder / REALITY
    made_by = read_sealed_json(reality) if reality.is_file() else None
    declaration = read_declaration(folder / DECLARED)
    return Record(declaration, scored(findings, truths, sealed), truths, len(sealed), made_by)


def sealed_together(folder: Path) -> list[Record]:
    """Read a record, and those next to it that have its day, scale and settings."""
    places = [path.parent for path in sorted(folder.resolve().parent.glob(f"*/{RUNS}"))]
    own, others = read_record(folder), [place for place in places if place != folder.resolve()]
    records = [own, *map(read_record, others)]
    return [one for one in records if one.occasion == own.occasion]


def best_other(folder: Path, record: Record, strong: pd.DataFrame) -> tuple[str, int] | None:
    """Find the other method with the most right names of strong effects; None if none has answered all."""
    counts = {}
    for path in sorted((folder.resolve().parent / "baselines" / folder.name / FOLDER).glob("*.csv")):
        answers = read_answers(path)
        answers = answers[answers["trial"].isin(strong["trial"])]
        if not path.stem.startswith("search") and 0 < len(strong) == len(answers):
            counts[path.stem] = int(judged(answers, record.labels)["named_right"].sum())
    return max(counts.items(), key=lambda one: one[1], default=None)


def write_trials_page(folder: Path) -> Path:
    """Write the page of a record from its files, its notes after the introduction."""
    together, notes = sealed_together(folder), folder / NOTES
    record = together[0]
    heaps = _FOREIGN.format(code=record.code) if record.reality else _OURS
    parts = [f"{heaps} {_SEALED}", *([notes.read_text(encoding="utf-8")] if notes.is_file() else [])]
    parts += [_runs(folder / RUNS), _declared(record.declaration)]
    if record.reality:
        parts.append(_made(record.reality))
    for view, title in TITLES.items():
        if done := len(record.in_view(view)):
            some = f" of {record.sealed}" if done < record.sealed else ""
            parts += _view(folder, together, view, f"## {title}\n\n{done}{some} trials.")
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


def _view(folder: Path, together: list[Record], view: str, heading: str) -> list[str]:
    record, rows = together[0], together[0].in_view(view)
    every = pd.concat([one.in_view(view) for one in together])
    nulls, best = every[every["kind"] == Kind.NULL], best_other(folder, record, strong_singles(rows))
    verdict = "verdict" if len(rows) == record.sealed else "verdict so far"
    table = [
        {"question": aim.question, "wanted": aim.wanted, "found": aim.found, verdict: _VERDICTS[aim.passed]}
        for aim in aims(rows, nulls, best, record.reality is not None)
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
