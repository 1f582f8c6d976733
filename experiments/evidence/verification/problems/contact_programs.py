"""Paths for codes that a program drives: what it reads, and the states that it leaves."""

from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from experiments.evidence.verification.problems.contact_paths import SAMPLES, PathSetup, Trajectory
from experiments.export import Exporter, values


def program_text(name: str) -> str:
    """Text of a program in this folder."""
    return (files("experiments.evidence.verification.problems") / name).read_text(encoding="utf-8")


def path_numbers(setup: PathSetup, exporter: Exporter) -> dict[str, Any]:
    """Return all numbers of a path in SI units, with the terms of an exporter."""
    contact = setup.contact
    return {
        "name": setup.path.name,
        "time_step": setup.time_step,
        "stride": setup.stride,
        "samples": SAMPLES,
        "has_plate": setup.path.has_plate,
        "gravity": setup.gravity,
        "density": setup.grain.density,
        "radii": setup.radii,
        "masses": setup.masses,
        "reduced_radius": contact.radius,
        "positions": setup.positions.tolist(),
        "speeds": setup.path.speeds,
        "spins": setup.path.spins,
        "materials": [values(exporter.material_terms(one)) for one in (contact.first, contact.second)],
        "terms": values(exporter.contact_terms(contact)),
    }


def trajectory_of(states: ArrayLike) -> Trajectory:
    """Trajectory from the state at the start, then those at every stride and a step after.

    Velocities stand half a step before the places: their mean over two steps belongs to them.
    """
    every = np.asarray(states, dtype=float)
    at, after = every[1::2], every[2::2]
    centred = np.concatenate([at[..., :3], 0.5 * (at[..., 3:] + after[..., 3:])], axis=-1)
    found = np.concatenate([every[:1], centred])
    return Trajectory(found[..., :3], found[..., 3:6], found[..., 6:9])
