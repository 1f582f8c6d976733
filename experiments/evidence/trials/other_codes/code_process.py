"""LIGGGHTS as the program that makes the heaps of a trial."""

import hashlib
import shutil
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import experiments.export
from dem_warp import Case, CaseResult
from dem_warp.provenance import source_meaning
from experiments.cases.engines.contract import heap_result
from experiments.cases.engines.program import ProgramEngine, empty_result
from experiments.evidence.trials.other_codes.code_surfaces import Bench
from experiments.evidence.trials.other_codes.dump_reading import (
    DRAG,
    FRAMES,
    filmed_observables,
    read_balance,
    read_film,
)
from experiments.evidence.trials.other_codes.liggghts_trials import INPUT, liggghts_files
from experiments.io.errors import InputError
from experiments.studyfile.observables import OBSERVABLES, PHOTOGRAPHED

REPORTED = tuple(each.name for each in OBSERVABLES if each.name not in PHOTOGRAPHED)
"""Observables that a film and a balance report."""


class Liggghts:
    """The code that runs a trial's test from an input of its own."""

    name = "LIGGGHTS"
    program = "liggghts"
    observables = REPORTED

    @property
    def identity(self) -> dict[str, Any]:
        """Name of the code, and what the sources mean that write its inputs and read its film."""
        return {"code": self.name, "sources": _sources()}

    def answers(self, case: Case) -> tuple[str, ...]:
        """Name the film and the balance."""
        return FRAMES, DRAG

    def check(self, case: Case) -> None:
        """Raise ValueError where the code is not there, or cannot have a case."""
        self._located()
        liggghts_files(Bench(case))

    def write(self, case: Case, folder: Path) -> Sequence[str]:
        """Write the input, and return the command that runs it."""
        for name, text in liggghts_files(Bench(case)).items():
            (folder / name).write_text(text, encoding="utf-8")
        return [self._located(), "-in", INPUT]

    def read(self, case: Case, folder: Path) -> CaseResult:
        """Read the film and the balance of a test."""
        [shape] = case.grains.mixture.shapes
        film, forces = read_film(folder / FRAMES, shape), read_balance(folder / DRAG)
        observables, last, failure = filmed_observables(case, film, forces)
        made_by = {"program": self.name}
        if failure:
            return empty_result("failed", failure, made_by)
        numbers = np.repeat(np.arange(len(last.spheres)), shape.sphere_count)
        return heap_result(last.spheres.reshape(-1, 4), numbers, observables, made_by)

    def _located(self) -> str:
        if path := shutil.which(self.program):
            return path
        raise InputError("the code", f"{self.name} must be installed, its program on the PATH", self.program)


TIME_LIMIT = 1800.0
"""Wall time of a heap [s]: a few seconds of a core, on a machine that may have other things to do."""


def liggghts_engine() -> ProgramEngine:
    """Engine that runs several heaps at once."""
    return ProgramEngine(Liggghts(), time_limit=TIME_LIMIT)


@cache
def _sources() -> str:
    """Hash of what the sources of this package and of the exporters mean."""
    digest = hashlib.sha256()
    for folder in (Path(__file__).parent, Path(experiments.export.__path__[0])):
        for path in sorted(folder.glob("*.py")):
            digest.update(f"{path.name}\n{source_meaning(path.read_text(encoding='utf-8'))}\n".encode())
    return digest.hexdigest()
