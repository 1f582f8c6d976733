"""Running LIGGGHTS and LAMMPS on a path, and reading the states that they dump."""

import shutil
import subprocess
from pathlib import Path

import numpy as np

from experiments.evidence.verification.problems.contact_paths import SAMPLES, PathSetup, Trajectory

INPUT, DUMP = "path.in", "path.dump"

END = """\
dump states all custom {stride} path.dump id x y z vx vy vz omegax omegay omegaz
dump_modify states sort id {format}
thermo {steps}
run {steps}
"""


def run_commands(setup: PathSetup, key: str) -> str:
    """Commands that dump every state that is compared; the key is the code's own for a format."""
    words = f'{key} "%d' + 9 * " %.15g" + '"'
    return END.format(stride=setup.stride, steps=SAMPLES * setup.stride, format=words)


def box_of(setup: PathSetup) -> tuple[float, ...]:
    """Return the sides of a box that no sphere leaves [m]."""
    return (-0.02, 0.02, -0.02, 0.02, -1e-3 if setup.path.has_plate else -0.02, 0.02)


def atoms(setup: PathSetup, spin: str) -> str:
    """Commands that make the spheres; `spin` is the code's own format for that of one."""
    lines = []
    for number, (place, radius) in enumerate(zip(setup.positions.tolist(), setup.radii, strict=True), 1):
        lines += [
            f"create_atoms 1 single {' '.join(map(repr, place))} units box",
            f"set atom {number} diameter {2.0 * radius!r} density {setup.grain.density!r}",
            f"set atom {number} {spin.format(*setup.path.spins[number - 1])}",
            f"group sphere{number} id {number}",
            f"velocity sphere{number} set {' '.join(map(str, setup.path.speeds[number - 1]))}",
        ]
    return "\n".join([*lines, ""])


def run_path(program: str, package: str, text: str, folder: Path, count: int) -> Trajectory:
    """Run an input in a folder and read its states."""
    if (found := shutil.which(program)) is None:
        raise ValueError(f"{program} must be installed (Debian package {package}), found none")
    (folder / INPUT).write_text(text, encoding="utf-8")
    with (folder / "screen.log").open("w", encoding="utf-8") as screen:
        ended = subprocess.run([found, "-in", INPUT], cwd=folder, stdout=screen, stderr=subprocess.STDOUT)
    if ended.returncode or not (folder / DUMP).is_file():
        raise RuntimeError(f"{program} failed in {folder}: {ended.returncode}; screen.log says why")
    return read_states(folder / DUMP, count)


def read_states(path: Path, count: int) -> Trajectory:
    """Read the states of a dump of `count` spheres."""
    lines = path.read_text(encoding="utf-8").splitlines()
    starts = [i + 1 for i, line in enumerate(lines) if line.startswith("ITEM: ATOMS")]
    rows = [[line.split()[1:] for line in lines[start : start + count]] for start in starts]
    states = np.array(rows, dtype=float)
    return Trajectory(states[..., 0:3], states[..., 3:6], states[..., 6:9])
