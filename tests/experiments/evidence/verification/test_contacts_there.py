"""Contacts in LIGGGHTS, LAMMPS and Yade with the exported coefficients, against the same laws here."""

from dataclasses import replace
from pathlib import Path

import pytest

from dem_warp import PRESETS
from dem_warp.laws.conventions import NormalDamping
from experiments.evidence.verification.problems import lammps_contacts, liggghts_contacts, yade_contacts
from experiments.evidence.verification.problems.contact_paths import PATHS, TOLERANCE, PathSetup, difference
from experiments.export.lammps_exporter import LAMMPS

FOLLOW = {"liggghts": liggghts_contacts.follow, "lmp": lammps_contacts.follow}
"""Followers of a path by their programs."""


@pytest.mark.parametrize(
    ("name", "laws", "program"),
    [
        pytest.param(name, laws, program, marks=pytest.mark.program(program))
        for name, laws, program in (
            ("plate, rolling", "liggghts", "liggghts"),
            ("pair, oblique", "liggghts-cdt", "liggghts"),
            ("pair, rolling", "lammps", "lmp"),
        )
    ],
)
def test_a_contact_goes_the_same_way_there(name: str, laws: str, program: str, tmp_path: Path) -> None:
    [path] = [path for path in PATHS if path.name == name]
    setup = PathSetup(replace(path, duration=path.duration / 4), PRESETS[laws])
    apart = difference(setup, setup.ours("cpu"), FOLLOW[program](setup, tmp_path))
    assert max(apart.values()) < TOLERANCE


@pytest.mark.program("lmp")
@pytest.mark.parametrize(("damping", "rate"), [("mass_velocity", 300.0), ("viscoelastic", 3000.0)])
def test_a_damping_that_is_lammps_own_goes_the_same_way_there(
    damping: NormalDamping, rate: float, tmp_path: Path
) -> None:
    # a third of the speed is lost; the restitution takes no part
    laws = replace(PRESETS["lammps"], normal_damping=damping, damping_rate=rate)
    assert LAMMPS.conventions.warnings(laws) == ()
    [path] = [path for path in PATHS if path.name == "pair, rolling"]
    setup = PathSetup(replace(path, duration=path.duration / 4), laws)
    apart = difference(setup, setup.ours("cpu"), lammps_contacts.follow(setup, tmp_path))
    assert max(apart.values()) < TOLERANCE


@pytest.mark.program("yade")
def test_a_pair_in_yade_goes_the_same_way_as_ours(tmp_path: Path) -> None:
    [path] = [path for path in PATHS if path.name == "pair, oblique"]
    setup = PathSetup(path, PRESETS["yade"])
    found = difference(setup, setup.ours("cpu"), yade_contacts.follow(setup, tmp_path))
    # forces are double there and here; the rotation of a history is approximate there
    assert max(found.values()) < 1e-6


@pytest.mark.program("liggghts")
def test_a_sphere_that_comes_to_rest_tells_the_two_resistances_to_rolling_apart(tmp_path: Path) -> None:
    spring, directional = (
        next(one for one in liggghts_contacts.paths(PRESETS[name]) if one.path.name == "plate, rolling")
        for name in ("liggghts", "liggghts-cdt")
    )
    theirs = liggghts_contacts.follow(spring, tmp_path)
    assert max(difference(spring, spring.ours("cpu"), theirs).values()) < TOLERANCE
    assert min(difference(spring, directional.ours("cpu"), theirs).values()) > TOLERANCE
