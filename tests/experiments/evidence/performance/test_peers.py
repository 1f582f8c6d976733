"""Comparisons with other codes: their input for a column, and the reading of their answers. None is run."""

import json
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import typer
from commandline import install as write_program
from scipy.integrate import solve_ivp
from typer.testing import CliRunner

from experiments.evidence.performance import heap_throughput
from experiments.evidence.performance.columns import Columns, Moment
from experiments.evidence.performance.peers import lammps_peer, liggghts_peer, yade_peer
from experiments.evidence.performance.peers.peer import PeerRun, Plan
from experiments.evidence.performance.peers.peer_list import PEERS, PeerName
from experiments.evidence.performance.roofline import world_contacts
from experiments.evidence.performance.timing import start
from experiments.export.lammps_exporter import TSUJI

PLAN = Plan((1e-4, 2e-4), run_in=700, steps=300, stretches=2)
MODULUS = 2.0 * 34.325e6 / 400.0 * 1.29  # E = 2 G (1 + v), softened
RESTITUTIONS = (0.18, 0.50)

PLACING = """\
#!{python}
import json, re, sys
import numpy as np
def placed(center, turn, spheres):
    x, y, z, w = turn
    matrix = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])
    return [[*(center + matrix @ sphere[:3]), sphere[3]] for sphere in spheres]
"""

LOGGING = '''\
"""Dumps the spheres and says that its runs took 0.5 s, 0.6 s, ..."""
def answer(rows, version):
    for name in ("start", "end"):
        with open(name + ".txt", "w") as file:
            print("ITEM: ATOMS id x y z radius", file=file)
            for i, row in enumerate(rows):
                print(i + 1, *map(repr, map(float, row)), file=file)
    with open("column.log", "w") as log:
        print(version, file=log)
        for i, steps in enumerate(re.findall(r"^run (\\d+)", text, re.MULTILINE)):
            print(f"    Step energy\\n  {i}  1.5e-9", file=log)
            print(f"Loop time of {0.5 + 0.1 * i} on 1 procs for {steps} steps", file=log)
            print(f"Neighbor list builds = {i}", file=log)
text = open("column.in").read()
'''

FAKES = {
    PeerName.LIGGGHTS: PLACING
    + LOGGING
    + """\
number = r"([-+.\\de]+)"
boxes = re.findall(r"region at\\d+ block " + " ".join([number] * 6), text)
turns = re.findall(r"orientation constant " + " ".join([number] * 4), text)
rows = []
for box, turn in zip(boxes, turns, strict=True):
    w, *axis = map(float, turn)
    rows += placed(np.array(box, dtype=float).reshape(3, 2).mean(axis=1), [*axis, w], np.loadtxt("clump.txt"))
answer(rows, "LIGGGHTS (Version LIGGGHTS-PUBLIC 3.8.0, compiled)")
""",
    PeerName.LAMMPS: PLACING
    + LOGGING
    + """\
lines = open("column.data").read().split("Atoms # sphere")[1].split("Clumps")[0].split("\\n")
table = np.array([line.split() for line in lines if line], dtype=float)
answer(np.column_stack([table[:, 4:7], table[:, 2] / 2]), "LAMMPS (1 Jan 2030)")
""",
    PeerName.YADE: PLACING
    + """\
given = json.load(open("column.json"))
spheres = np.column_stack([given["centers"], given["radii"]])
rows = []
for center, turn in zip(given["positions"], given["orientations"], strict=True):
    rows += placed(center, turn, spheres)
json.dump({
    "version": "2030.01", "start": rows, "end": rows, "kinetic_energy": 1.5e-9,
    "seconds": [[0.8, 0.9], [1.0, 1.1]], "rebuilds": [7, 11],
}, open("result.json", "w"))
""",
}
"""Programs that place the spheres of what they are given by themselves, and invent the times."""


