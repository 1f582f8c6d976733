"""Chapter of the verification on the contacts of one code."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from dem_warp import ContactLaws
from experiments.verification.codes.contact_cases import CASES, GRAIN, RADIUS, SURFACE, Trajectory, simulated
from experiments.verification.codes.driver import CodeRun
from experiments.verification.result import Curve, Plot, Result, absolute_row

TOLERANCE = 1e-3
"""Largest difference of two trajectories, over their size, that passes."""

SHOWN = ("two spheres, oblique", "plate, oblique", "plate, rolling")
"""Cases whose spin is drawn."""


def code_result(
    run: CodeRun, laws: ContactLaws, device: str, text: str, explained: Mapping[str, str] | None = None
) -> Result:
    """Compare a code's trajectories with ours under some laws.

    Parameters
    ----------
    run
        Trajectories of the code, in the order of the cases.
    laws
        Laws that the code's input was written for.
    device
        Device of our simulation.
    text
        What a reader must know of the code.
    explained
        Sentences for the cases that differ by a known cause; those are stated and not judged.
    """
    explained = explained or {}
    ours, rows = simulated(CASES, laws, device), []
    for case, there, here in zip(CASES, run.trajectories, ours, strict=True):
        labels = f"{len(there.positions)} states in {case.duration:g} s, {case.time_step:.3g} s a step"
        tolerance = None if case.name in explained else TOLERANCE
        for quantity, difference in there.difference(here, case).items():
            row = (case.name, labels, f"difference of {quantity} over their size", run.version)
            rows.append(absolute_row(row, 0.0, difference, tolerance))
    about = (
        f"Spheres of {RADIUS * 1e3:g} mm, {GRAIN.youngs_modulus:g} Pa, e = {SURFACE.restitution:g}, mu = "
        f"{SURFACE.static_friction:g}, mu_r = {SURFACE.rolling_friction:g}; the plate is of steel. Both "
        f'codes start from the same state, with the laws `"{laws.name}"` and the coefficients that '
        "`dem-warp export` writes; a difference is the largest of all states and spheres."
    )
    notes = [f"*{name}*: {sentence}" for name, sentence in explained.items()]
    title = f"Contacts in {run.version}"
    return Result(title, "\n\n".join([f"{text}\n{about}", *notes]), tuple(rows), _plots(run, ours))


def _plots(run: CodeRun, ours: list[Trajectory]) -> tuple[Plot, ...]:
    stem = run.version.split()[0].lower()
    plots = []
    for number, case in enumerate(CASES):
        if case.name not in SHOWN:
            continue
        times = np.arange(len(ours[number].spins)) * case.stride * case.time_step * 1e3
        curves = [Curve("dem-warp", times, _spin(ours[number]), colour=0)]
        there = _spin(run.trajectories[number])
        curves.append(Curve(run.version, times[::8], there[::8], "points", 1))
        name = f"contacts-{stem}-{case.name.replace(',', '').replace(' ', '-')}"
        plots.append(Plot(name, f"{case.name}: spin", "time [ms]", "spin [rad/s]", tuple(curves)))
    return tuple(plots)


def _spin(trajectory: Trajectory) -> np.ndarray:
    """Component of the first sphere's spin that changes most."""
    spins = trajectory.spins[:, 0]
    return spins[:, np.ptp(spins, axis=0).argmax()]
