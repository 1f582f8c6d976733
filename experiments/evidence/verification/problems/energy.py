"""A settling column whose energy is accounted for."""

from dataclasses import replace
from typing import Any

import numpy as np

from dem_warp import ClumpShape, Material, rayleigh_time
from dem_warp.model import ContactCoefficients, WorldSetup
from dem_warp.walls import Cylinder, Plane
from experiments.evidence.verification.check import (
    Curve,
    Plot,
    Result,
    Row,
    absolute_row,
    detection_row,
    order_row,
)
from experiments.evidence.verification.problems.energy_account import PARTS, STORED, EnergyAccount
from experiments.evidence.verification.problems.setups import (
    BUCKWHEAT,
    CLUMP,
    GRAVITY,
    WatchedSolver,
    bodies,
    contact,
    world,
)

SOFT = Material(BUCKWHEAT.density, BUCKWHEAT.shear_modulus / 400.0, BUCKWHEAT.poisson_ratio)
"""Grain at bench scale."""

FRACTIONS = (0.25, 0.125, 0.0625)
"""Time steps over the Rayleigh time of the smallest sphere; the first is production's."""

SETTLING = 0.12
"""Time in which the column falls and comes nearly to rest [s]."""

CONSTANTS = ("modulus", "shear_modulus", "damping", "static_friction", "rolling_friction")

TEXT = """Sixteen grains of nine spheres fall, turning, into a tube and settle. Next to the simulation, from
its poses and velocities alone, an account in NumPy finds the contacts without neighbour lists, works out the
documented law contact by contact, and books what every part of it did: stored in height, motion, normal and
tangential springs; lost to normal and tangential damping, sliding and rolling friction; and what the
tangential spring gained or lost because its stiffness follows the overlap, and because it is turned into the
contact's plane.

Two questions. *Is the force on every grain at every step that of the law?* In float64 it is, to rounding: no
contact is lost, none is late, no history is dropped. *Does the energy close?* What is left over falls with
the square of the step. A law that is 2 % off in any one constant fails."""

TUBE = Cylinder((0.0, 0.0, 0.0), 0.012, 0.2)


