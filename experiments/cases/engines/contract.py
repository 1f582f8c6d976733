"""The folder contract of docs/engine.md: a case as files for any program, and its answer."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import shutil
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dem_warp import Case, CaseResult, GrainPopulation, Material
from dem_warp.population import SIZE_LIMIT
from experiments.cases.engines.program import AnswerError, empty_result
from experiments.cases.engines.surfaces import triangles_of
from experiments.export.lift import stl_text
from experiments.grains.spheres import SphereFile, read_spheres
from experiments.io.errors import InputError
from experiments.io.files import write_text
from experiments.studyfile.engine_section import words_of

FORMAT = 1
"""Version of the contract."""

CASE, HEAP, RESULT = "case.json", "heap.csv", "result.json"
"""Files of the case and of the answer: the heap's spheres, its status and observables."""

COLUMNS = ("x", "y", "z", "r")
"""Columns of the heap [m]; a further one, ``grain``, numbers the grain of each sphere."""

STATUSES = ("finished", "failed", "diverged", "overflow")


@dataclass(frozen=True)
class CommandProgram:
    """A program that keeps the contract; made by `command_program`."""

    words: tuple[str, ...]
    version: str = ""
    observables: tuple[str, ...] = ()
    """Observables of the test that it gives with the heap."""

    @property
    def name(self) -> str:
        """The command, its paths without their folders."""
        return " ".join(Path(word).name if Path(word).is_absolute() else word for word in self.words)

    @property
    def identity(self) -> dict[str, Any]:
        """The command's words, and what is in the scripts that they name."""
        digests = {str(number): _digest(word) for number, word in enumerate(self.words) if _is_script(word)}
        answer = {"contract": FORMAT, "observables": list(self.observables)}
        return {"command": self.name, "version": self.version, "files": digests, **answer}

    def check(self, case: Case) -> None:
        """Accept every case: the program itself rejects what it lacks."""

    def answers(self, case: Case) -> tuple[str, ...]:
        """Return the names of the files of the answer."""
        return HEAP, RESULT

    def write(self, case: Case, folder: Path) -> Sequence[str]:
        """Write ``case.json``, and the clumps and walls that it names."""
        write_case(case, folder)
        return self.words

    def read(self, case: Case, folder: Path) -> CaseResult:
        """Read ``heap.csv`` and ``result.json``."""
        return read_answer(case, folder)


def command_program(
    command: str, folder: Path, place: str, version: str = "", observables: tuple[str, ...] = ()
) -> CommandProgram:
    """Build the program of a command; words that name files in a folder become whole paths.

    Raise InputError when there is no such program; `place` is that of the command.
    """
    try:
        first, *others = words_of(command)
    except ValueError as error:
        raise InputError(place, str(error) or "must name a program", command) from None
    local = folder / first
    program = str(local.resolve()) if local.is_file() else shutil.which(first)
    if program is None or (local.is_file() and shutil.which(program) is None):
        problem = f"must begin with a program on the PATH or in {folder.resolve()}"
        raise InputError(place, problem, first)
    words = [str((folder / word).resolve()) if (folder / word).is_file() else word for word in others]
    return CommandProgram((program, *words), version, observables)


def _is_script(word: str) -> bool:
    """Return whether a word is a file, but not a compiled program."""
    path = Path(word)
    if not (path.is_absolute() and path.is_file()):
        return False
    with path.open("rb") as file:
        return b"\0" not in file.read(4096)


def _digest(word: str) -> str:
    return hashlib.sha256(Path(word).read_bytes()).hexdigest()


# ---- the case ----------------------------------------------------------------------------------------------


