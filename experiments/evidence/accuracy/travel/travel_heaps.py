"""Heaps of the proof: simulated here or in another code, measured alike, stored one file each."""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

from dem_warp import CaseResult, simulate
from experiments.cases.engines.key import case_key
from experiments.evidence.accuracy.travel.cards import CARDS, SHAPES
from experiments.export import ExportedTest, Translation, export_input, write_export
from experiments.io.errors import InputError
from experiments.io.files import write_text
from imaging import PictureError, heap_angle

OURS = "dem-warp"
"""Name of our own heaps among those of the codes."""

AZIMUTHS, FIT, PIXELS = 16, "flank", 400
"""Estimator of the angle, the same for all."""

TAIL = 300
"""Characters that are kept of the last line that a program said."""

DIGITS = 16
"""Hexadecimal digits of the hash of what a heap was made from."""

INPUT_DIGITS, NOTHING = 9, 1e-15
"""Digits of a number that make another input, and the size below which it is zero."""

_FRACTION = re.compile(r"(?<![\w.])-?\d+(?:\.\d+(?:e[+-]?\d+)?|e[+-]?\d+)")

HEAPS = "heaps.csv"
"""Table of all heaps in a record."""

NUMBER = "%.6g"
"""Numbers in it."""


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
    """Wall time; of ours, that since the start of the batch over its heaps."""
    reason: str = ""
    """Reason that there is none."""
    made_from: str = ""
    """Hash of the input in the other code, or of the case and our engine."""

    @property
    def job(self) -> tuple[str, str, str, int]:
        """Code, laws, card and seed."""
        return self.code, self.laws, self.card, self.seed

    def as_recorded(self) -> Heap:
        """Round the numbers as the table of a record has them."""
        angle = None if self.angle is None else float(NUMBER % self.angle)
        height, seconds = float(NUMBER % self.height), float(NUMBER % self.seconds)
        return replace(self, angle=angle, height=height, seconds=seconds)

    @classmethod
    def read(cls, path: Path) -> Heap:
        """Read a stored heap."""
        return cls(**json.loads(path.read_text(encoding="utf-8")))

    def write(self, folder: Path) -> None:
        """Store the heap."""
        write_text(heap_file(folder, *self.job), json.dumps(asdict(self)) + "\n")


def heap_file(folder: Path, code: str, laws: str, card: str, seed: int) -> Path:
    """Path of a stored heap."""
    return folder / "heaps" / f"{code}-{laws}-{card}-{seed}.json"


def stored_heaps(folder: Path) -> list[Heap]:
    """Read every stored heap."""
    return [Heap.read(path) for path in sorted((folder / "heaps").glob("*.json"))]


def take_up(record: Path, folder: Path) -> None:
    """Store the heaps of a record's table that the folder has not."""
    if not (record / HEAPS).is_file():
        return
    table = pd.read_csv(record / HEAPS, dtype={"reason": str, "made_from": str}, keep_default_na=False)
    for row in table.to_dict("records"):
        heap = Heap(**row | {"angle": float(row["angle"]) if row["angle"] != "" else None})
        if not heap_file(folder, *heap.job).exists():
            heap.write(folder)


def _is_stored(folder: Path, job: tuple[str, str, str, int], made_from: str) -> bool:
    path = heap_file(folder, *job)
    return path.exists() and Heap.read(path).made_from == made_from


def simulate_ours(
    folder: Path,
    codes: Iterable[str],
    cards: Iterable[str],
    seeds: Iterable[int],
    device: str | None,
    workers: int | None,
) -> None:
    """Simulate here what is not stored yet, under the laws of the codes, one launch a code."""
    for code in codes:
        keys = {(card, seed): _own_key(code, card, seed) for card in cards for seed in seeds}
        todo = [job for job, key in keys.items() if not _is_stored(folder, (OURS, code, *job), key)]
        started, count = time.perf_counter(), len(todo)

        def keep(
            index: int,
            result: CaseResult,
            todo: Sequence[tuple[str, int]] = todo,
            code: str = code,
            started: float = started,
            keys: Mapping[tuple[str, int], str] = keys,
        ) -> None:
            card, seed = todo[index]
            seconds = (time.perf_counter() - started) / len(todo)
            made = partial(Heap, OURS, code, card, seed, seconds=seconds, made_from=keys[card, seed])
            spheres = np.column_stack([result.sphere_centers, result.sphere_radii])
            _measured(made, card, spheres, result.reason).write(folder)

        if count:
            simulate(
                [CARDS[card].case(code, seed) for card, seed in todo],
                device=device,
                workers=workers,
                on_result=keep,
            )
        print(f"{OURS}, laws of {code}: {count} heaps, {time.perf_counter() - started:.0f} s", flush=True)


