"""Builders of small worlds, closed forms of their contacts, and a step-by-step record of their motion.

Every world, except those of some scenes, has two walls, far-off planes where a test needs no wall, and grains
of one sphere or of nine, so that all tests together compile few builds of the kernels.
"""

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from dem_warp.batch import Batch
from dem_warp.case import Case, Numerics
from dem_warp.clumps import ClumpShape
from dem_warp.device import resolve_device
from dem_warp.laws.conventions import EDEM, ContactLaws
from dem_warp.laws.mechanism import Mechanism
from dem_warp.materials import Interaction, Material, rayleigh_time
from dem_warp.model import ContactCoefficients, Grains, WorldSetup
from dem_warp.population import GrainPopulation
from dem_warp.result import CaseResult
from dem_warp.scenes.lifted_cylinder import LiftedCylinder
from dem_warp.scenes.scene import Scene
from dem_warp.solver import Solver
from dem_warp.walls import Cylinder, Plane, Wall

DEVICE = os.environ.get("DEM_WARP_TEST_DEVICE", "cpu")
"""Device that these worlds run on; what is promised of a world's bits holds on every device."""

GRAVITY = 9.81
RADIUS = 5e-3
"""Radius of the single spheres [m]."""

BALL = ClumpShape.sphere(RADIUS)
GRAIN = Material(density=1000.0, shear_modulus=10e6, poisson_ratio=0.25)
STEEL = Material(density=7800.0, shear_modulus=70e9, poisson_ratio=0.3)
TIME_STEP = 0.25 * rayleigh_time(RADIUS, GRAIN)
"""Time step of a ball on a plane [s]."""

HERTZ_DURATION = 0.8 * math.sqrt(math.pi) * math.gamma(0.4) / math.gamma(0.9)
"""Duration of an elastic Hertz impact over (largest overlap / impact speed): 2.9432750."""

_RING = np.array([[math.cos(a), math.sin(a)] for a in np.deg2rad([90.0, 210.0, 330.0])])
PYRAMID = ClumpShape.from_spheres(
    1e-3
    * np.vstack(
        [
            np.column_stack([1.05 * _RING, np.full(3, -1.2)]),
            np.column_stack([0.75 * _RING, np.full(3, -0.1)]),
            [[0.0, 0.0, 1.1], [0.0, 0.0, 2.2], [0.0, 0.0, 3.2]],
        ]
    ),
    1e-3 * np.array([0.85] * 6 + [1.0, 0.8, 0.6]),
)
"""Nine spheres with three feet, like a buckwheat grain of 6 mm."""

BOOT = ClumpShape.from_spheres(
    1e-3 * np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.2, 0.0]]), 1e-3 * np.array([1.0, 0.8, 0.6])
)
"""Three unequal spheres in an L: three different moments of inertia."""

SMALL_TUBE = LiftedCylinder(diameter=0.016, height=0.016, wall_material=STEEL, rain_rate=1500.0)
BOX = ((-0.12, -0.12, -0.12), (0.12, 0.12, 0.12))
_NOWHERE = Plane(point=(0.0, 0.0, -1.0))


def grains(
    positions: ArrayLike,
    *,
    velocities: ArrayLike = 0.0,
    spins: ArrayLike = 0.0,
    orientations: ArrayLike = (0.0, 0.0, 0.0, 1.0),
    sizes: ArrayLike = 1.0,
    shapes: ArrayLike = 0,
    density: float = GRAIN.density,
) -> Grains:
    """Return grains at positions [m]; a value given once holds for all of them."""
    positions = np.atleast_2d(np.asarray(positions, dtype=float))
    n = len(positions)
    return Grains(
        positions=positions,
        orientations=np.broadcast_to(np.asarray(orientations, dtype=float), (n, 4)),
        velocities=np.broadcast_to(np.asarray(velocities, dtype=float), (n, 3)),
        spins=np.broadcast_to(np.asarray(spins, dtype=float), (n, 3)),
        sizes=np.broadcast_to(np.asarray(sizes, dtype=float), (n,)),
        densities=np.full(n, density),
        shapes=np.broadcast_to(np.asarray(shapes, dtype=int), (n,)),
        release_steps=np.zeros(n, dtype=int),
    )