def write_case(case: Case[Any], folder: Path) -> None:
    """Write a case into a folder: ``case.json`` in SI, and the clumps and walls that it names.

    Raise ValueError when the case's test does not say which walls it has.
    """
    grains, mixture, scene = case.grains, case.grains.mixture, case.scene
    clumps = []
    for number, (shape, fraction) in enumerate(zip(mixture.shapes, mixture.fractions, strict=True), 1):
        name = f"clump-{number}.csv"
        rows = np.column_stack([shape.centers, shape.radii]).tolist()
        lines = [",".join(COLUMNS), *(",".join(map(repr, row)) for row in rows)]
        write_text(folder / name, "\n".join(lines) + "\n")
        mass = grains.material.density * shape.volume
        clumps.append(
            {
                "file": name,
                "fraction": fraction,
                "volume": shape.volume,
                "mass": mass,
                "principal_inertia": (mass * np.array(shape.inertia_over_mass)).tolist(),
                "bounding_radius": shape.bounding_radius,
            }
        )
    document = {
        "format": FORMAT,
        "seed": case.seed,
        "gravity": list(scene.gravity),
        "grain": {
            "material": _material(case.grain_material),
            "clumps": clumps,
            "size": _sizes(grains),
        },
        "wall": {"material": _material(scene.wall_material)},
        "contact": {
            "grain-grain": dataclasses.asdict(case.grain_grain),
            "grain-wall": dataclasses.asdict(case.grain_wall),
        },
        "laws": _laws(case),
        "scene": _scene(case),
        "walls": _walls(case, folder),
        "stop": {name: getattr(scene, name, None) for name in ("rest_speed", "rest_time")},
        "time_step": case.time_step,
        "observables": {
            name: {"unit": each.unit, "meaning": each.meaning} for name, each in scene.observables.items()
        },
    }
    write_text(folder / CASE, json.dumps(document, indent=1, allow_nan=False) + "\n")


def _sizes(grains: GrainPopulation) -> dict[str, Any]:
    """Lay out the distribution of the sizes: normal and cut, or classes."""
    sizes: dict[str, Any] = {"mean": grains.size_mean, "sd": grains.size_sd}
    if grains.classes is None:
        return sizes | {"cut": SIZE_LIMIT}
    pairs = zip(grains.classes.sizes, grains.classes.fractions, strict=True)
    return sizes | {"classes": [{"size": size, "fraction": fraction} for size, fraction in pairs]}


def _material(material: Material) -> dict[str, float]:
    return dataclasses.asdict(material) | {"youngs_modulus": material.youngs_modulus}


def _laws(case: Case[Any]) -> dict[str, Any]:
    """Lay out the contact laws: the name of their set, each choice, the softening, the mechanisms."""
    softened = {"modulus_scale": case.numerics.modulus_scale}
    mechanisms = {"mechanisms": case.to_dict()["mechanisms"]}
    return {"set": case.laws.name} | case.laws.to_dict() | softened | mechanisms


def _scene(case: Case[Any]) -> dict[str, Any]:
    """Lay out the kind and settings of the test, and the most grains that are poured."""
    scene, fields = case.scene, dataclasses.fields(case.scene)
    settings = {f.name: getattr(scene, f.name) for f in fields if f.name != "wall_material"}
    if "rain_rate" in settings:
        settings["rain_rate"] = scene.grains_per_second(case)
    return {"kind": scene.name} | settings | {"grains_at_most": scene.supply(case)}


def _walls(case: Case[Any], folder: Path) -> list[dict[str, Any]]:
    """Lay out the walls before they move: shape, surface, and a file of triangles each."""
    grains, scene = case.grains, case.scene
    reach = grains.size_range[1] * max(shape.bounding_radius for shape in grains.mixture.shapes)
    half_width = max(scene.room(reach)[:2])
    walls, rows = scene.walls(reach), []
    contacts, holds = scene.surfaces(case, len(walls))
    for number, wall in enumerate(walls):
        name = f"wall-{number + 1}.stl"
        write_text(folder / name, stl_text(f"wall-{number + 1}", triangles_of(wall, half_width)))
        contact = contacts[holds[number]]
        rows.append(
            {
                "kind": type(wall).__name__.lower(),
                "file": name,
                "point": list(wall.point),
                "axis": list(wall.axis),
                "radius": wall.radius,
                "upper_radius": wall.upper_radius,
                "length": wall.length,
                "static_friction": contact.static_friction,
                "rolling_friction": contact.rolling_friction,
            }
        )
        if part := scene.part_of(case, number):
            rows[-1] |= {"restitution": part.surface.restitution, "material": _material(part.material)}
    return rows


# ---- the answer --------------------------------------------------------------------------------------------