@pytest.fixture
def column(small_columns: Columns) -> Moment:
    return small_columns.moments("settled", 1)[0]


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[PeerName, str], None]:
    """Put a program in the place of a peer's; no other is found."""
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    return lambda name, text: write_program(
        tmp_path / "bin" / PEERS[name].program, text.replace("{python}", sys.executable)
    )


Install = Callable[[PeerName, str], None]


@pytest.mark.parametrize(
    ("name", "version", "steps", "rebuilds", "error"),
    [
        # LIGGGHTS runs thrice before it is timed, LAMMPS twice; regions are SPOT wide, numbers have 15 digits
        (PeerName.LIGGGHTS, "LIGGGHTS-PUBLIC 3.8.0", 300, (3 + 4, 5 + 6), liggghts_peer.SPOT),
        (PeerName.LAMMPS, "LAMMPS 1 Jan 2030", 300, (2 + 3, 4 + 5), 1e-15),
        (PeerName.YADE, "Yade 2030.01", 38, (7, 11), 1e-15),
    ],
)
def test_a_peer_gets_the_column_and_its_answer_is_read(
    small_columns: Columns,
    column: Moment,
    install: Install,
    tmp_path: Path,
    name: PeerName,
    version: str,
    steps: int,
    rebuilds: tuple[int, int],
    error: float,
) -> None:
    install(name, FAKES[name])
    done: PeerRun = PEERS[name].run(tmp_path / "run", small_columns.cases[0], column, PLAN)
    assert done.placement_error <= error
    assert done.contacts == world_contacts(start([column], "cpu"), 0)
    assert (done.version, done.kinetic_energy) == (version, 1.5e-9)
    first = 0.7 if name is PeerName.LAMMPS else 0.8
    assert done.timings[1e-4].seconds == pytest.approx((first, first + 0.1))
    assert done.timings[2e-4].seconds == pytest.approx((first + 0.2, first + 0.3))
    for skin, builds in zip(PLAN.skins, rebuilds, strict=True):
        assert done.timings[skin].steps == steps
        assert done.timings[skin].rebuilds == pytest.approx(builds / (2 * steps))
        assert done.timings[skin].free_spheres == 9 * column.setup.grains.count


def rebound(damping: Callable[[float], float]) -> float:
    """Restitution of an impact at unit speed, mass and stiffness, damped by a function of the overlap."""
    impact = solve_ivp(
        lambda _, state: (state[1], -(max(state[0], 0.0) ** 1.5) - damping(max(state[0], 0.0)) * state[1]),
        (0.0, 20.0),
        (0.0, 1.0),
        events=leaves,
        rtol=1e-9,
        atol=1e-12,
    )
    return float(-impact.y_events[0][0][1])


def leaves(_: float, state: np.ndarray) -> float:
    return float(state[0])


leaves.terminal = True  # type: ignore[attr-defined]
leaves.direction = -1.0  # type: ignore[attr-defined]


def test_lammps_gets_the_case_in_its_own_terms(
    small_columns: Columns, column: Moment, tmp_path: Path
) -> None:
    lammps_peer.write_input(tmp_path, small_columns.cases[0], column, PLAN)
    text = (tmp_path / "column.in").read_text()
    assert "exclude molecule/intra all" in text
    # E* of two grains is E / 2 (1 - v^2), of a grain and a rigid wall twice that; G* likewise with 2 - v
    rigid = MODULUS / (1 - 0.29**2) / (2.0 * 70e9 * 1.3 / (1 - 0.30**2))
    shear = MODULUS / 2.58 / (2 - 0.29)
    for before, share, friction, restitution in (
        ("pair_coeff * * ", 0.5, 0.46, 0.18),
        ("fix plate all wall/gran granular ", 1.0 / (1.0 + rigid), 0.38, 0.50),
        ("fix tube all wall/gran granular ", 1.0 / (1.0 + rigid), 0.38, 0.50),
    ):
        words = text.split(before)[1].split("\n")[0].split()
        modulus, tsuji, poisson = map(float, words[1:4])
        spring, tangential, slip = map(float, words[6:9])
        # LAMMPS makes E* from E and v by itself
        assert (modulus / 2, poisson) == (pytest.approx(MODULUS / (1 - 0.29**2) * share), 0.0)
        # steel gives way in shear by some 1e-6
        assert spring == pytest.approx(8.0 * shear * share, rel=1e-5)
        assert slip == friction
        assert float(words[13]) == 0.055
        coefficient = np.polyval(TSUJI, tsuji)
        # the normal damping gives the restitution, to the digits of its closed form's fit
        assert rebound(lambda x, c=coefficient: c * x**0.25) == pytest.approx(restitution, abs=2e-3)
        # both dampings are one part of the critical one, of a spring 8 G* a and of one 2 E* a
        assert tangential == pytest.approx(np.sqrt(spring / modulus), rel=1e-12)


