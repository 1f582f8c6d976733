"""Running LAMMPS and what descends from it, and reading what they write."""

import re
from pathlib import Path

import numpy as np

from experiments.evidence.performance.columns import Moment
from experiments.evidence.performance.peers.peer import PeerRun, Plan, execute, judged
from experiments.evidence.performance.timing import Timing

INPUT, LOG = "column.in", "column.log"

START, END = "start.txt", "end.txt"
"""Dumps of the spheres: number, centre and radius."""


def run_input(program: str, folder: Path, moment: Moment, plan: Plan, version: str, before: int) -> PeerRun:
    """Run the input of a folder.

    `version` is its pattern in the log; the stretches come after a number of runs `before` them.
    """
    status = execute([program, "-in", INPUT, "-log", LOG], folder)
    log = (folder / LOG).read_text(encoding="utf-8", errors="replace")
    error = re.search(r"^ERROR.*", log, re.MULTILINE)
    if status or error:
        raise RuntimeError(f"{program} failed in {folder}: {error[0] if error else status}")
    start, end = read_spheres(folder / START), read_spheres(folder / END)
    name = re.findall(version, log, re.MULTILINE)[0]
    # the second and last column of the last line of thermodynamic output
    energy = float(re.findall(r"^ +\d+ +(\S+) *\nLoop time", log, re.MULTILINE)[-1])
    return judged(moment, name, _timings(log, plan, len(end), before), energy, start, end)


def timed_runs(plan: Plan) -> str:
    """Commands that time every skin of a plan."""
    return "".join(f"neighbor {skin} bin\n" + f"run {plan.steps}\n" * plan.stretches for skin in plan.skins)


def _timings(log: str, plan: Plan, spheres: int, before: int) -> dict[float, Timing]:
    """Loop times of the stretches by skin, after a number of other runs."""
    loops = re.findall(r"^Loop time of (\S+) on 1 procs for \d+ steps", log, re.MULTILINE)[before:]
    builds = re.findall(r"^Neighbor list builds = (\d+)", log, re.MULTILINE)[before:]
    timings = {}
    for k, skin in enumerate(plan.skins):
        rows = slice(k * plan.stretches, (k + 1) * plan.stretches)
        seconds = tuple(map(float, loops[rows]))
        rebuilds = sum(map(int, builds[rows])) / (plan.steps * plan.stretches)
        timings[skin] = Timing(plan.steps, seconds, spheres, rebuilds)
    return timings


def read_spheres(path: Path) -> np.ndarray:
    """Centres and radii of a dump, in the order of their numbers, (n, 4)."""
    lines = path.read_text(encoding="utf-8").splitlines()
    first = next(i for i, line in enumerate(lines) if line.startswith("ITEM: ATOMS")) + 1
    return np.array([line.split()[1:] for line in lines[first:]], dtype=float)
