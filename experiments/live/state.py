"""The state of a run, as its folder tells it: waiting, running, finished, failed or interrupted."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from experiments.cases.folder import CASES as STORE
from experiments.cases.folder import JOURNAL
from experiments.live.folder import inside, read_json, read_lines
from experiments.live.record.journal import BEAT, CASES, GLIMPSES, LOG, PROGRESS, RUN, STAGES
from experiments.live.record.progress import duration

STALE = 15.0
"""Time without a sign of life after which a run counts as killed [s]."""

LOG_SHOWN, HEAPS_SHOWN, CASES_SHOWN = 200, 12, 20_000
"""Lines of the log, heaps and cases that are shown, the last ones."""

OUTPUTS = ("report.html", "record/record.html", "snapshot.png", "material.toml", "results.json", "angle.json")
"""Files that a person looks for first."""


@dataclass(frozen=True)
class RunState:
    """Everything that a folder tells of its run."""

    folder: Path
    run: dict[str, Any]
    """Command, study, factors and responses, see `Journal`; empty where no journal was kept."""
    progress: dict[str, Any]
    """State and message of the run; title, cases and time left of its batch."""
    log: list[dict[str, Any]] = field(default_factory=list)
    cases: dict[str, dict[str, Any]] = field(default_factory=dict)
    """Cases by their key, in order: what was planned, and what they gave."""
    stages: list[dict[str, Any]] = field(default_factory=list)
    heaps: list[dict[str, Any]] = field(default_factory=list)
    """Heaps that can be drawn, those that form now first: id, title, phase, fraction."""

    @classmethod
    def read(cls, folder: Path) -> RunState:
        """Read a folder; nothing in it is changed."""
        run, progress = read_json(folder, f"{JOURNAL}/{RUN}"), read_json(folder, f"{JOURNAL}/{PROGRESS}")
        cases = _cases(folder)
        return cls(
            folder,
            run or _run_of_files(folder),
            _progress(folder, progress),
            list(read_lines(folder, f"{JOURNAL}/{LOG}", LOG_SHOWN)),
            cases,
            list(read_lines(folder, f"{JOURNAL}/{STAGES}")),
            _heaps(folder, cases),
        )

    @property
    def outputs(self) -> list[str]:
        """Files that the run has made, by their paths in the folder."""
        tables = sorted(path.name for path in self.folder.glob("tables/*.csv"))
        return [name for name in (*OUTPUTS, *(f"tables/{name}" for name in tables)) if _is_file(self, name)]


def _is_file(state: RunState, name: str) -> bool:
    try:
        inside(state.folder, name)
    except ValueError:
        return False
    return True


def _run_of_files(folder: Path) -> dict[str, Any]:
    """What a folder without a journal tells of its run."""
    manifest, heap = read_json(folder, "study.json"), read_json(folder, "angle.json")
    if heap:
        return {"command": "heap", "study": heap.get("study", ""), "scale": heap.get("scale")}
    document = manifest.get("study")
    name = document.get("name", "") if isinstance(document, Mapping) else ""
    command = "discover" if (folder / "outcomes.sqlite").is_file() else "calibrate"
    return {"command": command if manifest else "", "study": name, "scale": manifest.get("scale")}


def _progress(folder: Path, noted: dict[str, Any]) -> dict[str, Any]:
    """Progress as noted; a run that says it runs, without a sign of life, was killed."""
    if not noted:
        return _ending_of_files(folder)
    if noted.get("state") == "running":
        age = time.time() - max(_changed(folder / JOURNAL / name) for name in (BEAT, PROGRESS))
        if age > STALE:
            message = f"No sign of life for {duration(age)}: the run was killed, or its machine sleeps."
            return noted | {"state": "interrupted", "message": message, "left": None, "phases": {}}
    left = noted.get("left")
    return noted | {"left_text": duration(left) if isinstance(left, int | float) else ""}


def _ending_of_files(folder: Path) -> dict[str, Any]:
    """State of a folder without a journal."""
    if any((folder / name).is_file() for name in ("results.json", "angle.json")):
        return {"state": "finished", "message": "The run has ended."}
    if (folder / "study.json").is_file():
        told = "The run keeps no journal: only its finished heaps can be shown."
        return {"state": "interrupted", "message": told}
    return {"state": "waiting", "message": "No run has begun in this folder yet."}


def _changed(path: Path) -> float:
    try:
        return path.stat().st_mtime
    except OSError:
        return 0.0


def _cases(folder: Path) -> dict[str, dict[str, Any]]:
    """Cases of the journal by their key."""
    cases: dict[str, dict[str, Any]] = {}
    for line in read_lines(folder, f"{JOURNAL}/{CASES}", CASES_SHOWN):
        key = str(line.get("case_key") or line.get("name") or len(cases))
        if "status" in line:  # the last to end stands last
            cases[key] = cases.pop(key, {}) | line
        else:
            cases.setdefault(key, {}).update(line)
    return cases


def _heaps(folder: Path, cases: Mapping[str, Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Heaps that form now, and those at rest; a heap alone is shown once."""
    at_rest = _at_rest(folder, cases)
    return at_rest if [heap["id"] for heap in at_rest] == ["heap"] else [*_forming(folder, cases), *at_rest]


def _forming(folder: Path, cases: Mapping[str, Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Heaps that form now, the newest first."""
    by_name = {case["name"]: case for case in cases.values() if "name" in case}
    files = sorted((folder / JOURNAL / GLIMPSES).glob("*.npz"), key=_changed, reverse=True)
    return [
        {"id": f"glimpse/{path.stem}", "title": title_of(by_name.get(path.stem, {})), "at_rest": False}
        for path in files[:HEAPS_SHOWN]
    ]


def _at_rest(folder: Path, cases: Mapping[str, Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Heaps that are stored, the last to end first."""
    ended = [(key, case) for key, case in cases.items() if "status" in case]
    if not ended:
        files = sorted((folder / STORE).glob("*.npz"), key=_changed)
        ended = [(path.stem, {}) for path in files]
    found = [
        {"id": f"case/{key}", "title": title_of(case), "at_rest": True, "angle": case.get("angle"),
         "reason": case.get("reason", "")}
        for key, case in reversed(ended[-HEAPS_SHOWN:])
    ]  # fmt: skip
    if not found and (folder / "heap.vtp").is_file():
        angle = read_json(folder, "angle.json").get("angle")
        mean = angle.get("mean") if isinstance(angle, Mapping) else None
        found = [{"id": "heap", "title": "the heap", "at_rest": True, "angle": mean, "reason": ""}]
    return found


def title_of(case: Mapping[str, Any]) -> str:
    """Name of a case for people, as ``screening, run 3, replicate 1``."""
    if "stage" not in case:
        return "a case"
    told = [str(case["stage"]).replace("_", " ")]
    told += [f"{name} {case[name]}" for name in ("run", "replicate") if case.get(name) is not None]
    return ", ".join(told)
