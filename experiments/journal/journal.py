"""The journal of a run: its progress, log, cases and stages, in files that are whole whenever they are read.

It is in the folder `JOURNAL` of the run's folder. No result depends on it: a run continues if it cannot be
written.
"""

from __future__ import annotations

import contextlib
import json
import logging
import os
import shutil
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from experiments.io.errors import StudyError
from experiments.io.files import JOURNAL
from experiments.io.plain_data import indexed, jsonable
from experiments.io.time_left import time_left
from experiments.journal.previews import Previews, prune

if TYPE_CHECKING:
    import pandas as pd

    from dem_warp import Progress

RUN, PROGRESS, LOG, CASES, STAGES = "run.json", "progress.json", "log.jsonl", "cases.jsonl", "stages.jsonl"
BEAT, PREVIEWS = "beat", "previews"
"""Files of a journal: the run, its progress, and, a line each, the log, the cases, the finished stages; a
file whose time is the last sign of life of the run; the folder of previews."""

FORMAT = 1
"""Version of the files."""

BEAT_EVERY = 2.0
"""Time between two signs of life [s]."""

NOTE_EVERY = 1.0
"""Least time between two notes of the progress [s]."""

_log = logging.getLogger(__name__)


class Journal:
    """Notes of a run, from any of its threads; a context.

    Parameters
    ----------
    folder
        Folder of the run.
    command
        Command of the run, e.g. ``calibrate``.
    study
        Study of the run.
    resume
        Continue the notes of an earlier run, which are removed otherwise.
    """

    def __init__(self, folder: Path, command: str, study: Any, resume: bool = False, **facts: Any) -> None:
        self.folder = folder / JOURNAL
        self.previews = Previews(self.folder / PREVIEWS)
        """Callback after each advance of the run's batches."""
        self._run = {
            "format": FORMAT,
            "command": command,
            "study": study.name,
            "scale": study.scale,
            "factors": [{"name": factor.name, "unit": factor.unit} for factor in study.factors],
            "responses": _responses(study),
            **facts,
        }
        self._resume = resume
        self._names: dict[str, str] = {}
        self._lock, self._ended = threading.Lock(), threading.Event()
        self._progress: dict[str, Any] = {
            "state": "running",
            "message": "",
            "title": "",
        }
        self._noted = 0.0
        self._handler = _Handler(self)

    def __enter__(self) -> Self:
        if not self._resume:
            shutil.rmtree(self.folder, ignore_errors=True)
        with self._forgiving():
            self.folder.mkdir(parents=True, exist_ok=True)
            _replace(self.folder / RUN, self._run)
            self._note_progress()
        logging.getLogger("experiments").addHandler(self._handler)
        logging.getLogger("dem_warp").addHandler(self._handler)
        threading.Thread(target=self._live, daemon=True).start()
        self.say("The run begins." if not self._resume else "The run continues.")
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: object) -> None:
        for name in ("experiments", "dem_warp"):
            logging.getLogger(name).removeHandler(self._handler)
        if kind is None:
            state, message = "finished", "The run has ended."
        elif issubclass(kind, Exception):
            state, message = "failed", f"The run failed: {error}"
        else:
            state, message = "interrupted", "The run was interrupted."
        self._ended.set()
        self.say(message, "info" if kind is None else "error")
        with self._forgiving():
            self._progress |= {"state": state, "message": message, "left": None, "phases": {}}
            self._note_progress()

    # ---- notes ---------------------------------------------------------------------------------------------

    def say(self, text: str, level: str = "info") -> None:
        """Note a line of the log."""
        self._add(LOG, {"time": time.time(), "level": level, "text": text})

    @contextmanager
    def batch(self, title: str) -> Iterator[_Listener]:
        """Note the progress of a batch of cases while the block runs."""
        self.say(f"{title}: begun")
        begun = time.monotonic()
        self._update(title=title, done=0, total=0, fraction=0.0, seconds=0.0, left=None, phases={})
        yield _Listener(self)
        self._update(left=None, phases={}, title="")
        self.say(f"{title}: ended after {time.monotonic() - begun:.0f} s")

    def planned(self, table: pd.DataFrame, names: Sequence[str]) -> None:
        """Note the cases of a batch: a row each, with its ``case_key``, and its name while it runs."""
        rows = json.loads(table.to_json(orient="records"))
        self._names |= dict(zip(table["case_key"], names, strict=True))
        self._add(CASES, *({"name": name, **row} for name, row in zip(names, rows, strict=True)))

    def ended(self, key: str, outcome: Mapping[str, Any]) -> None:
        """Note what a case gave; its heap is stored, so that its preview is removed."""
        self._add(CASES, {"case_key": key, **jsonable(dict(outcome))})
        if name := self._names.pop(key, ""):
            with self._forgiving():
                (self.previews.folder / f"{name}.npz").unlink(missing_ok=True)

    def stage(
        self,
        name: str,
        decisions: Sequence[Any],
        tables: Mapping[str, pd.DataFrame],
        responses: Mapping[str, Any] | None = None,
    ) -> None:
        """Note the decisions and tables of a stage; `responses` are those that it wants matched."""
        for decision in decisions:
            self.say(f"{name.replace('_', ' ')}: {decision.outcome}")
        texts = {
            title: indexed(frame).to_json(orient="split", index=False) for title, frame in tables.items()
        }
        noted = {
            "name": name,
            "decisions": jsonable(list(decisions)),
            "tables": {title: json.loads(text) for title, text in texts.items()},
        }
        if responses is not None:
            noted["responses"] = jsonable(dict(responses))
        self._add(STAGES, noted)

    # ---- files ---------------------------------------------------------------------------------------------

    def _update(self, **values: Any) -> None:
        with self._lock:
            self._progress |= values
        with self._forgiving():
            self._note_progress()

    def _note_progress(self) -> None:
        with self._lock:
            self._noted = time.monotonic()
            _replace(self.folder / PROGRESS, {**self._progress, "time": time.time()})
        prune(self.previews.folder)

    def _add(self, name: str, *rows: Mapping[str, Any]) -> None:
        text = "".join(json.dumps(row, allow_nan=False, default=str) + "\n" for row in rows)
        with self._forgiving(), self._lock, (self.folder / name).open("a", encoding="utf-8") as file:
            file.write(text)

    def _live(self) -> None:
        while not self._ended.wait(BEAT_EVERY):
            with self._forgiving():
                (self.folder / BEAT).touch()

    @contextmanager
    def _forgiving(self) -> Iterator[None]:
        """Let a run continue if its notes cannot be written."""
        with contextlib.suppress(OSError):
            yield


