"""Contacts with the exported coefficients in DEM-Engine, against the same laws here.

DEM-Engine needs a GPU, and its states are kept in this folder:

    python -m experiments.evidence.verification.problems.deme_contacts write FOLDER
    (on a machine with a GPU, in FOLDER)  python3 paths.py
    python -m experiments.evidence.verification.problems.deme_contacts keep FOLDER
"""

import json
import lzma
import math
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from dem_warp import PRESETS
from experiments.evidence.verification.check import Result, Row
from experiments.evidence.verification.problems.contact_paths import (
    PATHS,
    RADII,
    SAMPLES,
    TOLERANCE,
    PathSetup,
    Trajectory,
    compare_paths,
    result_of,
)
from experiments.evidence.verification.problems.contact_programs import (
    path_numbers,
    program_text,
    trajectory_of,
)
from experiments.export.deme_exporter import DEME
from experiments.io.files import write_text

TEXT = """\
Two spheres, and a sphere on a plate, were followed in {version} on a GPU with the coefficients that `dem-warp
export` gives it, and here under the laws of the same name. An error is the largest difference of the two
trajectories over their size. The two spheres are equal: DEM-Engine takes the circle of overlap from one of
them, `deme::PI * (radA * overlapDepth - ...)` (`DEMCollisionKernels_SphSph.cuh`). Its velocities and forces
are in float32, and so are the places at which it begins, 1.5 nm from those it is given: ours begin there too,
as the overlap of the first touch decides how the tangential spring begins.

Two things of its source make some paths differ by more than 1e-3. The circle has a term of the second order,
`overlapDepth * overlapDepth / (T1)4` between spheres and `deme::PI * (2.0 * radA * overlapDepth -
overlapDepth * overlapDepth)` on a plate, which softens an overlap of 1 % of the radius by 0.1 and 0.3 %; ours
has the first order alone. The last row has the impact on the plate with that term. And places are kept in 16
bits of a voxel, `subPosY = (Y - (T3)voxelNumY * voxelSize) / l` (`DEMHelperKernels.cuh`): one that lies a
rounding error below a border wraps around, and loses the width of a voxel, 5.7e-8 m here. In the normal and
the twisting pair a sphere loses one voxel during the impact. The oblique sphere on the plate begins on a
border: it drifts across its way by a voxel a step from the impact on, and keeps its velocity."""

EXPLAINED = ("pair, normal", "pair, twisting", "plate, normal", "plate, oblique")
"""Paths whose difference the text explains."""

PROGRAM, STATES = "deme_path.txt", "deme_states.json.xz"

EQUAL = (RADII[0], RADII[0])
"""Radii of the pair [m]."""


def deme_contacts(device: str) -> Result:
    """Compare every path with the states that are kept."""
    kept = Path(__file__).with_name(STATES)
    if not kept.is_file():
        raise ValueError(f"{STATES}: the states of DEM-Engine must be kept first, found none")
    stored = json.loads(lzma.decompress(kept.read_bytes()))

    theirs = {name: trajectory_of(states) for name, states in stored["paths"].items()}
    setups = {name: replace(setup, start=theirs[name].positions[0]) for name, setup in _setups().items()}

    def follow(setup: PathSetup, folder: Path) -> Trajectory:
        return theirs[setup.path.name]

    with tempfile.TemporaryDirectory() as folder:
        part = compare_paths("DEM-Engine", setups.values(), follow, Path(folder), device, EXPLAINED)
    softer = _whole_circle(setups["plate, normal"], theirs["plate, normal"])
    return result_of("DEM-Engine", TEXT.format(version=stored["code"]), [part, ([softer], [])])


def _setups() -> dict[str, PathSetup]:
    """Every path by its name, with spheres of one size."""
    return {path.name: PathSetup(path, PRESETS["deme"], pair=EQUAL) for path in PATHS}


def _whole_circle(setup: PathSetup, theirs: Trajectory) -> Row:
    """Row of an impact on the plate, followed with both orders of the circle of overlap."""
    law, mass, radius = setup.contact.coefficients, setup.masses[0], setup.radii[0]
    place, speed, speeds = setup.positions[0, 2], setup.path.speeds[0][2], []
    for _ in range(SAMPLES * setup.stride + 1):
        overlap = radius - place
        if overlap > 0.0:
            # the modulus has a factor of sqrt(2): the first order of this circle in Hertz's radius
            stiffness = 2.0 * law.modulus * math.sqrt((radius - 0.5 * overlap) * overlap)
            force = 2.0 / 3.0 * stiffness * overlap - law.damping * math.sqrt(stiffness * mass) * speed
            speed += force / mass * setup.time_step
        place += speed * setup.time_step
        speeds.append(speed)
    # speeds stand half a step before the places, as everywhere: their mean over two steps belongs to them
    centred = 0.5 * (np.array(speeds[:-1]) + np.array(speeds[1:]))[setup.stride - 1 :: setup.stride]
    apart = np.abs(theirs.velocities[1:, 0, 2] - centred).max()
    error = float(apart / abs(setup.path.speeds[0][2]))
    labels = (
        "deme",
        setup.path.name,
        "velocities, difference over size, with the whole circle",
        "DEM-Engine",
    )
    return Row(*labels, 0.0, error, error, TOLERANCE, relative=False)


app = typer.Typer(add_completion=False, help=__doc__)

Folder = Annotated[Path, typer.Argument(help="Folder of the program, its paths and its states.")]


@app.command()
def write(folder: Folder) -> None:
    """Write the program and its paths."""
    numbers = [path_numbers(setup, DEME) for setup in _setups().values()]
    write_text(folder / "paths.json", json.dumps(numbers, indent=1))
    write_text(folder / "paths.py", program_text(PROGRAM))


@app.command()
def keep(folder: Folder) -> None:
    """Keep the states that the program left."""
    states = lzma.compress((folder / "states.json").read_bytes())
    Path(__file__).with_name(STATES).write_bytes(states)


if __name__ == "__main__":
    app()
