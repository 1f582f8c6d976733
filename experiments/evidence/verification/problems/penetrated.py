"""A cone that goes down: between spheres by Hertz, and its work in clumps."""

import math
from dataclasses import replace

import numpy as np

from dem_warp import ClumpShape
from dem_warp.walls import Cone, Cylinder, Motion, Plane
from experiments.evidence.verification.check import Result, relative_row
from experiments.evidence.verification.problems.energy import SOFT, column
from experiments.evidence.verification.problems.energy_account import EnergyAccount
from experiments.evidence.verification.problems.setups import CLUMP, WatchedSolver, bodies, contact, world

LABELS, R, C, S, SLOW, TIME = "A cone that goes down", 1.5e-3, math.sqrt(0.75), 0.5, 4e-4, 0.05
TEXT = """Three spheres without friction are between a cone of 60 degrees, a tube and a floor: the cone's path
normal to itself is d (1 + cos(30)^(5/3) + sin(30)^(5/3)) at overlap d. Its work in clumps is as booked."""


def penetrated(device: str) -> Result:
    """Return the force of a cone on three spheres, and its work in sixteen clumps."""
    turns, law = 2 * math.pi / 3 * np.arange(3), contact(SOFT, SOFT, 0.1)
    places = np.column_stack([2 * R * np.cos(turns), 2 * R * np.sin(turns), np.full(3, R)])
    tube, cone = Cylinder((0.0, 0.0, -0.01), 3 * R, 0.03), Cone((0.0, 0.0, 3 * R), 0.0, 0.02 * S, 0.02 * C)
    narrow = replace(cone, point=(0.0, 0.0, R - (2 * R - R / C) * C / S))
    walls, spheres = (Plane(), tube, narrow), bodies(places, SOFT.density)
    ring = world(spheres, ClumpShape.sphere(R), law, 1e-5, walls=walls, extent=0.05)
    settled = column(ClumpShape.read(CLUMP), 16, 0.0075, 0.125)
    filled = replace(settled, walls=(*settled.walls, (replace(cone, point=(0.0, 0.0, 0.1)), 1)))
    ends = []
    for setup, speeds in ((ring, (SLOW, 0.0, 0.0)), (filled, (0.0, 0.094 / TIME, 0.1))):
        solver, account = (
            WatchedSolver([replace(setup, weighed=(2,))], device, "double"),
            EnergyAccount(setup),
        )
        for speed in speeds:
            account.wall_velocities[2, 2], before = -speed, solver.impulses()[0, 0, 2]
            solver.move_wall(0, 2, Motion(velocity=(0.0, 0.0, -speed)))
            solver.watch(round(TIME / setup.time_step), account.see)
            pushed, [now] = solver.impulses()[0, 0, 2] - before, solver.view([0])
            ends.append((float(account.parts[-1].sum()), float(pushed), now.time))
    overlap, (_, pushed, end) = SLOW * ends[0][2] * S / (1 + C ** (5 / 3) + S ** (5 / 3)), ends[2]
    force, work = 4 * law.modulus * math.sqrt(R) * overlap**1.5 * S, 1e6 * ends[5][1] * 0.1
    sphere = (LABELS, "three spheres", "force [N]", "Hertz at three contacts")
    clumps = (LABELS, "16 clumps", "energy stored and lost [uJ]", "work of the cone")
    row = relative_row(clumps, work, 1e6 * (ends[5][0] - ends[4][0]), 0.01)
    return Result("Penetration", TEXT, (relative_row(sphere, force, pushed / (end - ends[1][2]), 1e-4), row))
