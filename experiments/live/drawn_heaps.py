"""Heaps as the page draws them: the spheres of a preview, of a stored case or of a heap's file."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from experiments.cases.store.folder import CASES
from experiments.io.errors import InputError
from experiments.io.files import JOURNAL
from experiments.journal.journal import PREVIEWS
from experiments.journal.previews import read_preview, spheres_of
from experiments.live.run_files import inside

MOST_SPHERES = 60_000
"""Spheres of a heap that are drawn; of more, whole grains are left out evenly."""

_NAME = re.compile(r"[0-9a-f]{64}")


def heap_spheres(folder: Path, name: str) -> tuple[np.ndarray, str, float]:
    """Read the spheres of a heap, see `spheres_of`, its phase and how much of it is done."""
    kind, _, key = name.partition("/")
    if name == "heap":
        return _few(_heap_file(inside(folder, "heap.vtp"))), "finished", 1.0
    if kind not in ("preview", "case") or not _NAME.fullmatch(key):
        raise InputError(str(folder), "must be the name of a heap", name)
    path = inside(folder, f"{JOURNAL}/{PREVIEWS}/{key}.npz" if kind == "preview" else f"{CASES}/{key}.npz")
    if kind == "case":
        # the simulator's classes take a second to import
        from experiments.cases import Store

        result = Store(path.parent).load(key)
        return _few(spheres_of(result)), result.status, 1.0
    try:
        spheres, facts = read_preview(path)
    except ValueError as error:
        raise InputError(str(path), str(error), "another file") from None
    return _few(spheres), facts["phase"], facts["fraction"]


def _heap_file(path: Path) -> np.ndarray:
    """Read the spheres of a heap's file."""
    from experiments.grains.spheres import read_spheres

    read = read_spheres(path)
    bodies = np.zeros(len(read.spheres)) if read.bodies is None else read.bodies
    return np.column_stack([read.spheres, bodies]).astype("<f4")


def _few(spheres: np.ndarray) -> np.ndarray:
    """Leave out whole grains evenly, so that at most `MOST_SPHERES` are left."""
    step = -(-len(spheres) // MOST_SPHERES)
    return spheres[spheres[:, 4].astype(int) % step == 0] if step > 1 else spheres
