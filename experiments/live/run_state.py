"""The state of a run, read from its folder: waiting, running, finished, failed or interrupted."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from experiments.cases.store.folder import CASES as STORE
from experiments.io.files import JOURNAL
from experiments.io.time_left import duration
from experiments.journal.journal import BEAT, CASES, LOG, PREVIEWS, PROGRESS, RUN, STAGES
from experiments.live.journal_notes import (
    DecisionNote,
    LogNote,
    ProgressNote,
    RunNote,
    StageNote,
    Value,
    all_noted,
    noted,
    values_of,
)
from experiments.live.run_files import changed, inside, matching, read_json, read_lines, read_table

STALE = 15.0
"""Time without a sign of life after which a run counts as killed [s]."""

LOG_SHOWN, HEAPS_SHOWN, CASES_SHOWN = 200, 12, 20_000
"""Lines of the log, heaps and cases that are shown, the last ones."""

OUTPUTS = ("report.html", "record/record.html", "snapshot.png", "material.toml", "results.json", "angle.json")
"""Files that a person looks for first."""


@dataclass(frozen=True)
class RunState:
    """Everything that is known of a run from its folder."""

    folder: Path
    run: RunNote
    progress: ProgressNote
    log: list[LogNote]
    cases: dict[str, dict[str, Value]]
    """Cases by their key, in order: what was planned, and what they gave."""
    stages: list[StageNote]
    heaps: list[dict[str, Value]]
    """Heaps that can be drawn, those that form now first: id, title, at_rest, angle, reason."""

    @classmethod
    def read(cls, folder: Path) -> RunState:
        """Read a folder; nothing in it is changed."""
        cases = _cases(folder)
        return cls(
            folder,
            noted(RunNote, read_json(folder, f"{JOURNAL}/{RUN}") or _run_of_files(folder)) or RunNote(),
            _progress(folder, noted(ProgressNote, read_json(folder, f"{JOURNAL}/{PROGRESS}"))),
            all_noted(LogNote, read_lines(folder, f"{JOURNAL}/{LOG}", LOG_SHOWN)),
            cases,
            all_noted(StageNote, read_lines(folder, f"{JOURNAL}/{STAGES}")) or _stages_of_tables(folder),
            _heaps(folder, cases),
        )

    @property
    def left(self) -> str:
        """Time left of its batch, in words; empty where it is not known."""
        return "" if self.progress.left is None else duration(self.progress.left)

    @property
    def outputs(self) -> list[str]:
        """Files that the run has made, by their paths in the folder."""
        tables = sorted(path.name for path in matching(self.folder, "tables/*.csv"))
        return [name for name in (*OUTPUTS, *(f"tables/{name}" for name in tables)) if _is_file(self, name)]


def _is_file(state: RunState, name: str) -> bool:
    try:
        inside(state.folder, name)
    except ValueError:
        return False
    return True


def _run_of_files(folder: Path) -> dict[str, Any]:
    """Return the facts about a run without a journal."""
    if heap := read_json(folder, "angle.json"):
        return {"command": "heap", "study": heap.get("study"), "scale": heap.get("scale")}
    if not (manifest := read_json(folder, "study.json")):
        return {}
    document = manifest.get("study")
    name = document.get("name") if isinstance(document, Mapping) else None
    command = "discover" if (folder / "outcomes.sqlite").is_file() else "calibrate"
    return {"command": command, "study": name, "scale": manifest.get("scale")}


def _progress(folder: Path, found: ProgressNote | None) -> ProgressNote:
    """Progress as noted; a run that says it runs, without a sign of life, was killed."""
    if found is None:
        return _ending_of_files(folder)
    if found.state == "running":
        age = time.time() - max(changed(folder / JOURNAL / name) for name in (BEAT, PROGRESS))
        if age > STALE:
            message = f"No sign of life for {duration(age)}: the run was killed, or its machine sleeps."
            return ProgressNote(state="interrupted", message=message)
    return found


def _ending_of_files(folder: Path) -> ProgressNote:
    """State of a folder without a journal."""
    if any((folder / name).is_file() for name in ("results.json", "angle.json")):
        return ProgressNote(state="finished", message="The run has ended.")
    if (folder / "study.json").is_file():
        message = "The run keeps no journal: only its finished heaps can be shown."
        return ProgressNote(state="interrupted", message=message)
    return ProgressNote(state="waiting", message="No run has begun in this folder yet.")


def _cases(folder: Path) -> dict[str, dict[str, Value]]:
    """Cases of the journal by their key; without one, those of the tables that an ended run has left."""
    cases: dict[str, dict[str, Value]] = {}
    lines = [*read_lines(folder, f"{JOURNAL}/{CASES}", CASES_SHOWN)]
    lines = lines or [row for row in read_table(folder, "tables/cases.csv", CASES_SHOWN) if row.get("status")]
    for line in map(values_of, lines):
        key = str(line.get("case_key") or line.get("name") or len(cases))
        if "status" in line:  # the last to end comes last
            cases[key] = cases.pop(key, {}) | line
        else:
            cases.setdefault(key, {}).update(line)
    return cases


def _stages_of_tables(folder: Path) -> list[StageNote]:
    """Stages by the table of their decisions."""
    stages: dict[str, list[DecisionNote]] = {}
    for row in read_table(folder, "tables/decisions.csv"):
        if (decision := noted(DecisionNote, row)) is not None:
            stages.setdefault(str(row.get("stage")), []).append(decision)
    return [StageNote(name=name, decisions=decisions) for name, decisions in stages.items()]


def _heaps(folder: Path, cases: Mapping[str, Mapping[str, Value]]) -> list[dict[str, Value]]:
    """Heaps that form now, and those at rest; a heap alone is shown once."""
    at_rest = _at_rest(folder, cases)
    return at_rest if [heap["id"] for heap in at_rest] == ["heap"] else [*_forming(folder, cases), *at_rest]


def _forming(folder: Path, cases: Mapping[str, Mapping[str, Value]]) -> list[dict[str, Value]]:
    """Heaps that form now, the newest first."""
    by_name = {case["name"]: case for case in cases.values() if "name" in case}
    files = matching(folder / JOURNAL / PREVIEWS, "*.npz")
    return [
        {"id": f"preview/{path.stem}", "title": title_of(by_name.get(path.stem, {})), "at_rest": False}
        for path in files[:HEAPS_SHOWN]
    ]


def _at_rest(folder: Path, cases: Mapping[str, Mapping[str, Value]]) -> list[dict[str, Value]]:
    """Heaps that are stored, the last to end first."""
    ended: list[tuple[str, Mapping[str, Value]]] = [
        (key, case) for key, case in cases.items() if "status" in case
    ]
    if not ended:
        ended = [(path.stem, {}) for path in reversed(matching(folder / STORE, "*.npz"))]
    found: list[dict[str, Value]] = [
        {"id": f"case/{key}", "title": title_of(case), "at_rest": True, "angle": case.get("angle"),
         "reason": case.get("reason", "")}
        for key, case in reversed(ended[-HEAPS_SHOWN:])
    ]  # fmt: skip
    if not found and (folder / "heap.vtp").is_file():
        angle = read_json(folder, "angle.json").get("angle")
        mean = values_of(dict(angle)).get("mean") if isinstance(angle, Mapping) else None
        found = [{"id": "heap", "title": "the heap", "at_rest": True, "angle": mean, "reason": ""}]
    return found


def title_of(case: Mapping[str, Value]) -> str:
    """Name of a case for people, as ``screening, run 3, replicate 1``."""
    if "stage" not in case:
        return "a case"
    words = [str(case["stage"]).replace("_", " ")]
    words += [f"{name} {case[name]}" for name in ("run", "replicate") if case.get(name) is not None]
    return ", ".join(words)