def _own_key(code: str, card: str, seed: int) -> str:
    return case_key(CARDS[card].case(code, seed))[:DIGITS]


def run_theirs(
    folder: Path,
    codes: Sequence[str],
    cards: Sequence[str],
    seeds: Iterable[int],
    workers: int,
    programs: Path | None,
) -> None:
    """Run in other codes what is not stored yet, several at once and all cards of a seed before the next.

    The programs may lie in a folder.
    """
    jobs = [(code, card, seed) for seed in seeds for card in cards for code in codes]
    with ThreadPoolExecutor(workers) as pool:
        list(pool.map(lambda job: _run_one(folder, programs, *job), jobs))


def _run_one(folder: Path, programs: Path | None, code: str, card: str, seed: int) -> None:
    test = ExportedTest(card, CARDS[card].case(code, seed), "the proof's cards")
    translation = export_input(test, code)
    made_from = _input_key(translation)
    if _is_stored(folder, (code, code, card, seed), made_from):
        return
    path = os.environ["PATH"] if programs is None else f"{programs.resolve()}{os.pathsep}{os.environ['PATH']}"
    program = translation.command[0]
    if shutil.which(program, path=path) is None:
        raise InputError(f"--code {code}", "must be installed, its program on the PATH", program)
    place = folder / "runs" / f"{code}-{card}-{seed}"
    (place / translation.heap).unlink(missing_ok=True)
    write_export(test, code, translation, place)
    started = time.perf_counter()
    with (place / "screen.log").open("w", encoding="utf-8") as screen:
        ended = subprocess.run(
            translation.command,
            cwd=place,
            env=os.environ | {"PATH": path, "OMP_NUM_THREADS": "1"},
            stdout=screen,
            stderr=subprocess.STDOUT,
        )
    if -ended.returncode in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
        return  # somebody has ended it: nothing is known of the heap
    seconds = time.perf_counter() - started
    made = partial(Heap, code, code, card, seed, seconds=seconds, made_from=made_from)
    if (place / translation.heap).is_file():
        heap = _measured(made, card, read_dump(place / translation.heap))
    else:
        lines = (place / "screen.log").read_text(encoding="utf-8", errors="replace").split("\n")
        said = next((line.strip() for line in reversed(lines) if line.strip()), "the program said nothing")
        heap = made(angle=None, grain_count=0, height=0.0, reason=f"no heap: {said[-TAIL:]}")
    heap.write(folder)
    result = heap.reason or f"{heap.angle:.2f} degrees"
    print(f"{code} {card} {seed}: {result}, {seconds:.0f} s", flush=True)


def _input_key(translation: Translation) -> str:
    """Hash of all files of an input and of the command, without comments: words change no heap.

    Nor do the last digits of a sum, which differ between processors.
    """
    files = {
        name: _FRACTION.sub(_shortened, "\n".join(line for line in text.split("\n") if line[:1] != "#"))
        for name, text in translation.files.items()
    }
    text = json.dumps([files, translation.command], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:DIGITS]


def _shortened(number: re.Match[str]) -> str:
    value = float(number[0])
    return f"{value:.{INPUT_DIGITS}g}" if abs(value) > NOTHING else "0"


def _measured(heap: Callable[..., Heap], card: str, spheres: np.ndarray, reason: str = "") -> Heap:
    """Complete a heap by what its spheres (centres and radii [m], (spheres, 4)) show."""
    known = partial(heap, grain_count=len(spheres) // SHAPES[CARDS[card].shape].sphere_count)
    if reason:
        return known(angle=None, height=0.0, reason=reason)
    centers, radii = spheres[:, :3], spheres[:, 3]
    try:
        angle = heap_angle(centers, radii, azimuths=AZIMUTHS, fit=FIT, pixels=PIXELS).mean
    except PictureError as error:
        return known(angle=None, height=0.0, reason=f"no heap: {error}")
    return known(angle=angle, height=float(centers[:, 2].max()))


def read_dump(path: Path) -> np.ndarray:
    """Centres and radii of the last state of a dump ``id type x y z radius`` [m], (spheres, 4)."""
    lines = path.read_text(encoding="utf-8").splitlines()
    first = max(i for i, line in enumerate(lines) if line.startswith("ITEM: ATOMS")) + 1
    return np.array([line.split()[2:6] for line in lines[first:]], dtype=float)
