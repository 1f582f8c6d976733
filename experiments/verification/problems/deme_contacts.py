"""Contacts with the exported coefficients in DEM-Engine, against the same laws here.

DEM-Engine needs a GPU, and its states are kept beside this file:

    python -m experiments.verification.problems.deme_contacts write FOLDER
    (on a machine with a GPU, in FOLDER)  python3 paths.py
    python -m experiments.verification.problems.deme_contacts keep FOLDER
"""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import Annotated

import typer

from dem_warp import PRESETS
from experiments.export.deme import contact_terms, material_terms
from experiments.files import write_text
from experiments.verification.problems.contact_paths import (
    PATHS,
    RADII,
    PathSetup,
    Trajectory,
    compare_paths,
    result_of,
)
from experiments.verification.problems.contact_programs import path_numbers, program_text, trajectory_of
from experiments.verification.result import Result

TEXT = """\
Two spheres, and a sphere on a plate, were followed in {version} on a GPU with the coefficients that `dem-warp
export` gives it, and here under the laws of the same name. An error is the largest difference of the two
trajectories over their size. The two spheres are equal: DEM-Engine takes the circle of overlap from one of
them, `deme::PI * (radA * overlapDepth - ...)` (`DEMCollisionKernels_SphSph.cuh`). Its velocities
and forces are in float32."""

PROGRAM, STATES = "deme_path.txt", "deme_states.json"

EQUAL = (RADII[0], RADII[0])
"""Radii of the pair [m]."""


def deme_contacts(device: str) -> Result:
    """Compare every path with the states that are kept.

    Raises
    ------
    ValueError
        When there are none.
    """
    kept = Path(__file__).with_name(STATES)
    if not kept.is_file():
        raise ValueError(f"{STATES}: the states of DEM-Engine must be kept first, found none")
    stored = json.loads(kept.read_text(encoding="utf-8"))

    def follow(setup: PathSetup, folder: Path) -> Trajectory:
        return trajectory_of(stored["paths"][setup.path.name])

    with tempfile.TemporaryDirectory() as folder:
        part = compare_paths("DEM-Engine", PRESETS["deme"], follow, Path(folder), device, pair=EQUAL)
    return result_of("DEM-Engine", TEXT.format(version=stored["code"]), [part])


app = typer.Typer(add_completion=False, help=__doc__)

Folder = Annotated[Path, typer.Argument(help="Folder of the program, its paths and its states.")]


@app.command()
def write(folder: Folder) -> None:
    """Write the program and its paths."""
    setups = [PathSetup(path, PRESETS["deme"], pair=EQUAL) for path in PATHS]
    numbers = [path_numbers(setup, material_terms, contact_terms) for setup in setups]
    write_text(folder / "paths.json", json.dumps(numbers, indent=1))
    write_text(folder / "paths.py", program_text(PROGRAM))


@app.command()
def keep(folder: Folder) -> None:
    """Keep the states that the program left."""
    states = (folder / "states.json").read_text(encoding="utf-8")
    write_text(Path(__file__).with_name(STATES), states + "\n")


if __name__ == "__main__":
    app()