def pair(
    restitution: float = 1.0,
    friction: float = 0.0,
    rolling: float = 0.0,
    clamp: bool = False,
    partner: Material = GRAIN,
    mechanisms: tuple[Mechanism, ...] = (),
    laws: ContactLaws = EDEM,
) -> ContactCoefficients:
    """Return the contact of the grains' material with another, with reduced radius and mass on a wall."""
    interaction = Interaction(restitution, friction, rolling)
    laws = replace(laws, attraction="clamped") if clamp else laws
    return ContactCoefficients.of_pair(GRAIN, partner, interaction, laws, mechanisms, RADIUS, ball_mass())


ALONG = {
    "cdt": {"tangential_history": "force"},
    "relative_constant": {"tangential_history": "rescaled_displacement"},
    "edem_rvd": {"tangential_history": "rescaled_force"},
    "yade": {"friction_load": "size"},
}
"""Choices of laws that tests of a rolling resistance take along, so that both compile one build.

They are tested without rolling resistance; it is tested under a constant load, where they are all alike."""


def along(**choice: str) -> ContactLaws:
    """Return the laws of a choice with the rolling resistance that takes it along."""
    [rolling] = [name for name, taken in ALONG.items() if taken == choice] or ["own_spin"]
    return ContactLaws(rolling=rolling, **choice)


def world(
    bodies: Grains,
    contact: ContactCoefficients,
    time_step: float,
    *,
    walls: Sequence[Wall] = (),
    shapes: tuple[ClumpShape, ...] = (BALL,),
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0),
    skin: float = 2e-3,
    speed_limit: float = 20.0,
    domain: tuple[tuple[float, float, float], tuple[float, float, float]] = BOX,
    weighed: tuple[int, ...] = (0,),
    laws: ContactLaws = EDEM,
) -> WorldSetup:
    """Build a world in which one contact holds for grains and walls alike, with at least two walls."""
    both = (*walls, *[_NOWHERE] * (2 - len(walls)))
    return WorldSetup(
        grains=bodies,
        shapes=shapes,
        contacts=(contact, contact),
        walls=tuple((wall, 1) for wall in both),
        time_step=time_step,
        skin=skin,
        speed_limit=speed_limit,
        domain=domain,
        gravity=gravity,
        weighed=weighed,
        forms=laws.forms,
        rolling_holds=laws.rolling != "own_spin_whole_step",
    )


def downhill(degrees: float) -> tuple[float, float, float]:
    """Return the gravity [m/s2] over a plane z = 0 that falls towards +y by an angle."""
    angle = math.radians(degrees)
    return 0.0, GRAVITY * math.sin(angle), -GRAVITY * math.cos(angle)


def ball_mass() -> float:
    return GRAIN.density * BALL.volume


def settle(
    contact: ContactCoefficients, wall: Wall, place: ArrayLike, down: ArrayLike, time: float = 0.06
) -> np.ndarray:
    """Return the resting place of a ball on a wall that is `down` from it [m]."""
    gravity = tuple(GRAVITY * np.asarray(down, dtype=float))
    solver = solve(world(grains(place), contact, TIME_STEP, walls=(wall,), gravity=gravity))
    run_for(solver, time)
    end = state(solver)
    assert np.abs(end["velocities"]).max() < 1e-9
    return end["positions"][0]


def static_overlap(contact: ContactCoefficients, force: float, radius: float = RADIUS) -> float:
    """Return the overlap [m] at which a Hertz contact carries a force [N]."""
    return float((0.75 * force / (contact.modulus * math.sqrt(radius))) ** (2.0 / 3.0))


