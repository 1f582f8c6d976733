"""Contacts that leave for another code, and trajectories that come back."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from dem_warp import ContactLaws, Material
from experiments.export import values
from experiments.export.contact import Contact, Term
from experiments.verification.codes.contact_cases import GRAIN, RADIUS, SAMPLES, ContactCase, Trajectory

INPUT, OUTPUT = "cases.json", "trajectories.json"


@dataclass(frozen=True)
class CodeRun:
    """Trajectories of a code, case by case."""

    version: str
    """Its name with it."""
    trajectories: tuple[Trajectory, ...]


def case_numbers(
    case: ContactCase,
    laws: ContactLaws,
    material_terms: Callable[[Material], tuple[Term, ...]],
    contact_terms: Callable[[Contact], tuple[Term, ...]],
) -> dict[str, Any]:
    """All numbers of a case, in SI units, with the terms of an exporter."""
    contact = case.contact(laws)
    return {
        "name": case.name,
        "time_step": case.time_step,
        "stride": case.stride,
        "samples": SAMPLES,
        "on_plate": case.on_plate,
        "gravity": case.gravity,
        "radius": RADIUS,
        "density": GRAIN.density,
        "mass": case.mass,
        "reduced_radius": contact.radius,
        "positions": case.positions,
        "velocities": case.velocities,
        "spins": case.spins,
        "materials": [values(material_terms(one)) for one in (contact.first, contact.second)],
        "terms": values(contact_terms(contact)),
    }


def write_cases(folder: Path, program: str, numbers: Sequence[dict[str, Any]]) -> None:
    """Write a program of this package, by its file name, and the cases that it reads, into a folder."""
    text = (files("experiments.verification.codes") / program).read_text(encoding="utf-8")
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "contacts.py").write_text(text, encoding="utf-8")
    (folder / INPUT).write_text(json.dumps(numbers, indent=1), encoding="utf-8")


def read_run(path: Path) -> CodeRun:
    """Read what a program wrote: states of positions, velocities and spins, sphere by sphere."""
    stored = json.loads(path.read_text(encoding="utf-8"))
    states = [np.array(one, dtype=float) for one in stored["trajectories"]]
    found = tuple(Trajectory(one[..., :3], one[..., 3:6], one[..., 6:9]) for one in states)
    return CodeRun(stored["code"], found)


def write_run(run: CodeRun, path: Path) -> None:
    """Write trajectories as `read_run` takes them, with six digits after the first."""
    states = [np.concatenate([t.positions, t.velocities, t.spins], axis=2) for t in run.trajectories]
    rounded = [[[[float(f"{x:.7g}") for x in ball] for ball in state] for state in one] for one in states]
    text = json.dumps({"code": run.version, "trajectories": rounded}, separators=(",", ":"))
    path.write_text(text + "\n", encoding="utf-8")