def test_yade_gets_the_case_in_its_own_terms(small_columns: Columns, column: Moment, tmp_path: Path) -> None:
    yade_peer.write_input(tmp_path, small_columns.cases[0], column, PLAN)
    given = json.loads((tmp_path / "column.json").read_text())
    assert [material["young"] for material in given["materials"]] == pytest.approx(
        [MODULUS, 2.0 * 70e9 * 1.3]
    )
    assert [material["poisson"] for material in given["materials"]] == [0.29, 0.30]
    contacts = given["contacts"]
    assert np.tan([contact["frictAngle"] for contact in contacts]) == pytest.approx([0.46, 0.38])
    for contact, restitution in zip(contacts, RESTITUTIONS, strict=True):
        # of critical damping 2 sqrt(S m) with the slope S of the spring
        assert contact["betas"] == contact["betan"]
        damped = rebound(lambda x, ratio=contact["betan"]: 2 * ratio * np.sqrt(1.5 * np.sqrt(x)))
        assert damped == pytest.approx(restitution, abs=2e-3)
    compile((tmp_path / "column.py").read_text(), "column.py", "exec")


def test_yade_s_spheres_weigh_what_the_grain_does_about_its_centre(column: Moment) -> None:
    shape = column.setup.shapes[0]
    densities = yade_peer.part_densities(shape.centers, shape.radii, 1.3e-5)
    masses = densities * 4 / 3 * np.pi * shape.radii**3
    assert densities.min() > 0
    assert masses.sum() == pytest.approx(1.3e-5, rel=1e-12)
    np.testing.assert_allclose(masses @ shape.centers, 0.0, atol=1e-12 * 1.3e-5 * shape.radii.max())


def test_yade_s_tube_touches_the_cylinder_from_outside(
    small_columns: Columns, column: Moment, tmp_path: Path
) -> None:
    yade_peer.write_input(tmp_path, small_columns.cases[0], column, PLAN)
    tube = small_columns.cases[0].scene
    corners = np.array(json.loads((tmp_path / "column.json").read_text())["facets"])
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1) / 2
    distances = np.abs(np.einsum("ij,ij->i", normals, corners[:, 0])) / (2 * areas)
    np.testing.assert_allclose(distances, tube.diameter / 2, rtol=1e-12)
    # nothing is left open: n sides of 2 R tan(pi / n)
    perimeter = yade_peer.SIDES * tube.diameter * np.tan(np.pi / yade_peer.SIDES)
    assert areas.sum() == pytest.approx(perimeter * corners[..., 2].max(), rel=1e-12)
    assert corners[..., 2].max() > tube.height


@pytest.mark.parametrize("name", PeerName)
def test_a_peer_that_is_not_there_is_an_error_before_anything_runs(
    name: PeerName, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    app = typer.Typer()
    app.command()(heap_throughput.main)
    result = CliRunner().invoke(app, ["--peer", name, "--out", str(tmp_path / "out")])
    assert result.exit_code == 2
    assert f"{PEERS[name].program} must be installed" in " ".join(result.output.split())
    assert not (tmp_path / "out").exists()
