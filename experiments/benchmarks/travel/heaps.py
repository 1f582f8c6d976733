"""Heaps of the proof: simulated here or in another code, measured alike, stored one file each."""

from __future__ import annotations

import json
import os
import subprocess
import time
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

import numpy as np

from dem_warp import CaseResult, simulate
from experiments.benchmarks.travel.cards import CARDS
from experiments.export import ExportedTest, export_input, write_export
from experiments.files import write_text
from imaging import PictureError, heap_angle

OURS = "dem-warp"
"""Name of our own heaps among those of the codes."""

AZIMUTHS, FIT, PIXELS = 16, "flank", 400
"""Estimator of the angle, the same for all."""

TAIL = 300
"""Characters that are kept of what a program said last."""


@dataclass(frozen=True)
class Heap:
    """One heap of one card."""

    code: str
    """Code that made it."""
    laws: str
    """Code whose laws hold."""
    card: str
    seed: int
    angle: float | None
    """Mean over the views [degrees]; None without a heap."""
    grain_count: int
    height: float
    """Highest sphere centre [m]."""
    seconds: float
    """Wall time; of ours, the batch's over its heaps."""
    reason: str = ""
    """Reason that there is none."""

    @classmethod
    def read(cls, path: Path) -> Heap:
        """Read a stored heap."""
        return cls(**json.loads(path.read_text(encoding="utf-8")))

    def write(self, folder: Path) -> None:
        """Store the heap."""
        write_text(
            heap_file(folder, self.code, self.laws, self.card, self.seed), json.dumps(asdict(self)) + "\n"
        )


def heap_file(folder: Path, code: str, laws: str, card: str, seed: int) -> Path:
    """Path of a stored heap."""
    return folder / "heaps" / f"{code}-{laws}-{card}-{seed}.json"


def stored_heaps(folder: Path) -> list[Heap]:
    """Read every stored heap."""
    return [Heap.read(path) for path in sorted((folder / "heaps").glob("*.json"))]


def simulate_ours(
    folder: Path,
    codes: Iterable[str],
    cards: Iterable[str],
    seeds: Iterable[int],
    device: str,
    workers: int | None,
) -> None:
    """Simulate here what is not stored yet, under the laws of the codes, one launch a code."""
    for code in codes:
        todo = [
            (card, seed)
            for card in cards
            for seed in seeds
            if not heap_file(folder, OURS, code, card, seed).exists()
        ]
        started, count = time.perf_counter(), len(todo)

        def keep(
            index: int,
            result: CaseResult,
            todo: Sequence[tuple[str, int]] = todo,
            code: str = code,
            started: float = started,
        ) -> None:
            card, seed = todo[index]
            seconds = (time.perf_counter() - started) / len(todo)
            _measured(
                OURS, code, card, seed, result.sphere_centers, result.sphere_radii, seconds, result.reason
            ).write(folder)

        if count:
            simulate(
                [CARDS[card].case(code, seed) for card, seed in todo],
                device=device,
                workers=workers,
                on_result=keep,
            )
        print(f"{OURS}, laws of {code}: {count} heaps, {time.perf_counter() - started:.0f} s", flush=True)


def run_theirs(
    folder: Path, code: str, cards: Iterable[str], seeds: Iterable[int], workers: int, programs: Path | None
) -> None:
    """Run in another code what is not stored yet, so many at once; its programs may lie in a folder."""
    todo = [
        (card, seed)
        for card in cards
        for seed in seeds
        if not heap_file(folder, code, code, card, seed).exists()
    ]
    with ThreadPoolExecutor(workers) as pool:
        run = partial(_run_one, folder, code, programs)
        for heap in pool.map(lambda job: run(*job), todo):
            heap.write(folder)
            told = heap.reason or f"{heap.angle:.2f} degrees"
            print(f"{code} {heap.card} {heap.seed}: {told}, {heap.seconds:.0f} s", flush=True)


def _run_one(folder: Path, code: str, programs: Path | None, card: str, seed: int) -> Heap:
    place = folder / "runs" / f"{code}-{card}-{seed}"
    test = ExportedTest(card, CARDS[card].case(code, seed), "the proof's cards")
    translation = export_input(test, code)
    write_export(test, code, translation, place)
    path = os.environ["PATH"] if programs is None else f"{programs.resolve()}{os.pathsep}{os.environ['PATH']}"
    started = time.perf_counter()
    with (place / "screen.log").open("w", encoding="utf-8") as screen:
        subprocess.run(
            translation.command,
            cwd=place,
            env=os.environ | {"PATH": path, "OMP_NUM_THREADS": "1"},
            stdout=screen,
            stderr=subprocess.STDOUT,
        )
    seconds = time.perf_counter() - started
    if not (place / translation.heap).is_file():
        said = (place / "screen.log").read_text(encoding="utf-8", errors="replace")[-TAIL:]
        return Heap(code, code, card, seed, None, 0, 0.0, seconds, f"no heap: {said}")
    spheres = read_dump(place / translation.heap)
    return _measured(code, code, card, seed, spheres[:, :3], spheres[:, 3], seconds)


def _measured(
    code: str,
    laws: str,
    card: str,
    seed: int,
    centers: np.ndarray,
    radii: np.ndarray,
    seconds: float,
    reason: str = "",
) -> Heap:
    spheres = CARDS[card].case(laws, seed).grains.sphere_count
    heap = partial(Heap, code, laws, card, seed)
    if reason:
        return heap(None, len(radii) // spheres, 0.0, seconds, reason)
    try:
        angle = heap_angle(centers, radii, azimuths=AZIMUTHS, fit=FIT, pixels=PIXELS).mean
    except PictureError as error:
        return heap(None, len(radii) // spheres, 0.0, seconds, f"no heap: {error}")
    return heap(angle, len(radii) // spheres, float(centers[:, 2].max()), seconds)


def read_dump(path: Path) -> np.ndarray:
    """Centres and radii of the last state of a dump ``id type x y z radius`` [m], (spheres, 4)."""
    lines = path.read_text(encoding="utf-8").splitlines()
    first = max(i for i, line in enumerate(lines) if line.startswith("ITEM: ATOMS")) + 1
    return np.array([line.split()[2:6] for line in lines[first:]], dtype=float)
