"""Contacts with the exported coefficients in LIGGGHTS, against the same laws here."""

from __future__ import annotations

import tempfile
from pathlib import Path

from dem_warp import PRESETS
from experiments.evidence.verification.problems.contact_dumps import box_of, run_commands, run_path
from experiments.evidence.verification.problems.contact_paths import (
    PathSetup,
    Trajectory,
    compare_paths,
    every_path,
    result_of,
)
from experiments.evidence.verification.problems.setups import STEEL
from experiments.evidence.verification.result import Result
from experiments.export.contact import values
from experiments.export.liggghts import CONVENTIONS, contact_terms, material_terms, model_words

TEXT = """\
Two spheres, and a sphere on a plate, are followed in LIGGGHTS (`liggghts`, Debian) with the coefficients that
`dem-warp export` gives it, and here under the laws of the same name. An error is the largest difference of
the two trajectories over their size."""

HEAD = """\
atom_style granular
atom_modify map array sort 0 0
boundary f f f
newton off
communicate single vel yes
units si
hard_particles yes
soft_particles yes
"""
"""First commands of an input of LIGGGHTS."""

_INPUT = """\
{head}region box block {box} units box
create_box 2 box
neighbor 0.0005 bin
neigh_modify delay 0 every 1 check yes
{properties}
pair_style gran model {model}
pair_coeff * *
timestep {time_step!r}
{plate}
{atoms}
{weight}
fix motion all nve/sphere
"""


def liggghts_contacts(device: str) -> Result:
    """Compare every path under both resistances to rolling that LIGGGHTS has here.

    Raises
    ------
    ValueError
        When LIGGGHTS is not installed.
    """
    with tempfile.TemporaryDirectory() as folder:
        parts = [
            compare_paths("LIGGGHTS", every_path(PRESETS[name]), follow, Path(folder) / name, device)
            for name in ("liggghts", "liggghts-cdt")
        ]
    return result_of("LIGGGHTS", TEXT, parts)


def follow(setup: PathSetup, folder: Path) -> Trajectory:
    """Follow one path in LIGGGHTS."""
    model = model_words(CONVENTIONS.words(setup.laws))
    materials = [values(material_terms(each)) for each in (setup.grain, STEEL)]
    lines = [
        f"fix {name} all property/global {name} peratomtype {materials[0][name]!r} {materials[1][name]!r}"
        for name in materials[0]
    ]
    for name, value in values(contact_terms(setup.contact)).items():
        lines.append(f"fix {name} all property/global {name} peratomtypepair 2" + 4 * f" {value!r}")
    text = _INPUT.format(
        head=HEAD,
        box=box_of(setup),
        properties="\n".join(lines),
        model=model,
        time_step=setup.time_step,
        plate=f"fix plate all wall/gran model {model} primitive type 2 zplane 0.0" * setup.path.has_plate,
        atoms=_atoms(setup),
        weight=f"fix weight all gravity {setup.gravity} vector 0 0 -1" * (setup.gravity > 0.0),
    )
    return run_path("liggghts", "liggghts", text + run_commands(setup, "format"), folder, len(setup.radii))


def _atoms(setup: PathSetup) -> str:
    lines = []
    for number, (place, radius) in enumerate(zip(setup.positions.tolist(), setup.radii, strict=True), 1):
        (vx, vy, vz), (wx, wy, wz) = setup.path.speeds[number - 1], setup.path.spins[number - 1]
        lines += [
            f"create_atoms 1 single {' '.join(map(repr, place))} units box",
            f"set atom {number} diameter {2.0 * radius!r} density {setup.grain.density!r} "
            f"vx {vx} vy {vy} vz {vz} omegax {wx} omegay {wy} omegaz {wz}",
        ]
    return "\n".join(lines)
