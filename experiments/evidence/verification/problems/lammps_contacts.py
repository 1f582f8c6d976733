"""Contacts with the exported coefficients in LAMMPS, against the same laws here."""

import tempfile
from dataclasses import replace
from pathlib import Path

from dem_warp import PRESETS
from experiments.evidence.verification.check import Result, Row, relative_row
from experiments.evidence.verification.problems.contact_dumps import atoms, box_of, run_commands, run_path
from experiments.evidence.verification.problems.contact_paths import (
    GRAIN,
    PATHS,
    ContactPath,
    PathSetup,
    Trajectory,
    compare_paths,
    difference,
    every_path,
    result_of,
)
from experiments.export import lammps_text as text
from experiments.export.lammps_exporter import CONVENTIONS, granular_words

TEXT = """\
Two spheres, and a sphere on a plate, are followed in LAMMPS (`lmp`, Debian) with the coefficients that
`dem-warp export` gives it, and here under the laws of the same name. An error is the largest difference of
the two trajectories over their size.

Oblique contacts differ by more than 1e-3, and the more the deeper they are. LAMMPS lets surfaces slide at
the whole radius, `wr1 = (radi*omega[i][0] + radj*omega[j][0])` (`pair_granular.cpp`, 2022-01-06, line 395;
walls alike, `fix_wall_gran.cpp`, line 1236), but its torque has `dist_to_contact = radi-0.5*delta` for a
lever (line 663); and as a contact turns, it scales the spring back to the length that it had (`scalefac =
shrmag/prjmag`, line 468). These differences are stated, and a modulus a hundred times larger must make them
as much smaller as it makes the overlap."""

EXPLAINED = ("pair, oblique", "plate, oblique")
"""Paths whose difference the text explains."""

STIFFER = 100.0
SHALLOWER = STIFFER**-0.4
"""Factors on the modulus and, by Hertz, on the overlap of an impact."""

SHARE_TOLERANCE = 0.15
"""Error of the ratio of two differences, besides the squares of the overlap, 2 % of a radius at the most."""


def lammps_contacts(device: str) -> Result:
    """Compare every path."""
    with tempfile.TemporaryDirectory() as folder:
        part = compare_paths("LAMMPS", every_path(PRESETS["lammps"]), follow, Path(folder), device, EXPLAINED)
        falls = [_falls(path, Path(folder), device) for path in PATHS if path.name in EXPLAINED]
    return result_of("LAMMPS", TEXT, [part, (falls, [])])


def _falls(path: ContactPath, folder: Path, device: str) -> Row:
    """Row of how the difference of an explained path falls with the overlap."""
    found = []
    for stiffness in (1.0, STIFFER):
        stiff = replace(GRAIN, shear_modulus=stiffness * GRAIN.shear_modulus)
        setup = PathSetup(path, PRESETS["lammps"], stiff)
        found.append(difference(setup, setup.ours(device), follow(setup, folder))["spins"])
    labels = ("lammps", path.name, f"spins, difference at {STIFFER:g} times the modulus over that above")
    return relative_row((*labels, "overlap"), SHALLOWER, found[1] / found[0], SHARE_TOLERANCE)


def follow(setup: PathSetup, folder: Path) -> Trajectory:
    """Follow one path in LAMMPS."""
    words = granular_words(setup.contact, CONVENTIONS.words(setup.laws))
    parts = [
        text.head("array sort 0 0"),
        text.box(box_of(setup)),
        text.neighbors(0.0005),
        text.contacts({"* *": words}, setup.time_step),
        f"fix plate all wall/gran granular {words} zplane 0 NULL\n" * setup.path.has_plate,
        atoms(setup, "omega {} {} {}"),
        text.weight((0.0, 0.0, -setup.gravity)),
        "fix motion all nve/sphere\n",
        run_commands(setup, "format line"),
    ]
    return run_path("lmp", "lammps", "".join(parts), folder, len(setup.radii))
