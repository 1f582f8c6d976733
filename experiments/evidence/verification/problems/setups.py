"""Builders of small worlds, and a step-by-step record of their motion."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from dem_warp import EDEM, ClumpShape, ContactLaws, Interaction, Material, Mechanism
from dem_warp.model import GRAVITY, ContactCoefficients, Grains, WorldSetup
from dem_warp.solver import Solver
from dem_warp.walls import Plane, Wall

PRECISIONS = {"double": "float64", "mixed": "production precision"}
"""Those of a solver, in words."""

WALLS = 2
"""Walls of every world, far-off planes where a problem needs none: so that worlds share compiled kernels."""


def material(youngs_modulus: float, poisson_ratio: float, density: float) -> Material:
    """Material from Young's modulus [Pa], Poisson's ratio and density [kg/m3]."""
    return Material(density, youngs_modulus / (2.0 * (1.0 + poisson_ratio)), poisson_ratio)


RIGID = material(1e30, 0.3, 1.0)
"""A partner so stiff that the effective moduli are those of the other body."""


CLUMP = Path(__file__).parents[3] / "studies" / "buckwheat" / "clump.txt"
"""The reference grain of the buckwheat study, nine spheres; it stands on three of them."""

BUCKWHEAT = Material(density=698.0, shear_modulus=34.325e6, poisson_ratio=0.29)
STEEL = Material(density=7800.0, shear_modulus=70e9, poisson_ratio=0.30)


def contact(
    a: Material, b: Material, restitution: float = 1.0, friction: float = 0.0, rolling: float = 0.0,
    laws: ContactLaws = EDEM, mechanisms: tuple[Mechanism, ...] = (),
) -> ContactCoefficients:  # fmt: skip
    """Contact of two materials."""
    return ContactCoefficients.of_pair(a, b, Interaction(restitution, friction, rolling), laws, mechanisms)


def bodies(
    positions: ArrayLike,
    densities: ArrayLike,
    *,
    velocities: ArrayLike = 0.0,
    spins: ArrayLike = 0.0,
    orientations: ArrayLike = (0.0, 0.0, 0.0, 1.0),
    sizes: ArrayLike = 1.0,
) -> Grains:
    """Grains of one shape at positions [m], (n, 3); what is given once holds for all of them."""
    places = np.atleast_2d(np.asarray(positions, dtype=float))
    n = len(places)

    def each(values: ArrayLike, *shape: int) -> np.ndarray:
        return np.broadcast_to(np.asarray(values, dtype=float), (n, *shape))

    return Grains(
        positions=places,
        orientations=each(orientations, 4),
        velocities=each(velocities, 3),
        spins=each(spins, 3),
        sizes=each(sizes),
        densities=each(densities),
        shapes=np.zeros(n, dtype=int),
        release_steps=np.zeros(n, dtype=int),
    )


def world(
    grains: Grains,
    shape: ClumpShape,
    law: ContactCoefficients,
    time_step: float,
    *,
    walls: Sequence[Wall] = (),
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0),
    extent: float | None = None,
) -> WorldSetup:
    """Return a world in which one contact law holds for grains and walls alike.

    `extent` [m] is half the side of its domain, by default 40 times a grain's reach. Speeds up to a hundred
    times the fastest at the start, and 10 m/s, are no divergence.
    """
    reach = shape.bounding_radius * float(grains.sizes.max())
    half = extent or 40.0 * reach
    nowhere = Plane(point=(0.0, 0.0, -2.0 * half))
    speed = float(np.linalg.norm(grains.velocities, axis=1).max() + np.linalg.norm(grains.spins) * reach)
    return WorldSetup(
        grains=grains,
        shapes=(shape,),
        contacts=(law, law),
        walls=tuple((wall, 1) for wall in (*walls, *[nowhere] * (WALLS - len(walls)))),
        time_step=time_step,
        skin=reach,
        speed_limit=max(100.0 * speed, 10.0),
        domain=((-half,) * 3, (half,) * 3),
        gravity=gravity,
    )


def downhill(degrees: float) -> tuple[float, float, float]:
    """Gravity [m/s2] over a plane z = 0 that falls towards +x by an angle."""
    angle = np.radians(degrees)
    return float(GRAVITY * np.sin(angle)), 0.0, float(-GRAVITY * np.cos(angle))


@dataclass(frozen=True)
class Motion:
    """State after each step, the first before any: arrays (steps + 1, worlds, grains, 3 or 4) in SI units.

    One state has no axis of steps, that of a single world none of worlds.
    """

    positions: np.ndarray
    orientations: np.ndarray
    velocities: np.ndarray
    spins: np.ndarray

    @classmethod
    def of(cls, state: Any, *count: int) -> "Motion":
        """Copy of a solver's state of worlds and grains, or of grains."""
        return cls(
            state.position.numpy().reshape(*count, 3).copy(),
            state.orientation.numpy().reshape(*count, 4).copy(),
            state.velocity.numpy().reshape(*count, 4)[..., :3].astype(float),
            state.spin.numpy().reshape(*count, 4)[..., :3].astype(float),
        )


class WatchedSolver(Solver):
    """A solver that shows its state after every step, at the price of running them one by one."""

    _see: Callable[[Any], None] | None = None

    def _step(self, read: int) -> None:
        super()._step(read)
        if self._see:
            self._see(self.grains[1 - read])

    def watch(self, steps: int, see: Callable[[Any], None]) -> None:
        """Take `steps` steps, or a few more to end a cycle, and hand the state after each to `see`."""
        self._see = see
        taken = 0
        while taken < steps:
            cycle = self._cycle_length(1)
            self._cycle(cycle)
            taken += cycle
        self._see = None


def record(worlds: Sequence[WorldSetup], steps: int, device: str, precision: str = "double") -> Motion:
    """Motion of worlds with the same number of grains, step by step."""
    solver = WatchedSolver(worlds, device, precision)
    count = (solver.layout.world_count, solver.layout.grain_count)
    states: list[Motion] = []

    def see(state: Any) -> None:
        states.append(Motion.of(state, *count))

    see(solver.grains[0])
    solver.watch(steps, see)
    return Motion(*(np.stack([getattr(s, name) for s in states]) for name in Motion.__dataclass_fields__))
