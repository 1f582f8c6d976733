"""Previews of running cases: their spheres at this moment, in small files that are written now and then."""

from __future__ import annotations

import contextlib
import json
import os
import time
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from dem_warp.reading import read_arrays

if TYPE_CHECKING:
    from dem_warp import CaseResult
    from dem_warp.batch import Batch

EVERY = 1.0
"""Shortest time between two previews of a process [s]."""

SHARE = 0.005
"""Largest part of a run's time that previews take: a slow one is followed by a longer wait."""

WORLDS = 12
"""Worlds of a batch that have previews, at most."""

KEPT = 24
"""Files that are kept, at most; the oldest are removed first."""


@dataclass
class Previews:
    """Takes previews of the worlds of a batch; for `dem_warp.simulate(on_advance=)`.

    A file that cannot be written is left out, and the run continues.
    """

    folder: Path
    """Folder of the files; it is made when the first is written."""
    spent: float = field(default=0.0, repr=False)
    """Time that previews have taken in this process [s]."""
    _due: float | None = field(default=None, repr=False)

    def __call__(self, batch: Batch) -> None:
        """Take previews, if it is time."""
        if self._due is None:
            self._due = time.monotonic() + EVERY
        if time.monotonic() < self._due:
            return
        begun = time.perf_counter()
        self._take(batch)
        cost = time.perf_counter() - begun
        self.spent += cost
        # the cost of a preview is a small part of the time
        self._due = time.monotonic() + max(EVERY, cost / SHARE)

    def _take(self, batch: Batch) -> None:
        worlds = batch.running[:: max(1, -(-len(batch.running) // WORLDS))]
        for world, view in zip(worlds, batch.solver.view(worlds), strict=True):
            facts = {"phase": batch.phase(world), "fraction": round(batch.fraction(world), 4)}
            # grains that still wait for their fall overlap
            result, fallen = batch.result(world), view.released[view.alive]
            names = ("positions", "orientations", "sizes", "shapes")
            shown = replace(result, **{name: getattr(result, name)[fallen] for name in names})
            self.write(batch.case_name(world), shown, facts)

    def write(self, name: str, result: CaseResult, facts: dict[str, Any]) -> None:
        """Write the spheres of a case, whole or not at all."""
        record = json.dumps(facts).encode()
        temporary = self.folder / f".{name}.{os.getpid()}"
        with contextlib.suppress(OSError):
            self.folder.mkdir(parents=True, exist_ok=True)
            try:
                with temporary.open("wb") as file:
                    np.savez(file, record=np.frombuffer(record, np.uint8), spheres=spheres_of(result))
                # not synchronised with the disk: a preview may be lost
                temporary.replace(self.folder / f"{name}.npz")
            finally:
                temporary.unlink(missing_ok=True)


def spheres_of(result: CaseResult) -> np.ndarray:
    """Return rows of x, y, z, radius [m] and the number of the grain, float32, for a picture."""
    columns = (result.sphere_centers, result.sphere_radii, result.sphere_grain)
    return np.column_stack(columns).astype("<f4")


def read_preview(path: Path) -> tuple[np.ndarray, dict[str, Any]]:
    """Read the spheres of a preview, see `spheres_of`, and its phase and fraction.

    Raise ValueError when the file is not a preview.
    """
    arrays = read_arrays(path)
    try:
        spheres, facts = arrays["spheres"], json.loads(arrays["record"].tobytes())
        found = {"phase": str(facts["phase"]), "fraction": float(facts["fraction"])}
    except (LookupError, TypeError, ValueError, RecursionError) as error:
        raise ValueError(f"must be a preview of a case: {error}") from None
    if spheres.dtype != np.dtype("<f4") or spheres.ndim != 2 or spheres.shape[1] != 5:
        raise ValueError(f"must hold rows of five float32, got {spheres.dtype} {spheres.shape}")
    if not np.isfinite(spheres).all():
        raise ValueError("must hold finite numbers")
    return spheres, found


def prune(folder: Path, kept: int = KEPT) -> None:
    """Remove all but the newest previews of a folder."""
    with contextlib.suppress(OSError):
        files = sorted(folder.glob("*.npz"), key=lambda path: path.stat().st_mtime, reverse=True)
        for path in files[kept:]:
            path.unlink(missing_ok=True)
