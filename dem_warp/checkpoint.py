"""Checkpoints: running cases on disk, from which a killed run continues.

Every running case has a file named by its content, complete or absent. A damaged file, or one of another
engine version or device, is not used: its case starts again.
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
from dem_warp.scenes.scene import SceneState
from dem_warp.snapshot import Snapshot

FORMAT = 1
"""Version of the file format."""

CHECKPOINT_EVERY = 60.0
"""Wall time between two checkpoints [s]: the most that a killed run loses."""

_RECORD = "record"

_log = logging.getLogger(__name__)


class Checkpoints:
    """Checkpoints of cases in a folder, with a wall time between two of them."""

    def __init__(self, folder: str | Path, every: float = CHECKPOINT_EVERY) -> None:
        if not every >= 0:
            raise ValueError(f"Checkpoints.every: must be 0 or more [s], got {every!r}")
        self.folder, self.every = Path(folder), every

    def path(self, case: Case) -> Path:
        return self.folder / f"{case_name(case)}.npz"

    def save(self, case: Case, maker: dict[str, Any], state: SceneState, snapshot: Snapshot) -> None:
        """Save the state of a case's controller and the snapshot of its world.

        `maker` must be the same where the case continues.
        """
        path = self.path(case)
        record = json.dumps({"format": FORMAT, "maker": maker, "state": asdict(state)})
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
            _log.warning("%s: cannot write the checkpoint, the case continues without: %s", path, error)

    def load(self, case: Case, maker: dict[str, Any]) -> tuple[dict[str, Any], Snapshot] | None:
        """Return the state's fields and the snapshot of a case from an earlier run, or None."""
        path = self.path(case)
        if not path.exists():
            return None
        try:
            snapshot = read_arrays(path)
            record = json.loads(snapshot.pop(_RECORD).tobytes())
            found = {"format": record["format"]} | record["maker"]
            state = dict(record["state"])
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
            raise ValueError(f"the file is damaged: {error}") from error
        _require_same(found, {"format": FORMAT} | maker)
        return state, snapshot

    def drop(self, case: Case) -> None:
        """Remove the checkpoint of a case, if any."""
        self.path(case).unlink(missing_ok=True)


def case_name(case: Case) -> str:
    """Return the name of a running case: the hash of its content."""
    content = {
        "case": case.to_dict(),
        "scene": type(case.scene).__name__,
        # it does not change the result, but the neighbour lists depend on it
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
        raise ValueError(f"the file is from another engine or device: {'; '.join(differences)}")