def ball_on_plane(
    contact: ContactCoefficients,
    slope: float = 0.0,
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0),
    spin: tuple[float, float, float] = (0.0, 0.0, 0.0),
    laws: ContactLaws = EDEM,
) -> WorldSetup:
    weight = ball_mass() * GRAVITY * math.cos(math.radians(slope))
    place = [0.0, 0.0, RADIUS - static_overlap(contact, weight)]
    bodies = grains(place, velocities=velocity, spins=spin)
    return world(bodies, contact, TIME_STEP, walls=(Plane(),), gravity=downhill(slope), laws=laws)


@dataclass(frozen=True)
class Impact:
    """Elastic Hertz impact: Johnson, Contact Mechanics (1985), section 11.4."""

    overlap: float
    force: float
    duration: float

    @classmethod
    def of(cls, contact: ContactCoefficients, radius: float, mass: float, speed: float) -> "Impact":
        """Return the impact of an effective radius [m] and mass [kg] at a speed [m/s]."""
        overlap = (15.0 * mass * speed**2 / (16.0 * contact.modulus * math.sqrt(radius))) ** 0.4
        force = 4.0 / 3.0 * contact.modulus * math.sqrt(radius) * overlap**1.5
        return cls(overlap, force, HERTZ_DURATION * overlap / speed)


PILE_STEP = 5e-6
PILE_TUBE = Cylinder((0.0, 0.0, 0.0), 0.012, 0.1)


