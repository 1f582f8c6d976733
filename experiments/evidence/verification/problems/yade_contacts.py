"""Contacts with the exported coefficients in Yade, against the same laws here."""

import json
import shutil
import subprocess
import tempfile
from pathlib import Path

from dem_warp import PRESETS
from experiments.evidence.verification.check import Result
from experiments.evidence.verification.problems.contact_paths import (
    PathSetup,
    Trajectory,
    compare_paths,
    every_path,
    result_of,
)
from experiments.evidence.verification.problems.contact_programs import (
    path_numbers,
    program_text,
    trajectory_of,
)
from experiments.export.yade_exporter import YADE

TEXT = """\
Two spheres, and a sphere on a plate, are followed in Yade (Debian) with the coefficients that `dem-warp
export` gives it, and here under the laws of the same name. An error is the largest difference of the two
trajectories over their size.

`Law2_ScGeom_MindlinPhys_Mindlin` with `includeMoment`. In the overlap that its clamped damping leaves at the
end of an impact there is no normal force, and no limit to its moment, which is held only `if (MomentMax > 0)`
(`HertzMindlin.cpp`): our law of the name does alike. The spring of rolling is set in a contact at the end of
the step in which it begins, so that it lacks the roll of that step: this is the difference that rolling
pairs have."""

PROGRAM = "yade_path.txt"


def yade_contacts(device: str) -> Result:
    """Compare every path."""
    with tempfile.TemporaryDirectory() as folder:
        part = compare_paths("Yade", every_path(PRESETS["yade"]), follow, Path(folder), device)
    return result_of("Yade", TEXT, [part])


def follow(setup: PathSetup, folder: Path) -> Trajectory:
    """Follow one path in Yade."""
    if (yade := shutil.which("yade")) is None:
        raise ValueError("yade must be installed (Debian package yade), found none")
    numbers = path_numbers(setup, YADE)
    (folder / "path.json").write_text(json.dumps(numbers), encoding="utf-8")
    (folder / "path.py").write_text(program_text(PROGRAM), encoding="utf-8")
    with (folder / "screen.log").open("w", encoding="utf-8") as screen:
        command = [yade, "-n", "-x", "-j1", "path.py"]
        ended = subprocess.run(command, cwd=folder, stdout=screen, stderr=subprocess.STDOUT)
    if ended.returncode or not (folder / "states.json").is_file():
        raise RuntimeError(f"yade failed in {folder}: {ended.returncode}; screen.log says why")
    return trajectory_of(json.loads((folder / "states.json").read_text(encoding="utf-8"))["states"])