def column(shape: ClumpShape, count: int, spacing: float, step_fraction: float) -> WorldSetup:
    """Grains in layers of four above the floor of a tube, that fall, turning, and settle.

    `step_fraction` is the part of the smallest sphere's Rayleigh time that a step takes.
    """
    rng = np.random.default_rng(7)
    corners = 0.0048 * np.array([[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]])
    number = np.arange(count)
    grains = bodies(
        np.column_stack([corners[number % 4], 0.8 * spacing + spacing * (number // 4)]),
        SOFT.density,
        velocities=np.column_stack([rng.normal(size=(count, 2)) * 0.02, np.full(count, -0.4)]),
        spins=rng.normal(size=(count, 3)) * 10.0,
        orientations=rng.normal(size=(count, 4)),
        sizes=rng.uniform(0.9, 1.1, count),
    )
    law = contact(SOFT, SOFT, 0.3, 0.5, 0.05)
    time_step = step_fraction * rayleigh_time(float(shape.radii.min()), SOFT)
    gravity = (0.0, 0.0, -GRAVITY)
    return world(grains, shape, law, time_step, walls=(Plane(), TUBE), gravity=gravity, extent=0.12)


def watched(
    setup: WorldSetup, time: float, laws: list[ContactCoefficients], device: str, precision: str = "double"
) -> list[EnergyAccount]:
    """Accounts, one by each law, of a world that runs for a time [s]."""
    accounts = [EnergyAccount(setup, law) for law in laws]
    solver = WatchedSolver([setup], device, precision)

    def see(state: Any) -> None:
        for account in accounts:
            account.see(state)

    see(solver.grains[0])
    solver.watch(int(time / setup.time_step), see)
    return accounts


def unaccounted(account: EnergyAccount) -> float:
    """Largest change of all energies together, over the energy lost."""
    total = account.parts.sum(axis=1)
    return float(np.abs(total - total[0]).max() / account.parts[-1, len(STORED) :].sum())


def _law_rows(problem: str, case: str, account: EnergyAccount) -> list[Row]:
    gaps = {
        "any force": account.force_gap / account.largest_force,
        "any torque": account.torque_gap / account.largest_torque,
    }
    quantity, law = "off the law, over the largest", "the law in NumPy, float64"
    return [absolute_row((problem, case, f"{k} {quantity}", law), 0.0, gap, 1e-9) for k, gap in gaps.items()]


def _wrong_law_rows(problem: str, setup: WorldSetup, device: str) -> list[Row]:
    """Check that a law 2 % off in any of its constants does not pass for the simulator's."""
    law = setup.contacts[0]
    wrong = [replace(law, **{name: 1.02 * getattr(law, name)}) for name in CONSTANTS]
    accounts = watched(setup, 0.3 * SETTLING, wrong, device)
    rows, quantity = [], "any torque off the law, over the largest"
    for name, account in zip(CONSTANTS, accounts, strict=True):
        case = f"account by a law with 2 % more {name.replace('_', ' ')}"
        gap = account.torque_gap / account.largest_torque
        rows.append(detection_row(problem, case, quantity, 1e-3, gap))
    return rows


def _parts_plot(account: EnergyAccount) -> Plot:
    parts = account.parts
    every = slice(None, None, max(len(parts) // 300, 1))
    times = 1e3 * account.setup.time_step * np.arange(len(parts))[every]
    parts = parts - np.where(np.array(PARTS) == "height", parts[-1, PARTS.index("height")], 0.0)
    curves = [Curve(name, times, 1e6 * parts[every, k]) for k, name in enumerate(PARTS)]
    curves.append(Curve("sum of all", times, 1e6 * parts[every].sum(axis=1), "dashed"))
    return Plot("energy", "Settling column of 16 grains", "time [ms]", "energy [uJ]", tuple(curves))


def energy(device: str) -> Result:
    """Return the closed account of a settling column."""
    problem = "Settling column"
    shape = ClumpShape.read(CLUMP)
    setups = [column(shape, 16, 0.0075, fraction) for fraction in FRACTIONS]
    law = setups[0].contacts[0]
    wrong = replace(law, damping=1.02 * law.damping)
    books = [watched(setup, SETTLING, [law, wrong], device) for setup in setups]
    left = np.array([[unaccounted(account) for account in accounts] for accounts in books])
    rows = _law_rows(problem, "16 buckwheat grains, 25 % of the Rayleigh time, float64", books[0][0])
    quantity = "energy unaccounted for, over what was lost"
    for fraction, gap in zip(FRACTIONS, left[:, 0], strict=True):
        case = f"{100 * fraction:g} % of the Rayleigh time, float64"
        tolerance = 5e-3 * (fraction / FRACTIONS[0]) ** 2 * 1.2
        rows.append(absolute_row((problem, case, quantity, "closed account"), 0.0, gap, tolerance))
    steps, order = 1.0 / np.array(FRACTIONS), "order of the unaccounted energy"
    rows.append(order_row(problem, "float64", order, steps, left[:, 0], 2.0, 1.7))
    mixed = unaccounted(watched(setups[0], SETTLING, [law], device, "mixed")[0])
    case = "25 % of the Rayleigh time, production precision"
    rows.append(absolute_row((problem, case, quantity, "closed account"), 0.0, mixed, 6e-3))
    case = f"{100 * FRACTIONS[-1]:g} % of the Rayleigh time, account with 2 % more damping"
    more = left[-1, 1] / left[-1, 0]
    rows.append(detection_row(problem, case, f"{quantity}, over the true law's", 5.0, more))
    rows += _wrong_law_rows(problem, setups[0], device)
    return Result("Energy", TEXT, tuple(rows), (_parts_plot(books[-1][0]),))