def pile(seed: int = 1, count: int = 36, skin: float = 1e-3) -> WorldSetup:
    """Return nine-sphere grains in layers of a tube, a little above one another, that fall and settle."""
    rng = np.random.default_rng(seed)
    corners = 0.0045 * np.array([[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]])
    number = np.arange(count)
    bodies = grains(
        np.column_stack([corners[number % 4], 0.0045 + 0.0085 * (number // 4)]),
        velocities=np.column_stack([rng.normal(size=(count, 2)) * 0.02, np.full(count, -0.4)]),
        orientations=rng.normal(size=(count, 4)),
        sizes=rng.uniform(0.9, 1.1, count),
    )
    return world(
        bodies,
        pair(restitution=0.3, friction=0.5, rolling=0.05),
        PILE_STEP,
        walls=(Plane(), PILE_TUBE),
        shapes=(PYRAMID,),
        gravity=(0.0, 0.0, -GRAVITY),
        skin=skin,
    )


def oblique_impact(place: ArrayLike = (0.0, 0.0, 0.0)) -> WorldSetup:
    """Return two spinning balls that meet off-centre, with friction, at a place [m], for 100 steps."""
    contact = pair(restitution=0.5, friction=0.3, rolling=0.05)
    bodies = grains(
        np.add(place, [[0.0, 0.0, 0.0], [0.001, 0.002, 2.0 * RADIUS - 2.4e-4]]),
        velocities=[[0.0, 0.0, 0.05], [0.02, 0.0, -0.05]],
        spins=[[1.0, -2.0, 3.0], [0.0, 4.0, 0.0]],
    )
    expected = Impact.of(contact, RADIUS / 2.0, ball_mass() / 2.0, 0.1)
    return world(bodies, contact, expected.duration / 100.0)


@dataclass(frozen=True)
class Record:
    """Motion of all grains, step by step: arrays (steps + 1, grains, 3) in SI units."""

    positions: np.ndarray
    velocities: np.ndarray
    spins: np.ndarray


def record(solver: Solver, steps: int) -> Record:
    """Take steps one at a time and keep every state."""
    shape = (steps + 1, solver.layout.grain_total, 3)
    history = Record(*(np.full(shape, np.nan) for _ in range(3)))

    def keep(row: int, state: Any) -> None:
        history.positions[row] = state.position.numpy()
        history.velocities[row] = state.velocity.numpy()[:, :3]
        history.spins[row] = state.spin.numpy()[:, :3]

    keep(0, solver.grains[0])
    for step in range(steps):
        solver._cycle(1, step % 2)
        keep(step + 1, solver.grains[1 - step % 2])
    return history


def solve(
    *setups: WorldSetup, precision: str = "double", device: str = DEVICE, capacity: int | None = None
) -> Solver:
    """Return the solver of worlds on a device."""
    return Solver(setups, resolve_device(device), precision, capacity)


def run_for(solver: Solver, time: float) -> None:
    """Advance by the least number of chunks that takes every world past a time [s]."""
    least = min(setup.time_step for setup in solver.worlds)
    solver.advance(math.ceil(time / (least * 256)))


def state(solver: Solver, index: int = 0) -> dict[str, np.ndarray]:
    """Return copies of a world's final arrays: slots, poses, velocities and spins of its living grains."""
    return {name: np.array(array) for name, array in solver.poses(index).items()}


def spheres_of(
    shape: ClumpShape, poses: dict[str, np.ndarray], sizes: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return centres (n * S, 3) and radii (n * S,) of grains of one shape [m]."""
    turns = Rotation.from_quat(poses["orientations"]).as_matrix()
    local = shape.centers[None] * sizes[:, None, None]
    centers = poses["positions"][:, None] + np.einsum("nij,nsj->nsi", turns, local)
    return centers.reshape(-1, 3), (shape.radii[None] * sizes[:, None]).ravel()


def assert_same_bits(a: dict[str, np.ndarray], b: dict[str, np.ndarray]) -> None:
    """Require that every array of two states is equal, bit for bit."""
    assert a.keys() == b.keys()
    for name, array in a.items():
        np.testing.assert_array_equal(array, b[name], err_msg=name)


RESULT_ARRAYS = ("positions", "orientations", "sizes", "sphere_centers", "sphere_radii", "sphere_grain")
SPEED_ONLY = {"rebuilds"}
"""Observables of the work, not of the heap."""


def assert_same_result(a: CaseResult, b: CaseResult) -> None:
    """Require that two results are equal in all that the case determines."""
    assert (a.status, a.reason, a.phases) == (b.status, b.reason, b.phases)
    for name in RESULT_ARRAYS:
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name), err_msg=name)
    kept = [
        {name: value for name, value in result.observables.items() if name not in SPEED_ONLY}
        for result in (a, b)
    ]
    assert kept[0] == kept[1]


def finish(batch: Batch) -> dict[int, CaseResult]:
    results = {}
    while batch.running:
        results.update(batch.advance())
    return results


def run_batch(cases: Sequence[Case]) -> dict[int, CaseResult]:
    """Return the results of cases that run in one launch on the CPU."""
    return finish(Batch(cases, resolve_device("cpu")))


def assert_measured_as_declared(case: Case, result: CaseResult, absent: frozenset[str] = frozenset()) -> None:
    """Require every observable that the scene declares, except the absent ones, and no other."""
    declared = set(case.scene.observables)
    assert set(result.observables) == (declared - absent) | {"rebuilds"}
    assert absent <= declared


def ball_case(scene: Scene, friction: float, rolling: float = 0.0, seed: int = 1) -> Case:
    """Return balls of 4 mm in a scene, so soft that a second takes 7,000 steps."""
    surfaces = Interaction(0.5, friction, rolling)
    return Case(
        scene=scene,
        grains=GrainPopulation(ClumpShape.sphere(2e-3), GRAIN),
        grain_grain=surfaces,
        grain_wall=surfaces,
        seed=seed,
        numerics=Numerics(modulus_scale=100.0),
    )


def small_case(seed: int = 1, scene: LiftedCylinder | None = None, **numerics: Any) -> Case:
    """Return a lifted cylinder of about seventy nine-sphere grains: about a second on a core."""
    return Case(
        scene=scene or SMALL_TUBE,
        grains=GrainPopulation(PYRAMID, GRAIN),
        grain_grain=Interaction(0.3, 0.4, 0.05),
        grain_wall=Interaction(0.5, 0.4, 0.05),
        seed=seed,
        numerics=Numerics(**({"modulus_scale": 100.0} | numerics)),
    )
