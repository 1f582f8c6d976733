"""Free rigid grains: Poinsot's invariants and Euler's equations; momentum of clumps that collide."""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from dem_warp import ClumpShape
from dem_warp.model import WorldSetup
from dem_warp.solver import CHUNK, Solver
from experiments.evidence.verification.check import (
    Curve,
    Plot,
    Result,
    Row,
    absolute_row,
    detection_row,
    order_row,
)
from experiments.evidence.verification.problems.setups import (
    BUCKWHEAT,
    CLUMP,
    PRECISIONS,
    bodies,
    contact,
    world,
)

BOOT = ClumpShape.from_spheres(
    1e-3 * np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.2, 0.0]]), 1e-3 * np.array([1.0, 0.8, 0.6])
)
"""Three unequal spheres in an L: three different moments of inertia."""

SPIN = np.array([3.0, 40.0, 5.0])
"""Near the middle axis, where a free body tumbles [rad/s]."""

STEP = 1e-5
CHUNKS = 391
"""1e5 steps: six turns."""

COARSER = (16, 8, 4, 2)
"""Lengths of a step over `STEP`, for the order of convergence."""

POINSOT = "Poinsot: constant for a free body"
EULER = "Euler's equations, integrated to 1e-12"

TEXT = """A free body with three different moments tumbles about its middle axis, 1e5 steps or six turns. The
integrator carries the angular momentum and turns the body about the spin half a step on: momentum is kept to
rounding and energy to second order. In the production precision (spins in float32) the drifts are those of
rounding, stated below. Clumps that collide with friction and damping keep linear and angular momentum to
rounding."""


def tumbling(time_step: float) -> WorldSetup:
    """Follow a free boot that turns about its unstable axis."""
    grains = bodies([0.0, 0.0, 0.0], BUCKWHEAT.density, spins=SPIN)
    return world(grains, BOOT, contact(BUCKWHEAT, BUCKWHEAT), time_step)


def spin_momenta(setup: WorldSetup, poses: dict[str, np.ndarray]) -> np.ndarray:
    """Angular momentum of each grain about its own centre [kg m2/s], (n, 3)."""
    turns = Rotation.from_quat(poses["orientations"])
    inertias = setup.inertias[poses["slots"]]
    return turns.apply(inertias * turns.inv().apply(poses["spins"]))


