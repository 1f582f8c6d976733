"""Two spheres, and a sphere on a plate, through contacts that a code can follow step by step.

Every path starts in mid-air or at rest on the plate, so that neither code knows of an earlier contact.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from dem_warp import ClumpShape, ContactLaws, Interaction, Material, rayleigh_time
from dem_warp.model import ContactCoefficients, WorldSetup
from dem_warp.walls import Plane
from experiments.evidence.verification.check import Curve, Plot, Result, Row
from experiments.evidence.verification.problems.setups import GRAVITY, STEEL, bodies, record, world
from experiments.export import Contact

RADII = (1.5e-3, 1.0e-3)
"""Radii of the two spheres [m]; the first rolls on the plate."""
GRAIN = Material(density=1200.0, shear_modulus=4.0e6, poisson_ratio=0.25)
SURFACE = Interaction(restitution=0.6, static_friction=0.4, rolling_friction=0.1)

FRACTION = 0.01
"""Time step over the Rayleigh time: the schemes of integration differ by its square."""
TOLERANCE = 1e-3
"""Largest difference of two trajectories over their size."""
SAMPLES = 200
"""States that are compared."""


@dataclass(frozen=True)
class ContactPath:
    """A start, and what follows from it."""

    name: str
    speeds: tuple[tuple[float, float, float], ...]
    """Velocities [m/s] of both spheres, or of one that meets the plate."""
    spins: tuple[tuple[float, float, float], ...]
    """[rad/s]"""
    duration: float
    """Time step [s]."""
    rests: bool = False
    """Starts at rest on the plate under gravity, at the overlap that bears its weight."""

    @property
    def has_plate(self) -> bool:
        """True for one sphere and a plate."""
        return len(self.speeds) == 1


PATHS = (
    ContactPath("pair, normal", ((0.0, 0.0, 0.15), (0.0, 0.0, -0.15)), ((0.0,) * 3,) * 2, 1.5e-3),
    ContactPath("pair, oblique", ((0.1, 0.05, 0.15), (-0.1, 0.0, -0.15)), ((0.0,) * 3,) * 2, 1.5e-3),
    ContactPath(
        "pair, rolling", ((0.0, 0.0, 0.15), (0.0, 0.0, -0.15)), ((40.0, 0.0, 0.0), (-60.0, 0.0, 0.0)), 1.5e-3
    ),
    ContactPath(
        "pair, twisting", ((0.0, 0.0, 0.15), (0.0, 0.0, -0.15)), ((0.0, 0.0, 50.0), (0.0, 0.0, -20.0)), 1.5e-3
    ),
    ContactPath("plate, normal", ((0.0, 0.0, -0.2),), ((0.0,) * 3,), 1.5e-3),
    ContactPath("plate, oblique", ((0.3, 0.0, -0.2),), ((0.0, -30.0, 10.0),), 1.5e-3),
    ContactPath("plate, rolling", ((0.06, 0.0, 0.0),), ((0.0, 40.0, 0.0),), 3.0e-2, rests=True),
    ContactPath("plate, twisting", ((0.0, 0.0, 0.0),), ((0.0, 0.0, 40.0),), 5.0e-3, rests=True),
)
"""Every path that a code is verified on."""

DRAWN = {"pair, oblique": 0, "plate, rolling": 1}
"""Paths that are drawn, by the component that is: velocity along the contact, or spin across it."""


@dataclass(frozen=True, eq=False)
class Trajectory:
    """States of one path: arrays (SAMPLES + 1, spheres, 3) in SI units."""

    positions: np.ndarray
    velocities: np.ndarray
    spins: np.ndarray


@dataclass(frozen=True)
class PathSetup:
    """A path under some laws, with all that another code needs."""

    path: ContactPath
    laws: ContactLaws
    grain: Material = GRAIN
    pair: tuple[float, float] = RADII
    """Radii of two spheres [m]; one alone on the plate has the first."""
    start: np.ndarray | None = None
    """Centres at the start [m], (spheres, 3), where a code rounds them; None: as the path says."""

    @property
    def time_step(self) -> float:
        """Time step [s]."""
        return FRACTION * rayleigh_time(min(self.pair), self.grain)

    @property
    def stride(self) -> int:
        """Steps between two states that are compared."""
        return max(round(self.path.duration / SAMPLES / self.time_step), 1)

    @property
    def radii(self) -> tuple[float, ...]:
        """Radii of its spheres [m]."""
        return self.pair[: len(self.path.speeds)]

    @property
    def masses(self) -> tuple[float, ...]:
        """Masses of its spheres [kg]."""
        return tuple(self.grain.density * 4.0 / 3.0 * np.pi * radius**3 for radius in self.radii)

    @property
    def contact(self) -> Contact:
        """The contact, as exporters translate it."""
        if self.path.has_plate:
            partner, radius, mass = STEEL, self.pair[0], self.masses[0]
        else:
            partner = self.grain
            radius = self.pair[0] * self.pair[1] / sum(self.pair)
            mass = self.masses[0] * self.masses[1] / sum(self.masses)
        law = ContactCoefficients.of_pair(self.grain, partner, SURFACE, self.laws, (), radius, mass)
        return Contact(self.grain, partner, SURFACE, law, radius, mass, self.laws.normal_damping)

    @property
    def gravity(self) -> float:
        """Downwards [m/s2]."""
        return GRAVITY if self.path.rests else 0.0

    @property
    def positions(self) -> np.ndarray:
        """Centres at the start [m], (spheres, 3)."""
        if self.start is not None:
            return self.start
        if not self.path.has_plate:
            half = (sum(self.pair) + 1e-6) / 2.0
            return np.array([[0.0, 0.0, -half], [0.0, 0.0, half]])
        if not self.path.rests:
            return np.array([[0.0, 0.0, self.pair[0] + 1e-6]])
        law = self.contact.coefficients
        load = self.masses[0] * GRAVITY / (4.0 / 3.0 * law.modulus * np.sqrt(self.pair[0]))
        return np.array([[0.0, 0.0, self.pair[0] - load ** (2.0 / 3.0)]])

    def ours(self, device: str) -> Trajectory:
        """Trajectory of dem-warp, in float64."""
        steps = SAMPLES * self.stride
        motion = record([self._world()], steps + 1, device)
        velocities, spins = (
            # they stand half a step before the places: the mean over two steps belongs to them
            np.concatenate([array[:1], 0.5 * (array[1:-1] + array[2:])])
            for array in (motion.velocities[: steps + 2], motion.spins[: steps + 2])
        )
        each = slice(0, steps + 1, self.stride)
        return Trajectory(motion.positions[each, 0], velocities[each, 0], spins[each, 0])

    def _world(self) -> WorldSetup:
        path = self.path
        # sizes scale one shape; the density makes up for nothing: mass goes as the cube
        grains = bodies(
            self.positions,
            self.grain.density,
            velocities=path.speeds,
            spins=path.spins,
            sizes=np.array(self.radii) / self.pair[0],
        )
        walls = (Plane(),) if path.has_plate else ()
        made = world(
            grains,
            ClumpShape.sphere(self.pair[0]),
            self.contact.coefficients,
            self.time_step,
            walls=walls,
            gravity=(0.0, 0.0, -self.gravity),
            extent=0.1,
        )
        return replace(made, forms=self.laws.forms)


def every_path(laws: ContactLaws) -> list[PathSetup]:
    """Set up every path under some laws."""
    return [PathSetup(path, laws) for path in PATHS]


Follow = Callable[[PathSetup, Path], Trajectory]
"""Runs a path in another code, with its files in a folder."""


def difference(setup: PathSetup, ours: Trajectory, theirs: Trajectory) -> dict[str, float]:
    """Largest difference of places, velocities and spins, each over the size of the trajectory.

    The size in velocities is the fastest motion of a centre, or of a surface about it; that in spins the same
    over the radius, that in places the way that it makes in the whole time, or the way made if it is longer.
    """
    radius = max(setup.radii)
    speed = max(_longest(ours.velocities), radius * _longest(ours.spins))
    way = _longest(ours.positions - ours.positions[0])
    pairs = {
        "places": (ours.positions, theirs.positions, max(way, speed * setup.path.duration)),
        "velocities": (ours.velocities, theirs.velocities, speed),
        "spins": (ours.spins, theirs.spins, speed / radius),
    }
    return {name: _longest(own - other) / size for name, (own, other, size) in pairs.items()}


def _longest(vectors: np.ndarray) -> float:
    return float(np.linalg.norm(vectors, axis=-1).max())


def compare_paths(
    code: str,
    setups: Iterable[PathSetup],
    follow: Follow,
    folder: Path,
    device: str,
    explained: Sequence[str] = (),
) -> tuple[list[Row], list[Plot]]:
    """Follow paths in both codes; one whose difference is `explained` is only stated."""
    rows, plots = [], []
    for setup in setups:
        path, laws = setup.path, setup.laws
        place = folder / path.name.replace(", ", "-")
        place.mkdir(parents=True, exist_ok=True)
        ours, theirs = setup.ours(device), follow(setup, place)
        tolerance = None if path.name in explained else TOLERANCE
        for quantity, error in difference(setup, ours, theirs).items():
            labels = (laws.name, path.name, f"{quantity}, difference over size", code)
            rows.append(Row(*labels, 0.0, error, error, tolerance, relative=False))
        if path.name in DRAWN:
            plots.append(_plot(code, laws, setup, ours, theirs))
    return rows, plots


def _plot(code: str, laws: ContactLaws, setup: PathSetup, ours: Trajectory, theirs: Trajectory) -> Plot:
    """Draw the component that the path is about, of the first sphere."""
    times = 1e3 * setup.stride * setup.time_step * np.arange(SAMPLES + 1)
    if setup.path.name == "plate, rolling":
        what, own, other = "spin about the axis it rolls on [rad/s]", ours.spins, theirs.spins
    else:
        what, own, other = "velocity along the contact [m/s]", ours.velocities, theirs.velocities
    axis = DRAWN[setup.path.name]
    name = f"{laws.name}-{setup.path.name.replace(', ', '-')}"
    curves = (
        Curve("dem-warp", times, own[:, 0, axis]),
        Curve(code, times, other[:, 0, axis], "dashed"),
    )
    return Plot(name, f"{code}, {laws.name}: {setup.path.name}", "time [ms]", what, curves)


def result_of(code: str, text: str, parts: Sequence[tuple[list[Row], list[Plot]]]) -> Result:
    """Gather the comparisons of a code under several laws."""
    rows = tuple(row for part, _ in parts for row in part)
    return Result(f"Contacts in {code}", text, rows, tuple(plot for _, plots in parts for plot in plots))
