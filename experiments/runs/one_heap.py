"""One heap in a folder: simulated, or continued where an earlier run left it, measured and drawn."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from dem_warp import Case
from experiments.cases import Heap, simulate_heap, write_heap
from experiments.cases.show.heap import check_filmed, filmed_by
from experiments.runs.choices import Prepared
from experiments.runs.run_folder import open_run
from experiments.studyfile import Study
from experiments.studyfile.campaign import TARGET_SCENE


@dataclass(frozen=True)
class HeapOrder:
    """One case, and what is kept of it."""

    settings: Mapping[str, float]
    """Values of factors in natural units; default: the middle."""
    seed: int = 1
    scene: str | None = None
    """Further scene of the study; None: its own."""
    frames: int | None = None
    """Frames of its course that are kept; None: no frames."""
    movie: str = "gif"
    """Kind of the film of the frames."""

    @property
    def place(self) -> str:
        """Name of its scene."""
        return self.scene or TARGET_SCENE

    def case(self, study: Study) -> Case:
        """Build its case.

        Raise StudyError when the study refuses it.
        """
        return study.case(self.settings, self.seed, self.place)


def run_heap(prepared: Prepared, order: HeapOrder) -> Heap:
    """Simulate and measure one case, and write its files into the folder.

    Raise InputError when the folder cannot be used, or frames are asked of other workers than this machine's.
    """
    if order.frames is not None:
        check_filmed(prepared.study)
    with open_run("heap", prepared) as run:
        if order.frames is not None:
            filmed_by(run.workers)
        with run.batch(order.scene or "heap", lambda: len(run.store)) as progress:
            wanted = (order.settings, order.seed, run.workers, progress, order.place, order.frames)
            heap = simulate_heap(run.study, *wanted, run.store)
        write_heap(heap, run.folder, order.movie)
    return heap
