"""Two spheres that are driven through a contact, under every set of laws, against the law's closed form.

The four pair tests of the ON-DEM action (normal, tangential, rolling, twisting), in our own numbers.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from dem_warp import PRESETS, ClumpShape, ContactLaws, Interaction, Material
from dem_warp.model import ContactCoefficients
from experiments.evidence.verification.check import Result, Row, absolute_row
from experiments.evidence.verification.problems.setups import Motion, WatchedSolver, bodies, world

RADIUS, OVERLAP = 5e-3, 5e-6
"""Radius of a sphere, and overlap of the contact [m]."""
SUBSTANCE = Material(density=1e8, shear_modulus=10e6, poisson_ratio=0.25)
"""Substance so heavy that forces hardly change the given motion."""
FRICTION, ROLLING = 0.4, 0.1
STEP, STEPS = 1e-6, 400
"""Time step [s] and steps of each stretch of a test."""
TOLERANCES = {"normal": 1e-5, "tangential": 2e-3, "rolling": 1e-5, "twisting": 1e-5}
"""Errors over the largest force or torque: the rounding of the spheres' speeds. As one slides by an overlap,
the normal turns by 1/2000, which adds 1/800 of mu F_n to the force along x."""

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


LENGTH = 0.5 * OVERLAP / (STEP * STEPS)
"""Speed of a sphere that moves half the overlap in a stretch [m/s]."""

TESTS = {
    "normal": (0, 2, -LENGTH, (1.0, -1.0)),
    "tangential": (0, 0, LENGTH, (1.0, -1.0, -1.0, 1.0)),
    "rolling": (1, 1, LENGTH / RADIUS, (1.0, -1.0, -1.0, 1.0)),
    "twisting": (1, 2, LENGTH / RADIUS, (1.0, -1.0)),
}
"""Tests: force (0) or torque (1), and its axis; speed [m/s] or spin [rad/s] along it of the upper sphere,
whose opposite the other has; directions of the stretches."""


def driven(laws: ContactLaws, test: str, device: str) -> np.ndarray:
    """Return the force [N] or torque [N m] on the second sphere in each step, (steps,)."""
    surface = Interaction(1.0, FRICTION, ROLLING)
    law = ContactCoefficients.of_pair(SUBSTANCE, SUBSTANCE, surface, laws, radius=0.5 * RADIUS)
    law = replace(law, damping=0.0)  # the polynomial of LAMMPS makes 3e-4 of a restitution of 1
    kind, axis, speed, signs = TESTS[test]
    places = [[0.0, 0.0, 0.0], [0.0, 0.0, 2.0 * RADIUS - (0.0 if test == "normal" else OVERLAP)]]
    setup = world(bodies(places, SUBSTANCE.density), ClumpShape.sphere(RADIUS), law, STEP, extent=0.1)
    solver = WatchedSolver([replace(setup, forms=laws.forms)], device, "double")
    motions = speed * np.repeat(signs, STEPS)
    changes: list[float] = []

    def give(state: Any, rate: float) -> None:
        for number, array in enumerate((state.velocity, state.spin)):
            kept = array.numpy()
            kept[:, :3] = 0.0
            kept[:, axis] = np.array([-rate, rate]) * (number == kind)
            array.assign(kept)

    def see(state: Any) -> None:
        if len(changes) < len(motions):  # further steps end a cycle
            now = Motion.of(state, 2)
            changes.append((now.velocities, now.spins)[kind][1, axis] - motions[len(changes)])
            give(state, motions[min(len(changes), len(motions) - 1)])

    give(solver.grains[0], motions[0])
    solver.watch(len(motions), see)
    mass = SUBSTANCE.density * 4.0 / 3.0 * np.pi * RADIUS**3
    return np.array(changes) / STEP * (mass, 0.4 * mass * RADIUS**2)[kind]


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
    reduced = 0.5 * RADIUS
    load = 4.0 / 3.0 * modulus * np.sqrt(reduced) * OVERLAP**1.5
    tangential = 8.0 * shear * np.sqrt(reduced * OVERLAP)
    signs = np.repeat(TESTS[test][3], STEPS)
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


def pair_rows(name: str, device: str) -> list[Row]:
    """Rows of the four tests under a set of laws."""
    laws = replace(PRESETS[name], rolling_damping=0.0, rolling_dashpot=0.0)
    rows = []
    for test in TESTS:
        want, size = expected(test, laws)
        got = driven(laws, test, device)
        labels = ("Driven pair", f"{name}, {test}", "over the largest, any step", "closed form of the set")
        rows.append(absolute_row(labels, want / size, got / size, TOLERANCES[test]))
    return rows


def pair_laws(device: str) -> Result:
    """Every set of laws in the four pair tests."""
    return Result("Driven pairs", TEXT, tuple(row for name in PRESETS for row in pair_rows(name, device)))
