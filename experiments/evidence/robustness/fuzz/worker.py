"""A process that reads mutated files one after another, and notes where it is, so that its death is seen."""

from __future__ import annotations

import json
import logging
import os
import random
import resource
import sys
import tempfile
import time
import traceback
import warnings
from pathlib import Path
from typing import Any

from dem_warp.processes import end_with_parent
from experiments.evidence.robustness.fuzz.mutations import mutated
from experiments.evidence.robustness.fuzz.readers import READERS, Reader, accepted_change

SECONDS, MEGABYTES = 2.0, 1000.0
"""Time of the processor and memory that one file may take."""

AT, READ, REFUSED, SLOWEST, MEMORY, FIELDS = range(6)
"""Places in the note: the input it is at, files read and refused, most seconds and megabytes of one."""


def content_of(reader: Reader, name: str, seed: int, number: int) -> tuple[str, bytes]:
    """Name and content of an input, the same from the same numbers."""
    rng = random.Random(f"{seed}/{name}/{number}")
    chosen = rng.choice(sorted(reader.seeds))
    others = [content for key, content in sorted(reader.seeds.items()) if key != chosen]
    return reader.name or chosen, mutated(reader.seeds[chosen], others, rng)


def work(name: str, seed: int, numbers: range, note: Any, failures: str) -> None:
    """Read inputs in a process of its own, without a word of the libraries."""
    end_with_parent()
    logging.disable(logging.CRITICAL)
    warnings.simplefilter("ignore")
    # native code writes there too
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
    read_inputs(name, seed, numbers, note, failures)


def read_inputs(name: str, seed: int, numbers: range, note: Any, failures: str | Path) -> None:
    """Read the inputs of these numbers; failures go to a file, a line of JSON each."""
    with tempfile.TemporaryDirectory() as place:
        reader = READERS[name](Path(place))
        for number in numbers:
            note[AT] = number
            if failure := _one(reader, name, seed, number, Path(place), note):
                with Path(failures).open("a", encoding="utf-8") as file:
                    file.write(json.dumps({"reader": name, "seed": seed, "number": number, **failure}) + "\n")
        note[AT] = numbers.stop


def _one(reader: Reader, name: str, seed: int, number: int, place: Path, note: Any) -> dict[str, str] | None:
    """Read one input; what is wrong with the reader, or None."""
    file, content = content_of(reader, name, seed, number)
    (place / file).write_bytes(content)
    started, before = time.process_time(), _peak()
    failure = None
    try:
        found = reader.read(place / file)
        note[READ] += 1
        if changed := accepted_change(reader, found):
            failure = {"kind": "accepted change", "said": changed}
    except reader.refusals as error:
        note[REFUSED] += 1
        if not str(error):
            failure = {"kind": "no message", "said": repr(error)}
    except Exception as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        where = f"{Path(last.filename).name}:{last.lineno}"
        failure = {"kind": type(error).__name__, "said": f"{where}: {error}"[:300]}
    seconds, grown = time.process_time() - started, _peak() - before
    note[SLOWEST], note[MEMORY] = max(note[SLOWEST], seconds), max(note[MEMORY], grown)
    if failure is None and seconds > SECONDS:
        failure = {"kind": "time", "said": f"{seconds:.1f} s"}
    if failure is None and grown > MEGABYTES:
        failure = {"kind": "memory", "said": f"{grown:.0f} MB"}
    return failure


def _peak() -> float:
    """Largest memory of this process so far [MB]."""
    unit = 1e6 if sys.platform == "darwin" else 1e3
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / unit