def read_answer(case: Case[Any], folder: Path) -> CaseResult:
    """Read the answer to a case.

    Raise AnswerError when a file is missing or malformed, or a number is not finite.
    """
    answer = _read_result(folder / RESULT)
    status, reason = answer.get("status"), answer.get("reason", "")
    if status not in STATUSES:
        raise AnswerError(f"{RESULT}: status must be one of {', '.join(STATUSES)}, got {_shown(status)}")
    if not isinstance(reason, str) or (status != "finished" and not reason.strip()):
        raise AnswerError(f"{RESULT}: a case that {status} needs its reason, got {_shown(reason)}")
    made_by = {"program": str(answer.get("program", ""))}
    if status != "finished":
        return empty_result(status, reason, made_by)
    observables = _observables(answer.get("observables", {}), list(case.scene.observables))
    if not case.scene.leaves_a_heap and not (folder / HEAP).is_file():
        return dataclasses.replace(empty_result(status, "", made_by), observables=observables)
    return heap_result(*read_heap(folder / HEAP), observables, made_by)


def _read_result(path: Path) -> dict[str, Any]:
    try:
        answer = json.loads(path.read_text(encoding="utf-8"))
    except OSError:
        raise AnswerError(f"the program wrote no {path.name}") from None
    except (ValueError, RecursionError) as error:
        raise AnswerError(f"{path.name}: must be JSON: {error}") from None
    if not isinstance(answer, dict):
        raise AnswerError(f"{path.name}: must be a JSON object, got {_shown(answer)}")
    return answer


def _observables(given: object, known: list[str]) -> dict[str, float]:
    if not isinstance(given, dict):
        raise AnswerError(f"{RESULT}: observables must be a JSON object, got {_shown(given)}")
    for name, value in given.items():
        if name not in known:
            raise AnswerError(f"{RESULT}: observables.{name}: must be one of {', '.join(known)}")
        if (
            isinstance(value, bool)
            or not isinstance(value, int | float)
            or not abs(value) <= sys.float_info.max
        ):
            raise AnswerError(f"{RESULT}: observables.{name}: must be a finite number, got {_shown(value)}")
    return {name: float(value) for name, value in given.items()}


def read_heap(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Read the spheres of a heap, in any format of `experiments.grains.spheres`; default unit: metre.

    Returns
    -------
    spheres, grains
        Centres and radii [m], (n, 4), and the number of each one's grain, (n,).

    Raise AnswerError when the file is missing, or a line breaks the rules.
    """
    if not path.is_file():
        raise AnswerError(f"the program wrote no {path.name}")
    try:
        found = read_spheres(path)
    except InputError as error:
        raise AnswerError(str(error).replace(str(path), path.name)) from error
    return grains_of(found)


def grains_of(found: SphereFile) -> tuple[np.ndarray, np.ndarray]:
    """Return the spheres of a file [m], (n, 4), and the number of each one's grain, (n,)."""
    bodies = np.arange(len(found.spheres)) if found.bodies is None else found.bodies
    return found.spheres * (found.unit or 1.0), np.unique(bodies, return_inverse=True)[1].ravel()


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 80 else f"{text[:77]}..."


def heap_result(
    spheres: np.ndarray, grains: np.ndarray, observables: dict[str, float], provenance: dict[str, Any]
) -> CaseResult:
    """Build the result of a finished case from its spheres [m], (n, 4), and the grain of each, (n,)."""
    order = np.argsort(grains, kind="stable")
    spheres, counts = spheres[order], np.bincount(grains)
    first = np.concatenate([[0], np.cumsum(counts)[:-1]])
    centers = np.add.reduceat(spheres[:, :3], first, axis=0) / counts[:, None]
    clumps = np.zeros((len(counts), int(counts.max()), 4))
    grain = np.repeat(np.arange(len(counts)), counts)
    place = np.arange(len(spheres)) - np.repeat(first, counts)
    clumps[grain, place] = spheres
    clumps[grain, place, :3] -= centers[grain]
    return CaseResult(
        status="finished",
        reason="",
        positions=centers,
        orientations=np.tile([0.0, 0.0, 0.0, 1.0], (len(counts), 1)),
        sizes=np.ones(len(counts)),
        shapes=np.arange(len(counts)),
        clumps=clumps,
        observables=observables,
        provenance=provenance,
    )
