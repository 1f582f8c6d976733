"""A record of trials as its files tell it: what was declared, how many were sealed, what was found."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from experiments.evidence.trials.declaration import Declaration, read_declaration
from experiments.evidence.trials.findings import EVERYTHING, read_findings
from experiments.evidence.trials.folder import DECLARED, FINDINGS, LABELS, REALITY, SEALED
from experiments.evidence.trials.score import Aim, aims, foreign_aims, scored
from experiments.evidence.trials.truth import opened, read_labels, read_sealed, revealed


@dataclass(frozen=True, eq=False)
class Record:
    """A record of trials, its findings judged."""

    declaration: Declaration
    table: pd.DataFrame
    """Rows of `scored`, of every view."""
    sealed: int
    """Trials that were sealed; those that have not been analysed are in no row."""
    reality: dict[str, Any] | None = None
    """Code that made the heaps, and how it makes each effect; None where the engine made them."""

    @property
    def code(self) -> str:
        """Name of what made the heaps."""
        return str(self.reality["name"]) if self.reality else "dem-warp"

    @property
    def title(self) -> str:
        """Code, scale and number of trials."""
        scale, done = self.declaration.scale or "as written", self.table["trial"].nunique()
        return f"{self.code}, {scale}, {done} of {self.sealed} trials"

    def in_view(self, view: str = EVERYTHING) -> pd.DataFrame:
        """Findings of one view."""
        return self.table[self.table["view"] == view]

    def aims(self, view: str = EVERYTHING) -> tuple[Aim, ...]:
        """Hold one view against what was aimed at."""
        rows = self.in_view(view)
        if self.reality:
            return foreign_aims(rows)
        return aims(rows, [effect.name for effect in self.declaration.library if not effect.resolvable])


def read_record(folder: Path) -> Record:
    """Read a record; labels of trials that have not been analysed need not be there.

    Raises
    ------
    InputError
        When a label is missing, or does not fit its seal.
    """
    findings, sealed = read_findings([folder / FINDINGS]), read_sealed(folder / SEALED)
    truths = revealed(read_labels(folder / LABELS), opened(sealed, findings["trial"]))
    reality = folder / REALITY
    told = json.loads(reality.read_text(encoding="utf-8")) if reality.is_file() else None
    return Record(read_declaration(folder / DECLARED), scored(findings, truths, sealed), len(sealed), told)
