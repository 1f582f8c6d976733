"""Discharge that another code has weighed, measured by the functions of our own hopper."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from dem_warp import Case, CaseResult
from dem_warp.scenes.discharge import DischargeState
from dem_warp.scenes.surfaces import bed_level
from experiments.cases.engines.contract import heap_result, read_heap
from experiments.cases.engines.program import AnswerError, empty_result
from experiments.export.hopper_text import DISCHARGE_FILE, FILLED_FILE, volume_share
from experiments.io.texts import read_text


def discharge_result(case: Case[Any], folder: Path, provenance: dict[str, Any]) -> CaseResult:
    """Read the filled hopper and its weighed discharge; raise AnswerError for a malformed file."""
    spheres, grains = read_heap(folder / FILLED_FILE)
    looks = _looks(folder / DISCHARGE_FILE)
    since, mass, over, stay = looks.T
    scene, [shape] = case.scene, case.grains.mixture.shapes
    volume = volume_share(shape) * float((spheres[:, 3] ** 3).sum())
    filled = volume * case.grain_material.density
    reach = float(spheres[:, 3].max())
    centers = heap_result(spheres, grains, {}, {}).positions
    level = bed_level(centers, scene.cross_section(reach).half_sides, case.grains.grain_reach)
    state = DischargeState("rest")
    # where no grain has fallen the mass is the same to the last bit, in any order of the sum
    _, first, number = np.unique(stay, return_index=True, return_inverse=True)
    out = np.where(stay == len(spheres), 0.0, (filled - mass)[first][number])
    state.fallen = [[0.0, 0.0], *np.column_stack([since, out]).tolist()]
    seen = {
        "grain_count": float(len(centers)),
        "fill_height": level - scene.floor,
        "solid_fraction": volume / scene.volume_below(level),
        "filled_mass": filled,
        "fallen_mass": float(out[-1]),
        "mass_left": float(mass[-1]),
        "discharge_time": state.last_fall,
        "clogged": float(over[-1] > 0 or out[-1] == 0.0),
    }
    if seen["clogged"]:
        left = seen["mass_left"]
        reason = f"the outlet is clogged: {left:.3g} kg of {filled:.3g} kg stay above it"
        return replace(empty_result("failed", reason, provenance), observables=seen)
    rates = {"flow_rate": state.flow_rate, "flow_rate_se": state.flow_rate_se}
    seen |= {name: rate for name, rate in rates.items() if rate is not None}
    return replace(empty_result("finished", "", provenance), observables=seen)


def _looks(path: Path) -> np.ndarray:
    """Return time [s], mass [kg] and the two numbers of grains of each look, (n, 4)."""
    try:
        looks = np.array([line.split() for line in read_text(path).splitlines()[1:]], dtype=float)
    except ValueError as error:
        raise AnswerError(f"{path.name}: {error}") from None
    if looks.ndim != 2 or looks.shape[1] != 4 or not np.isfinite(looks).all():
        raise AnswerError(f"{path.name}: must have lines of four finite numbers")
    return looks
