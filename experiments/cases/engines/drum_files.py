"""Drum that another code has turned, measured by the controller of our own drum."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from dem_warp import Case, CaseResult
from dem_warp.model import Grains, WorldSetup
from dem_warp.scenes.drum import DrumController, DrumState
from dem_warp.scenes.walled_scene import world_of
from dem_warp.view import WorldView
from experiments.cases.engines.contract import grains_of, heap_result
from experiments.cases.engines.program import AnswerError, empty_result
from experiments.export.drum import TURNED_FILE
from experiments.export.hopper_text import FILLED_FILE
from experiments.grains.spheres.lammps_dump import read_looks


def drum_result(case: Case[Any], folder: Path, provenance: dict[str, Any]) -> CaseResult:
    """Show the looks at another code's drum to the controller of ours, and return what it measures.

    Raise InputError for a malformed file, AnswerError for one that ends before the last look.
    """
    files = (read_looks(folder / name) for name in (FILLED_FILE, TURNED_FILE))
    looks = ((step, heap_result(*grains_of(found), {}, {})) for file in files for step, found in file)
    step, filled = next(looks)
    # the other code has struck off what it found above the brim: all that is left counts
    counted = replace(case, scene=replace(case.scene, grain_count=len(filled.positions)))
    world = _world(counted, filled)
    watcher = DrumController(counted, world, 1)
    since = step * case.time_step
    watcher.state = DrumState("settle", phase_start=since, slow_since=-math.inf)
    watcher.look(_view(step, filled, world))
    for step, bed in looks:
        decision = watcher.look(_view(step, bed, world))
        if decision.done:
            seen = watcher.state.observables
            made = empty_result("failed", decision.failure, provenance) if decision.failure else bed
            return replace(made, observables=seen, provenance=provenance)
    raise AnswerError(f"{TURNED_FILE} ends before the drum has turned {case.scene.revolutions:g} times")


def _world(case: Case[Any], filled: CaseResult) -> WorldSetup:
    """Return the world of grains that rest."""
    [shape], count = case.grains.mixture.shapes, len(filled.positions)
    grains = Grains(
        positions=filled.positions,
        orientations=filled.orientations,
        velocities=np.zeros((count, 3)),
        spins=np.zeros((count, 3)),
        sizes=filled.clumps[:, :, 3].sum(axis=1) / shape.radii.sum(),
        densities=np.full(count, case.grain_material.density),
        shapes=np.zeros(count, dtype=int),
        release_steps=np.zeros(count, dtype=int),
    )
    reach = shape.bounding_radius * float(grains.sizes.max())
    return world_of(case, grains, (shape,), reach)


def _view(step: int, bed: CaseResult, world: WorldSetup) -> WorldView:
    """Return what a controller sees of grains; it needs no speeds of a drum that has rested or turns."""
    count = len(bed.positions)
    return WorldView(
        step=step,
        time=step * world.time_step,
        alive=np.ones(count, dtype=bool),
        released=np.ones(count, dtype=bool),
        positions=bed.positions,
        velocities=np.zeros((count, 3)),
        masses=world.masses,
        impulses=np.zeros((0, 3)),
        rms_speed=0.0,
        fastest=0.0,
        highest=float(bed.positions[:, 2].max()),
    )
