"""Two spheres that are driven through a contact, under every set of laws, against the law's closed form.

The four pair tests of the ON-DEM action (normal, tangential, rolling, twisting), in our own numbers.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dem_warp import PRESETS, ClumpShape, ContactLaws, Interaction, Material
from dem_warp.model import ContactCoefficients
from experiments.evidence.verification.check import Result, Row, absolute_row
from experiments.evidence.verification.problems.setups import Motion, WatchedSolver, bodies, world

RADIUS, OVERLAP = 5e-3, 5e-6
"""Of each sphere, and of the contact at rest [m]."""
SUBSTANCE = Material(density=1e8, shear_modulus=10e6, poisson_ratio=0.25)
"""So heavy that forces hardly change the given motion."""
FRICTION, ROLLING = 0.4, 0.1
STEP, STEPS = 1e-6, 400
"""Time step [s] and steps of each stretch of a test."""
TOLERANCES = {"normal": 1e-5, "tangential": 2e-3, "rolling": 1e-5, "twisting": 1e-5}
"""Of the largest force or torque: the rounding of the spheres' speeds. As one slides by an overlap, the
normal turns by 1/2000, which adds 1/800 of mu F_n to the force along x."""

TEXT = """Two equal spheres are driven through a contact at given speeds; the force or torque is read from
what it does to them in each step. *Normal*: they approach and part. Hertz's force is 4/3 E* sqrt(R*)
d^(3/2), and sqrt(2) times that under the set that takes the area of the overlap for the contact's.
*Tangential*: one slides to and fro at one overlap, against a spring of 8 G* sqrt(R* d) that slides at mu
F_n. *Rolling*: they spin against each other, so that nothing slides. The torque is mu_r F_n l at a sphere's
own lever, mu_r F_n R*, or a spring with this limit and the stiffness that the set names; none under `edem-
rvd`, which takes the mean of both spins, and under `deme`, which takes the sliding of the spins: both are
zero here. *Twisting*: they spin about the normal. The torque is mu_r F_n l under the set that takes a
sphere's own spin; the others have none. Restitution is 1, and dashpots are off: these are the static loops
of the theory. The impacts of other chapters have the dashpots."""


@dataclass(frozen=True)
class Drive:
    """Motion that is given to the second sphere; the first has the opposite."""

    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    spin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    signs: tuple[float, ...] = (1.0,)
    """Direction of each stretch."""


LENGTH = 0.5 * OVERLAP / (STEP * STEPS)
"""Speed of a sphere that moves half the overlap in a stretch [m/s]."""

DRIVES = {
    "normal": Drive(velocity=(0.0, 0.0, -LENGTH), signs=(1.0, -1.0)),
    "tangential": Drive(velocity=(LENGTH, 0.0, 0.0), signs=(1.0, -1.0, -1.0, 1.0)),
    "rolling": Drive(spin=(0.0, LENGTH / RADIUS, 0.0), signs=(1.0, -1.0, -1.0, 1.0)),
    "twisting": Drive(spin=(0.0, 0.0, LENGTH / RADIUS), signs=(1.0, -1.0)),
}
"""Each test: spheres above each other along z."""


def driven(laws: ContactLaws, test: str, device: str) -> tuple[np.ndarray, np.ndarray]:
    """Return force [N] and torque [N m] on the second sphere in each step, (steps, 3) each."""
    surface = Interaction(1.0, FRICTION, ROLLING)
    law = ContactCoefficients.of_pair(SUBSTANCE, SUBSTANCE, surface, laws, radius=0.5 * RADIUS)
    law = replace(law, damping=0.0)  # the polynomial of LAMMPS makes 3e-4 of a restitution of 1
    drive, gap = DRIVES[test], 0.0 if test == "normal" else OVERLAP
    places = [[0.0, 0.0, 0.0], [0.0, 0.0, 2.0 * RADIUS - gap]]
    setup = world(bodies(places, SUBSTANCE.density), ClumpShape.sphere(RADIUS), law, STEP, extent=0.1)
    solver = WatchedSolver([replace(setup, forms=laws.forms)], device, "double")
    rates: list[tuple[np.ndarray, np.ndarray]] = []
    given = [(sign * np.array(drive.velocity), sign * np.array(drive.spin)) for sign in drive.signs]
    motions = [motion for motion in given for _ in range(STEPS)]
    give(solver.grains[0], *motions[0])

    def see(state: Any) -> None:
        if len(rates) == len(motions):  # steps that end a cycle
            return
        now, (velocity, spin) = Motion.of(state, 2), motions[len(rates)]
        rates.append((now.velocities[1] - velocity, now.spins[1] - spin))
        give(state, *motions[min(len(rates), len(motions) - 1)])

    solver.watch(len(motions), see)
    mass = SUBSTANCE.density * 4.0 / 3.0 * np.pi * RADIUS**3
    changes = np.array(rates) / STEP
    return mass * changes[:, 0], 0.4 * mass * RADIUS**2 * changes[:, 1]


def give(state: Any, velocity: np.ndarray, spin: np.ndarray) -> None:
    """Set the motion of both spheres."""
    for array, value in ((state.velocity, velocity), (state.spin, spin)):
        kept = array.numpy()
        kept[:, :3] = [-value, value]
        array.assign(kept)


def spring(paths: np.ndarray, stiffness: float, limit: float) -> np.ndarray:
    """Return the force of a spring that slides at a limit, after each part of a path."""
    force, found = 0.0, []
    for part in paths:
        force = float(np.clip(force - stiffness * part, -limit, limit))
        found.append(force)
    return np.array(found)


def rolling_form(laws: ContactLaws, load: float, tangential: float) -> tuple[float, float]:
    """Return stiffness [N m/rad] and limit [N m] of the torque between spheres that roll on each other.

    An infinite stiffness is that of a constant torque. Sources: `docs/laws.md`.
    """
    reduced, lever = 0.5 * RADIUS, RADIUS - 0.5 * OVERLAP
    limit, normal = ROLLING * reduced * load, 1.5 * load / OVERLAP
    fixed = 8.0 * effective()[1] * np.sqrt(0.01 * reduced * RADIUS)  # at 1 % of the largest spheres' radius
    forms: dict[str, tuple[float, float]] = {
        "own_spin": (np.inf, ROLLING * load * lever),
        "cdt": (np.inf, limit),
        "elastic_plastic": (laws.rolling_stiffness * normal * (ROLLING * reduced) ** 2, limit),
        "epsd2": (tangential * reduced**2, limit),
        "sds": (fixed * reduced**2, limit),
        "yade": (fixed * reduced**2, limit),
        "rocky_3": (tangential * (0.5 * lever) ** 2, ROLLING * 0.5 * lever * load),
    }
    return forms.get(laws.rolling, (np.inf, 0.0))


def effective() -> tuple[float, float]:
    """Return E* and G* of two bodies of the substance [Pa]."""
    nu, shear = SUBSTANCE.poisson_ratio, SUBSTANCE.shear_modulus
    return shear / (1.0 - nu), 0.5 * shear / (2.0 - nu)


def expected(test: str, laws: ContactLaws) -> tuple[np.ndarray, float]:
    """Return the closed form of the force or torque in each step, and its largest size."""
    wider = np.sqrt(2.0) if laws.normal == "overlap_circle" else 1.0
    modulus, shear = (wider * each for each in effective())
    reduced, drive = 0.5 * RADIUS, DRIVES[test]
    load = 4.0 / 3.0 * modulus * np.sqrt(reduced) * OVERLAP**1.5
    tangential = 8.0 * shear * np.sqrt(reduced * OVERLAP)
    signs = np.repeat(drive.signs, STEPS)
    paths = 2.0 * STEP * signs * (LENGTH if test != "rolling" else LENGTH / RADIUS)
    if test == "normal":
        depth = np.concatenate([[0.0], np.cumsum(paths)[:-1]])
        return load * (depth / OVERLAP) ** 1.5, load
    if test == "tangential":
        return spring(paths, tangential, FRICTION * load), FRICTION * load
    stiffness, limit = rolling_form(laws, load, tangential)
    if test == "twisting":
        limit = limit if laws.rolling == "own_spin" else 0.0
        return -limit * signs, ROLLING * reduced * load
    found = -limit * signs if np.isinf(stiffness) else spring(paths, stiffness, limit)
    return found, ROLLING * reduced * load


READ: dict[str, Callable[[np.ndarray, np.ndarray], np.ndarray]] = {
    "normal": lambda force, torque: force[:, 2],
    "tangential": lambda force, torque: force[:, 0],
    "rolling": lambda force, torque: torque[:, 1],
    "twisting": lambda force, torque: torque[:, 2],
}


def pair_rows(name: str, device: str) -> list[Row]:
    """Rows of the four tests under a set of laws."""
    laws = replace(PRESETS[name], rolling_damping=0.0, rolling_dashpot=0.0)
    rows = []
    for test, read in READ.items():
        want, size = expected(test, laws)
        got = read(*driven(laws, test, device))
        labels = ("Driven pair", f"{name}, {test}", "over the largest, any step", "closed form of the set")
        rows.append(absolute_row(labels, want / size, got / size, TOLERANCES[test]))
    return rows


def pair_laws(device: str) -> Result:
    """Every set of laws in the four pair tests."""
    return Result("Driven pairs", TEXT, tuple(row for name in PRESETS for row in pair_rows(name, device)))
