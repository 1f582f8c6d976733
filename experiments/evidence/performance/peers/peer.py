"""Common part of all comparisons with another code: its plan, its program, its result."""

import os
import shutil
import subprocess
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dem_warp import Case, LiftedCylinder
from experiments.evidence.performance.columns import Moment
from experiments.evidence.performance.contact_counts import ContactCounts, count_contacts, placed_centers
from experiments.evidence.performance.timing import Timing

MARGIN = 0.01
"""Between the column and the sides of a peer's box [m]."""


@dataclass(frozen=True)
class Plan:
    """Plan of a peer's run."""

    skins: tuple[float, ...]
    """Neighbour skins to time, one after another on the same state [m]."""
    run_in: int
    steps: int
    stretches: int
    """Steps before the first stretch, steps of a stretch, and stretches a skin."""


@dataclass(frozen=True, eq=False)
class PeerRun:
    """Result of a peer's run of a column."""

    version: str
    """Its name with it."""
    timings: Mapping[float, Timing]
    """Times of the stretches, by skin [m]."""
    kinetic_energy: float
    """Kinetic energy of the translation, at the end [J]."""
    contacts: ContactCounts
    """Touching pairs at the end."""
    placement_error: float
    """Largest distance of a sphere from where it was to be at the start [m]."""


Simulate = Callable[[str, Path, Case[LiftedCylinder], Moment, Plan], PeerRun]


@dataclass(frozen=True)
class Peer:
    """Another code."""

    program: str
    package: str
    """Executable on the PATH, and the Debian package that has it."""
    simulate: Simulate
    """Runs a settled column of grains of one shape: takes the executable, the folder for its files, the
    case, the moment and the plan."""

    def locate(self) -> str:
        """Return the path of the executable."""
        if path := shutil.which(self.program):
            return path
        wanted = f"{self.program} must be installed (Debian package {self.package})"
        raise ValueError(f"peer: {wanted}, found none")

    def run(self, folder: Path, case: Case[LiftedCylinder], moment: Moment, plan: Plan) -> PeerRun:
        """Run a settled column; `folder` is made for the files."""
        program = self.locate()
        folder.mkdir(parents=True, exist_ok=True)
        return self.simulate(program, folder, case, moment, plan)


def execute(command: Sequence[str], folder: Path) -> int:
    """Run a program on one thread in a folder; return its exit status, leave what it says in `screen.log`."""
    one_thread = os.environ | {"OMP_NUM_THREADS": "1"}
    with (folder / "screen.log").open("w", encoding="utf-8") as screen:
        return subprocess.run(
            command, cwd=folder, env=one_thread, stdout=screen, stderr=subprocess.STDOUT
        ).returncode


def common_size(moment: Moment) -> float:
    """Size of all grains of a column."""
    sizes = moment.setup.grains.sizes
    if np.ptp(sizes) > 0.0:
        raise ValueError(f"peer: grains must be of one size, got {sizes.min():g} to {sizes.max():g}")
    return float(sizes[0])


def grain_of_sphere(moment: Moment) -> np.ndarray:
    """Grain that each sphere belongs to, in the order in which peers get them, (n * S,)."""
    setup = moment.setup
    return np.repeat(np.arange(setup.grains.count), setup.shapes[0].sphere_count)


def spheres_in_place(moment: Moment) -> np.ndarray:
    """Centres and radii of all spheres [m], grain by grain, (n * S, 4)."""
    grains, shape = moment.setup.grains, moment.setup.shapes[0]
    centers = placed_centers(shape, grains.positions, grains.orientations, grains.sizes)
    return np.column_stack([centers, np.outer(grains.sizes, shape.radii).ravel()])


def judged(
    moment: Moment,
    version: str,
    timings: Mapping[float, Timing],
    kinetic_energy: float,
    start: np.ndarray,
    end: np.ndarray,
) -> PeerRun:
    """Return the result of a run by its spheres at start and end: centres and radii [m], (n * S, 4)."""
    walls = [wall for wall, _ in moment.setup.walls]
    shift = start[:, :3] - spheres_in_place(moment)[:, :3]
    return PeerRun(
        version=version,
        timings=timings,
        kinetic_energy=kinetic_energy,
        contacts=count_contacts(end[:, :3], end[:, 3], grain_of_sphere(moment), walls),
        placement_error=float(np.linalg.norm(shift, axis=1).max()),
    )
