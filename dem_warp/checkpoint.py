"""Checkpoints: cases on disk half-way, so that a run that was killed goes on where it was.

Every running case has a file of its own, named by what the case is. It is written under a temporary name and
then renamed, so that it is whole or absent, and it says what made it: one of another version of the engine or
of another device, or a damaged one, is not used, and its case starts afresh.
"""

import hashlib
import json
import logging
import os
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from dem_warp.case import Case
from dem_warp.reading import read_arrays
from dem_warp.scenes.scene import Course
from dem_warp.snapshot import Snapshot

FORMAT = 1
"""Version of the files; another one is not read."""

CHECKPOINT_EVERY = 60.0
"""Time between two checkpoints [s]: the most that a killed run loses."""

_RECORD = "record"

_log = logging.getLogger(__name__)


class Checkpoints:
    """Checkpoints of cases in a folder.

    Parameters
    ----------
    folder : str or Path
        It is made with the first checkpoint.
    every : float
        Wall time between two checkpoints [s].

    Raises
    ------
    ValueError
        If `every` is negative.
    """

    def __init__(self, folder: str | Path, every: float = CHECKPOINT_EVERY) -> None:
        if not every >= 0:
            raise ValueError(f"Checkpoints.every: must be 0 or more [s], got {every!r}")
        self.folder, self.every = Path(folder), every

    def path(self, case: Case) -> Path:
        """File of a case."""
        return self.folder / f"{case_name(case)}.npz"

    def save(self, case: Case, maker: dict[str, Any], course: Course, snapshot: Snapshot) -> None:
        """Save where a case is, replacing its earlier checkpoint.

        Parameters
        ----------
        case : Case
        maker : dict
            What must be the same where the case goes on.
        course : Course
            Of its controller.
        snapshot : dict of array
            Of its world.
        """
        path = self.path(case)
        record = json.dumps({"format": FORMAT, "maker": maker, "course": asdict(course)})
        arrays = snapshot | {_RECORD: np.frombuffer(record.encode(), dtype=np.uint8)}
        temporary = path.with_name(f".{path.stem}.{os.getpid()}")
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            with temporary.open("wb") as file:
                np.savez(file, allow_pickle=False, **arrays)
                file.flush()
                os.fsync(file.fileno())
            temporary.replace(path)
        except OSError as error:
            _log.warning("%s: no checkpoint could be written, the case goes on without: %s", path, error)

    def load(self, case: Case, maker: dict[str, Any]) -> tuple[dict[str, Any], Snapshot] | None:
        """Fields of the course, and snapshot, of a case that an earlier run left; None if there is none.

        Raises
        ------
        ValueError
            If the file is damaged or comes from another maker.
        """
        path = self.path(case)
        if not path.exists():
            return None
        try:
            snapshot = read_arrays(path)
            record = json.loads(snapshot.pop(_RECORD).tobytes())
            found = {"format": record["format"]} | record["maker"]
            course = dict(record["course"])
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
            raise ValueError(f"must be a whole file that a run wrote: {error}") from error
        _require_same(found, {"format": FORMAT} | maker)
        return course, snapshot

    def drop(self, case: Case) -> None:
        """Remove the checkpoint of a case that has ended, if there is one."""
        self.path(case).unlink(missing_ok=True)


def case_name(case: Case) -> str:
    """Name of a case while it runs: the hash of all that it says."""
    content = {
        "case": case.to_dict(),
        "scene": type(case.scene).__name__,
        # it does not change the result, but it is what the neighbour lists were made for
        "skin": case.numerics.skin,
    }
    text = json.dumps(content, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def _require_same(found: dict[str, Any], expected: dict[str, Any]) -> None:
    differences = [
        f"{name} {found.get(name)!r} instead of {expected.get(name)!r}"
        for name in sorted(found.keys() | expected.keys())
        if found.get(name) != expected.get(name)
    ]
    if differences:
        raise ValueError(f"must come from this engine on this device, got {'; '.join(differences)}")