def euler_spins(moments: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Body-frame spins [rad/s], (n, 3), of the boot at times [s]."""

    def rates(_: float, spin: np.ndarray) -> np.ndarray:
        return np.cross(moments * spin, spin) / moments

    span = (0.0, float(times[-1]))
    return solve_ivp(rates, span, SPIN, "DOP853", t_eval=times, rtol=1e-12, atol=1e-12).y.T


def _tumble(time_step: float, chunks: int, precision: str, device: str) -> tuple[np.ndarray, ...]:
    """Return times [s], body-frame spins, drifts of momentum and of energy, after each 1/16 of the way."""
    setup = tumbling(time_step)
    solver = Solver([setup], device, precision)
    times, spins, momenta, energies = [0.0], [SPIN], [], []
    stops = np.unique(np.linspace(0, chunks, 17).astype(int))
    for chunks_more in (0, *np.diff(stops)):
        solver.advance(int(chunks_more))
        pose = solver.poses(0)
        if chunks_more:
            times.append(times[-1] + chunks_more * CHUNK * time_step)
            spins.append(Rotation.from_quat(pose["orientations"][0]).inv().apply(pose["spins"][0]))
        momenta.append(spin_momenta(setup, pose)[0])
        energies.append(0.5 * float(momenta[-1] @ pose["spins"][0]))
    size = np.linalg.norm(momenta[0])
    drift = np.linalg.norm(np.array(momenta) - momenta[0], axis=1) / size
    return np.array(times), np.array(spins), drift, np.abs(np.array(energies) / energies[0] - 1.0)


def _top(device: str) -> tuple[list[Row], Plot]:
    problem = "Free asymmetric top"
    moments = tumbling(STEP).inertias[0]
    rows = []
    curves: list[Curve] = []
    for precision, name in PRECISIONS.items():
        times, spins, momentum, energy = _tumble(STEP, CHUNKS, precision, device)
        case = f"1e5 steps of 10 us, {name}"
        tolerance = 1e-6 if precision == "double" else None
        want = euler_spins(moments, times)
        error = np.linalg.norm(spins - want, axis=1).max() / np.linalg.norm(SPIN)
        compared = (
            ("drift of angular momentum, relative", POINSOT, momentum.max(), tolerance),
            ("drift of energy, relative", POINSOT, energy.max(), tolerance),
            ("spin in the body, over its size", EULER, error, 1e-5 if tolerance else None),
        )
        rows += [
            absolute_row((problem, case, what, law), 0.0, gap, most) for what, law, gap, most in compared
        ]
        if precision == "double":
            fine = np.linspace(0.0, times[-1], 800)
            path = euler_spins(moments, fine)
            for k, axis in enumerate("xyz"):
                curves.append(Curve(f"{axis}, Euler", fine, path[:, k], colour=k))
                curves.append(Curve(f"{axis}, simulated", times, spins[:, k], "points", colour=k))
    return rows, Plot("free-top", problem, "time [s]", "spin in the body's frame [rad/s]", tuple(curves))


def _orders(device: str) -> list[Row]:
    """Return the same 0.66 s in steps of different lengths."""
    moments = tumbling(STEP).inertias[0]
    errors = []
    for coarser in COARSER:
        times, spins, _, energy = _tumble(coarser * STEP, 256 // coarser, "double", device)
        want = euler_spins(moments, times)
        errors.append((energy.max(), np.linalg.norm(spins - want, axis=1).max()))
    labels = ("Free asymmetric top", "float64")
    return [
        order_row(*labels, f"order of the {name}", 1.0 / np.array(COARSER), np.array(errors)[:, k], 2.0, 1.9)
        for k, name in enumerate(("energy drift", "spin in the body"))
    ]


def _collision_rows(device: str) -> list[Row]:
    """Eight clumps that fly together, with friction and damping."""
    rng = np.random.default_rng(4)
    sides = (-1.0, 1.0)
    places = 4.5e-3 * np.array([[x, y, z] for x in sides for y in sides for z in sides])
    shape = ClumpShape.read(CLUMP)
    grains = bodies(
        places,
        BUCKWHEAT.density,
        velocities=-60.0 * places,
        spins=rng.normal(size=(8, 3)) * 20.0,
        orientations=rng.normal(size=(8, 4)),
    )
    setup = world(grains, shape, contact(BUCKWHEAT, BUCKWHEAT, 0.4, 0.5), 2e-6)
    rows = []
    for precision, name in PRECISIONS.items():
        solver = Solver([setup], device, precision)
        before = _momenta(setup, solver)
        solver.advance(50)
        after = _momenta(setup, solver)
        size = setup.masses[0] * float(np.linalg.norm(grains.velocities[0]))
        sizes = (size, size * float(np.linalg.norm(places[0])))
        case = f"8 buckwheat grains, 12,800 steps, {name}"
        tolerance = 1e-12 if precision == "double" else None
        for k, quantity in enumerate(("momentum", "angular momentum")):
            change = float(np.abs(after[k] - before[k]).max()) / sizes[k]
            labels = ("Clumps collide", case, f"change of {quantity} over that of a grain", "conservation")
            rows.append(absolute_row(labels, 0.0, change, tolerance))
        share = 1.0 - after[2] / before[2]
        quantity = "share of the energy lost (they did collide)"
        rows.append(detection_row("Clumps collide", case, quantity, 0.2, share))
    return rows


def _momenta(setup: WorldSetup, solver: Solver) -> tuple[np.ndarray, np.ndarray, float]:
    """Momentum, angular momentum about the origin, and kinetic energy of a world."""
    pose = solver.poses(0)
    linear = setup.masses[:, None] * pose["velocities"].astype(float)
    own = spin_momenta(setup, pose)
    turning = np.cross(pose["positions"], linear) + own
    energy = 0.5 * float(np.sum(linear * pose["velocities"]) + np.sum(own * pose["spins"]))
    return linear.sum(axis=0), turning.sum(axis=0), energy


def rigid_body(device: str) -> Result:
    """Poinsot's invariants, Euler's equations, and momentum in collisions."""
    rows, plot = _top(device)
    return Result("Rigid bodies", TEXT, (*rows, *_orders(device), *_collision_rows(device)), (plot,))
