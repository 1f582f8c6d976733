"""Drivers: codes that a case can be exported to, as engines that run the exported input."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import experiments.export
from dem_warp import Case, CaseResult, Drum
from dem_warp.provenance import source_meaning
from experiments.cases.engines.contract import heap_result, read_heap
from experiments.cases.engines.discharge_files import discharge_result
from experiments.cases.engines.drum_files import drum_result
from experiments.cases.engines.program import AnswerError
from experiments.export import EXPORTERS, ExportedTest, Translation, export_input
from experiments.export.hopper_text import FILLED_FILE
from experiments.io.errors import InputError
from experiments.io.files import write_text

APPROXIMATE = "[engine] approximate = true (bridge: --approximate)"
"""Setting that asks for the nearest of what a code lacks."""


@dataclass(frozen=True)
class Driver:
    """A code that runs what its exporter writes."""

    name: str
    """Name of its exporter."""
    approximate: bool = False
    """Take the nearest for what the code lacks, as the exporter does."""
    observables: tuple[str, ...] = ()

    def answers(self, case: Case) -> tuple[str, ...]:
        """Return the names of the files of the heap, or of the filled container and what happened then."""
        heap = self._translation(case).heap
        return (heap,) if case.scene.leaves_a_heap else (FILLED_FILE, heap)

    @property
    def identity(self) -> dict[str, Any]:
        """Name of the code, and the hash of the exporters."""
        return {"driver": self.name, "approximate": self.approximate, "exporters": _exporters()}

    def check(self, case: Case) -> None:
        """Raise ValueError if the code cannot simulate a case or is not installed."""
        self._located(self._translation(case))

    def write(self, case: Case, folder: Path) -> Sequence[str]:
        """Write the exported input, and return the command that runs it."""
        translation = self._translation(case)
        for name, text in translation.files.items():
            write_text(folder / name, text)
        return [self._located(translation), *translation.command[1:]]

    def read(self, case: Case, folder: Path) -> CaseResult:
        """Read the spheres of the heap, the weighed discharge of a hopper, or the looks at a drum."""
        made_by, files = {"program": EXPORTERS[self.name].code}, self.answers(case)
        if missing := [name for name in files if not (folder / name).is_file()]:
            raise AnswerError(f"the program wrote no {missing[0]}")
        if case.scene.leaves_a_heap:
            return heap_result(*read_heap(folder / files[0]), {}, made_by)
        result = drum_result if isinstance(case.scene, Drum) else discharge_result
        try:
            return result(case, folder, made_by)
        except InputError as error:
            raise AnswerError(str(error).replace(f"{folder}/", "")) from error

    def _translation(self, case: Case) -> Translation:
        test = ExportedTest(self.name, case, "the case")
        translation = export_input(test, self.name, self.approximate, APPROXIMATE)
        if not (translation.command and translation.heap):
            raise InputError("engine", "must be a code whose input can be run here", self.name)
        return translation

    def _located(self, translation: Translation) -> str:
        program = translation.command[0]
        if path := shutil.which(program):
            return path
        problem = f"{EXPORTERS[self.name].code} is not on the PATH"
        raise InputError("engine", problem, program)


@cache
def _exporters() -> str:
    """Return the hash of the exporters' sources, without docstrings and comments."""
    folder, digest = Path(experiments.export.__path__[0]), hashlib.sha256()
    for path in sorted(path for path in folder.rglob("*") if path.suffix in (".py", ".toml", ".txt")):
        text = path.read_text(encoding="utf-8")
        text = source_meaning(text) if path.suffix == ".py" else text
        digest.update(f"{path.relative_to(folder).as_posix()}\n{text}\n".encode())
    return digest.hexdigest()
