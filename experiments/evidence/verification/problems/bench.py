"""Laws of the bench: shear against speed and adhesion, the fall of a pour."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.stats import sem

from dem_warp import Case, ClumpShape, GrainPopulation, Interaction, PouredHeap, Shear, simulate
from dem_warp.laws.jkr import JKR
from experiments.evidence.verification.check import Result, absolute_row, relative_row
from experiments.evidence.verification.problems.janssen import GLASS
from experiments.evidence.verification.problems.setups import GRAVITY, STEEL, WatchedSolver

LABEL, RADIUS, DROPS, SEEDS = "Laws of the bench", 1.5e-3, (0.02, 0.08, 0.32), range(1, 7)
ROUGH = Interaction(0.3, 0.5, 0.0)
GRAINS = GrainPopulation(ClumpShape.sphere(RADIUS), GLASS)
CELL = Shear(0.028, 0.018, STEEL, 1e3, speed=0.04, rest_speed=3e-3)
FUNNEL = PouredHeap(0.03, 0.03, outlet=0.02, wall_material=STEEL, mass_rate=0.02, grain_count=1)
TEXT = """Six columns of balls are sheared, also at half the speed and with JKR's adhesion of 0.5 and 1 J/m2;
+- is a standard error. Half the inertial number, .005 for .01, must change the shear stress by less than
2 %: six columns know the mean of five stresses to 2 %, chosen after a look, as the steady one is noisier.
With a friction of .5 and without rolling friction it is .36 to .40 of the normal one in slow flow. Cohesion,
the mean rise of the shear stress over five loads, is linear in the adhesion, within twice its error. The
centre of a poured ball falls by the drop less its radius; a step adds g dt, 7e-4 of the least speed."""


def bench(device: str) -> Result:
    """Return how shear and a fall change with their settings."""

    def seen(case: Case, kinds: list[Any], *names: str) -> np.ndarray:
        runs = simulate([replace(case, seed=seed, **kind) for kind in kinds for seed in SEEDS], device=device)
        values = [[run.observables.get(name, math.nan) for name in names] for run in runs]
        return np.array(values).reshape(len(kinds), len(SEEDS), len(names))

    kinds: list[Any] = [{"mechanisms": (JKR(work_of_adhesion=work),)} for work in (0.5, 1.0)]
    kinds += [{"scene": replace(CELL, speed=CELL.speed / part)} for part in (1, 2)]
    stresses = seen(Case(CELL, GRAINS, ROUGH, ROUGH), kinds, *(f"shear_stress_{n}" for n in range(1, 6)))
    low, high, usual, slow = stresses.mean(axis=2)
    ratio = (high - usual).mean() / (low - usual).mean()
    error = sem(high - usual - ratio * (low - usual)) / (low - usual).mean()
    flow = stresses[3, :, 4].mean() / CELL.stress
    faster, slower = stresses[2:, :, 4]
    steady = f"the steady one {slower.mean() - faster.mean():+.1f} +- {sem(slower - faster):.1f}"
    labels = f"mean of five shear stresses [Pa], +- {sem(slow - usual):.1f}; {steady}", "usual speed"
    cases = [Case(replace(FUNNEL, drop=drop), GRAINS, ROUGH, ROUGH, seed=1) for drop in DROPS]
    solver, falls = WatchedSolver(FUNNEL.prepare(cases, device), device, "double"), list[np.ndarray]()
    solver.watch(round(0.3 / cases[0].time_step), lambda state: falls.append(-state.velocity.numpy()[:, 2]))
    speeds = np.sqrt(FUNNEL.rain_speed**2 + 2 * GRAVITY * (np.array(DROPS) - RADIUS))
    rows = (
        relative_row((LABEL, "half the speed", *labels), usual.mean(), slow.mean(), 0.02),
        absolute_row((LABEL, "slow balls", "shear over normal stress", "literature"), 0.38, flow, 0.02),
        absolute_row((LABEL, "twice the adhesion", "cohesion", "linear"), 2.0, ratio, 2 * error),
        relative_row((LABEL, "poured", "speed [m/s]", "free fall"), speeds, np.max(falls, axis=0), 1e-3),
    )
    return Result(LABEL, TEXT, rows)
