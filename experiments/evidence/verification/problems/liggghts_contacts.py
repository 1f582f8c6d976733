"""Contacts with the exported coefficients in LIGGGHTS, against the same laws here."""

import tempfile
from dataclasses import replace
from pathlib import Path

from dem_warp import PRESETS, ContactLaws
from experiments.evidence.verification.check import Result
from experiments.evidence.verification.problems.contact_dumps import atoms, box_of, run_commands, run_path
from experiments.evidence.verification.problems.contact_paths import (
    PathSetup,
    Trajectory,
    compare_paths,
    every_path,
    result_of,
)
from experiments.evidence.verification.problems.setups import STEEL
from experiments.export import liggghts_text as text
from experiments.export import values
from experiments.export.liggghts_exporter import CONVENTIONS, LIGGGHTS

TEXT = """\
Two spheres, and a sphere on a plate, are followed in LIGGGHTS (`liggghts`, Debian) with the coefficients that
`dem-warp export` gives it, and here under the laws of the same name. An error is the largest difference of
the two trajectories over their size."""


def liggghts_contacts(device: str) -> Result:
    """Compare every path under both resistances to rolling that LIGGGHTS has here."""
    with tempfile.TemporaryDirectory() as folder:
        parts = [
            compare_paths("LIGGGHTS", paths(PRESETS[name]), follow, Path(folder) / name, device)
            for name in ("liggghts", "liggghts-cdt")
        ]
    return result_of("LIGGGHTS", TEXT, parts)


def paths(laws: ContactLaws) -> list[PathSetup]:
    """Set up every path; the sphere on the plate rolls to rest, where the two resistances differ."""
    setups = {setup.path.name: setup for setup in every_path(laws)}
    rolling = setups["plate, rolling"]
    slow = replace(rolling.path, speeds=((0.003, 0.0, 0.0),), spins=((0.0, 2.0, 0.0),), duration=6.0e-3)
    return list((setups | {slow.name: replace(rolling, path=slow)}).values())


def follow(setup: PathSetup, folder: Path) -> Trajectory:
    """Follow one path in LIGGGHTS."""
    model = text.model_words(CONVENTIONS.words(setup.laws))
    materials = [values(LIGGGHTS.material_terms(each)) for each in (setup.grain, STEEL)]
    terms = values(LIGGGHTS.contact_terms(setup.contact))
    parts = [
        text.head(("grains", "plate"), box_of(setup), 0.0005, sort="sort 0 0"),
        text.contacts(text.properties(materials, lambda i, j: terms), model, setup.time_step),
        f"fix plate all wall/gran model {model} primitive type 2 zplane 0.0\n" * setup.path.has_plate,
        atoms(setup, "omegax {} omegay {} omegaz {}"),
        text.weight((0.0, 0.0, -setup.gravity)),
        "fix motion all nve/sphere\n",
        run_commands(setup, "format"),
    ]
    return run_path("liggghts", "liggghts", "".join(parts), folder, len(setup.radii))
