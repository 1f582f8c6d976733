"""A settled column here and in another code, each with the skin that suits it best."""

from collections.abc import Sequence
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pandas as pd

from dem_warp import LiftedCylinder
from dem_warp.model import Grains
from dem_warp.solver import CHUNK, Solver
from experiments.evidence.performance.columns import Columns, Moment
from experiments.evidence.performance.contact_counts import placed_centers
from experiments.evidence.performance.peers.peer import PeerRun, Plan
from experiments.evidence.performance.peers.peer_list import PEERS, PeerName
from experiments.evidence.performance.result_pages import Part
from experiments.evidence.performance.roofline import world_contacts
from experiments.evidence.performance.timing import STRETCHES, Timing, run_in, start, time_steps

SKINS = (5e-5, 1e-4, 2e-4, 4e-4)
"""Skins that both codes try [m]."""

REST_AFTER = 0.1
"""Simulated time that both codes run in, for a column that is at rest and builds no more lists [s]."""

SPEED = "million sphere-steps/s"


def compare(name: PeerName, columns: Columns, steps: int, folder: Path) -> Part:
    """Time a settled column here, in another code with its files in a folder, and here again."""
    case = columns.cases[0]
    moment = _below_rim(columns.moments("settled", 1)[0], case.scene)
    default = moment.setup.skin
    ours = {skin: _start(moment, skin, columns.device) for skin in (*SKINS, default)}
    timings = {skin: [time_steps(solver, steps)] for skin, solver in ours.items()}
    lead = int(np.ceil(REST_AFTER / (moment.setup.time_step * CHUNK))) * CHUNK
    plan = Plan(SKINS, lead, timings[default][0].steps, 2 * STRETCHES)
    theirs = PEERS[name].run(folder, case, moment, plan)
    for skin, solver in ours.items():
        timings[skin].append(time_steps(solver, steps))

    rows = [_row("dem-warp", skin, _joined(pair)) for skin, pair in timings.items()]
    rows += [_row(theirs.version, skin, timing) for skin, timing in theirs.timings.items()]
    table = pd.DataFrame(rows)
    return name, _summary(table, ours[default], theirs), table


def _below_rim(moment: Moment, tube: LiftedCylinder) -> Moment:
    """Return the column without the grains that reach over the rim: a peer's tube has no rim."""
    setup = moment.setup
    grains, shape = setup.grains, setup.shapes[0]
    centers = placed_centers(shape, grains.positions, grains.orientations, grains.sizes)
    over = (centers[:, 2] > tube.height) | (np.hypot(centers[:, 0], centers[:, 1]) > tube.diameter / 2)
    kept = ~over.reshape(grains.count, -1).any(axis=1)
    left = Grains(**{field.name: getattr(grains, field.name)[kept] for field in fields(grains)})
    return replace(moment, setup=replace(setup, grains=left))


def _start(moment: Moment, skin: float, device: str) -> Solver:
    solver = start([replace(moment, setup=replace(moment.setup, skin=skin))], device)
    run_in(solver, REST_AFTER)
    return solver


def _joined(timings: Sequence[Timing]) -> Timing:
    """One timing of the same batch's stretches."""
    first, *rest = timings
    seconds = sum((timing.seconds for timing in rest), first.seconds)
    return replace(first, seconds=seconds, rebuilds=float(np.mean([timing.rebuilds for timing in timings])))


def _row(code: str, skin: float, timing: Timing) -> dict[str, object]:
    return {
        "code": code,
        "skin mm": 1e3 * skin,
        "us a step": 1e6 * timing.step_seconds,
        "fastest": 1e6 * min(timing.seconds) / timing.steps,
        "slowest": 1e6 * max(timing.seconds) / timing.steps,
        SPEED: timing.sphere_steps / 1e6,
        "rebuilds per 1000": 1000 * timing.rebuilds,
    }


def _summary(table: pd.DataFrame, ours: Solver, theirs: PeerRun) -> str:
    here, there = table[table["code"] == "dem-warp"], table[table["code"] != "dem-warp"]
    best, peer, default = here[SPEED].max(), there[SPEED].max(), here[SPEED].iloc[-1]
    fastest = there["fastest"].min() / here["fastest"].min()
    contacts = world_contacts(ours, 0)
    return (
        f"A settled column of {ours.layout.grain_count} clumps on one core, here and in {theirs.version}, "
        f"each at its best skin: {best:.1f} against {peer:.1f} million sphere-steps/s, {best / peer:.2f} "
        f"times as fast ({fastest:.2f} by the fastest stretches; {default / peer:.2f} with the default skin, "
        "the last of dem-warp's rows). At the end "
        f"{contacts.grain_pairs} and {theirs.contacts.grain_pairs} contacts between grains, "
        f"{contacts.wall_pairs} and {theirs.contacts.wall_pairs} with walls; kinetic energy "
        f"{_kinetic_energy(ours):.1e} and {theirs.kinetic_energy:.1e} J. {theirs.version} started within "
        f"{1e9 * theirs.placement_error:.1f} nm of the same places."
    )


def _kinetic_energy(solver: Solver) -> float:
    """Kinetic energy of the translation in the first world [J]."""
    view = solver.view([0])[0]
    return float(0.5 * view.masses[view.alive] @ (view.velocities[view.alive] ** 2).sum(axis=1))