class _Listener:
    """Takes the progress of a batch."""

    def __init__(self, journal: Journal) -> None:
        self._journal = journal
        self._first: Progress | None = None

    def __call__(self, progress: Progress) -> None:
        """Note the progress, if the last note is old enough."""
        self._first = self._first or progress
        if time.monotonic() - self._journal._noted < NOTE_EVERY and progress.done < progress.total:
            return
        self._journal._update(
            done=progress.done,
            total=progress.total,
            fraction=progress.fraction,
            seconds=progress.seconds,
            left=time_left(progress, self._first),
            phases=progress.phase_counts,
        )


class _Handler(logging.Handler):
    """Takes the warnings of a run."""

    def __init__(self, journal: Journal) -> None:
        super().__init__(logging.WARNING)
        self._journal = journal

    def emit(self, record: logging.LogRecord) -> None:
        self._journal.say(record.getMessage(), record.levelname.lower())


def _responses(study: Any) -> list[dict[str, Any]]:
    """Describe the targets of a study; empty without targets, or if they are not measured yet."""
    try:
        return jsonable(list(study.target.responses))
    except StudyError:
        return []


def _replace(path: Path, values: Mapping[str, Any]) -> None:
    """Write a small file, whole or not at all, without waiting for the disk."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        temporary.write_text(json.dumps(values, allow_nan=False), encoding="utf-8")
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)
