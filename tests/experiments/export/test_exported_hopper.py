"""Hopper in LAMMPS and LIGGGHTS: walls, the reading of the weighed discharge, the flow rate next to ours."""

import math
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from exported_lift import GRAIN, ROD, WALL

from dem_warp import PRESETS, Case, ClumpShape, GrainPopulation, Hopper, Interaction, ShapeMixture, simulate
from experiments.cases.engines.driver import Driver
from experiments.cases.engines.program import AnswerError, ProgramEngine
from experiments.export import ExportedTest, export_input
from experiments.export.hopper_text import DISCHARGE_FILE, FILLED_FILE, bin_top
from experiments.export.lammps_hopper import hopper_walls
from experiments.export.lift import Lift
from experiments.export.liggghts_hopper import hopper_meshes
from experiments.io.errors import InputError

PROGRAMS = {"lammps": "lmp", "liggghts": "liggghts"}
COUNT, MASS = 500, 4.0 / 3.0 * math.pi * 1e-9 * GRAIN.density
"""Number and mass of the grains [kg]."""


CODES = [pytest.param(code, marks=pytest.mark.program(program)) for code, program in PROGRAMS.items()]


def hopper(
    seed: int = 1, shape: ClumpShape | ShapeMixture | None = None, laws: str = "liggghts", **changes: Any
) -> Case[Hopper]:
    scene = Hopper(0.02, 0.02, 0.012, WALL, rain_rate=3e3, rest_speed=3e-3, grain_count=COUNT)
    grains = GrainPopulation(shape or ClumpShape.sphere(1e-3), GRAIN, size_sd=0.0)
    friction = Interaction(0.5, 0.3, 0.05)
    return Case(
        replace(scene, **changes), grains, friction, friction,
        seed=seed, laws=PRESETS[laws],
    )  # fmt: skip


def exported(case: Case[Any]) -> ExportedTest:
    return ExportedTest("small", case, "a test")


@pytest.mark.parametrize("angle", [math.pi / 2, 0.5])
def test_the_walls_close_and_leave_the_outlets_area(angle: float) -> None:
    lift = Lift(exported(hopper(half_angle=angle, fill_depth=0.05)), "LIGGGHTS", (Hopper,))
    texts = hopper_meshes(lift).values()
    walls = [
        np.array([line.split()[1:] for line in text.splitlines() if "vertex" in line], float).reshape(
            -1, 3, 3
        )
        for text in texts
    ]
    bin, floor, plug = walls
    normals = np.cross(plug[:, 1] - plug[:, 0], plug[:, 2] - plug[:, 0])
    # nine digits of each corner
    assert np.linalg.norm(normals, axis=1).sum() / 2 == pytest.approx(math.pi / 4 * 0.012**2, rel=1e-7)
    edges: dict[Any, int] = {}
    for corners in np.concatenate(walls).round(9) + 0.0:
        for one, other in ((0, 1), (1, 2), (2, 0)):
            edge = frozenset((tuple(corners[one]), tuple(corners[other])))
            edges[edge] = edges.get(edge, 0) + 1
    # only the rim of the bin is open
    once = [edge for edge, number in edges.items() if number == 1]
    assert len(once) == 60
    assert {corner[2] for edge in once for corner in edge} == {bin[..., 2].max().round(9)}
    assert floor[..., 2].max() == pytest.approx(lift.scene.cone_height, abs=1e-9)


def test_what_a_code_is_not_given_is_refused_by_name() -> None:
    for code in ("yade", "deme", "mercurydpm"):
        with pytest.raises(InputError, match=r"be a lifted-cylinder.*: .* is given no other, got hopper"):
            export_input(exported(hopper()), code)
    mixture = ShapeMixture((ROD, ClumpShape.sphere(1e-3)), (0.5, 0.5))
    for code in PROGRAMS:
        with pytest.raises(InputError, match=f"{code.upper()} is given no hopper of a mixture, got 2 shapes"):
            export_input(exported(hopper(shape=mixture, laws=code)), code)
    narrow = exported(hopper(laws="lammps", outlet=9e-4))
    with pytest.raises(InputError, match=r"wider than the radius .* of a sphere in LAMMPS"):
        export_input(narrow, "lammps")


@pytest.mark.program("lmp")
@pytest.mark.parametrize("angle", [math.pi / 2, 0.5])
def test_open_regions_push_as_the_nearest_points_of_our_walls(angle: float, tmp_path: Path) -> None:
    lift = Lift(exported(hopper(half_angle=angle, fill_depth=0.05)), "LAMMPS", (Hopper,))
    spring = "hertz 1e6 0 tangential linear_nohistory 0 0"
    walls = hopper_walls(lift, spring, spring)
    half, radius, high, top = 0.006, 1e-3, lift.scene.cone_height, bin_top(lift)
    rng = np.random.default_rng(1)
    z = rng.uniform(-1.2e-3, high + 3e-3, 4000)
    inner = half + np.clip(z / (high or 1.0), 0.0, 1.0) * 4e-3 if high else np.full_like(z, 9.9e-3)
    r, turn = rng.uniform(2.1e-3, inner), rng.uniform(0.0, 2.0 * np.pi, len(z))
    places = "".join(
        f"create_atoms 1 single {x:.12g} {y:.12g} {h:.12g}\n"
        for x, y, h in zip(r * np.cos(turn), r * np.sin(turn), z, strict=True)
    )
    (tmp_path / "walls.in").write_text(
        "units si\natom_style sphere\natom_modify map hash\nboundary f f f\nnewton off\ncomm_modify vel yes\n"
        "region box block -0.02 0.02 -0.02 0.02 -0.01 0.1\ncreate_box 1 box\nneighbor 1e-4 bin\n"
        f"{places}set type 1 diameter {2 * radius} density 1000\nneigh_modify exclude type 1 1\n"
        f"pair_style granular\npair_coeff * * {spring}\n{walls}unfix plug\nfix motion all nve/sphere\n"
        "dump all all custom 1 out id x y z fx fy fz\ndump_modify all sort id format float %.12g\nrun 0\n"
    )
    subprocess.run(["lmp", "-in", "walls.in"], cwd=tmp_path, check=True, capture_output=True)
    found = np.loadtxt(tmp_path / "out", skiprows=9)
    here = np.column_stack([np.hypot(found[:, 1], found[:, 2]), found[:, 3]])
    across = (found[:, 4] * found[:, 1] + found[:, 5] * found[:, 2]) / here[:, 0]
    forces, ours = np.column_stack([across, found[:, 6]]), np.zeros_like(here)
    lines = ([[0.01, high], [0.01, top]], [[half, 0.0], [0.01, high]])
    for low, up in np.array(lines):
        share = np.clip((here - low) @ (up - low) / ((up - low) @ (up - low)), 0.0, 1.0)
        nearest = low + share[:, None] * (up - low)
        away = here - nearest
        distance = np.linalg.norm(away, axis=1)
        force = 1e6 * math.sqrt(radius) * np.maximum(radius - distance, 0.0) ** 1.5
        # LAMMPS counts half the curvature in, but not at the bin's rim: contacts there are left out below
        force /= np.sqrt(1.0 - radius / (2.0 * nearest[:, 0]))
        ours += away * (force / distance)[:, None]
    probed = (here[:, 1] >= high) | (here[:, 0] < 0.01 - radius)
    forces, ours = forces[probed], ours[probed]
    assert np.count_nonzero(ours.any(axis=1)) > 300
    # nine digits of the walls, on forces that grow by 1.5 times the share of the overlap, and the flat cone
    assert np.abs(forces - ours).max() < 1e-5 * np.abs(ours).max()


def weighed(folder: Path, fallen: np.ndarray, over: int = 0) -> Case[Hopper]:
    """Write a filled hopper and its discharge as LIGGGHTS does; `fallen`: grains at each look of 5 ms."""
    spheres = [f"{i + 1} 1 0 0 {1e-3 + 1e-5 * i:.9g} 0.001" for i in range(COUNT)]
    head = f"ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n{COUNT}\nITEM: BOX BOUNDS ff ff ff\n{'-1 1' + chr(10)}"
    text = f"{head}-1 1\n-1 1\nITEM: ATOMS id type x y z radius\n" + "\n".join(spheres) + "\n"
    (folder / FILLED_FILE).write_text(text, encoding="utf-8")
    rows = [
        f"{0.005 * (i + 1):.9g} {MASS * (COUNT - n):.12g} {over} {COUNT - n}" for i, n in enumerate(fallen)
    ]
    (folder / DISCHARGE_FILE).write_text("\n".join(["# s kg 1 1", *rows]) + "\n", encoding="utf-8")
    return hopper()


def test_a_steady_discharge_has_its_rate(tmp_path: Path) -> None:
    case = weighed(tmp_path, np.minimum(4 * np.arange(1, 150), 400))
    seen = Driver("liggghts").read(case, tmp_path).observables
    # four grains each 5 ms; the masses have nine digits
    assert seen["flow_rate"] == pytest.approx(800.0 * MASS, rel=1e-6)
    assert seen["flow_rate_se"] < 1e-6 * seen["flow_rate"]
    assert (seen["fallen_mass"], seen["mass_left"]) == pytest.approx((400 * MASS, 100 * MASS), rel=1e-6)
    assert seen["discharge_time"] == pytest.approx(0.5)
    assert (seen["grain_count"], seen["clogged"]) == (COUNT, 0.0)


def test_grains_over_the_outlet_are_a_failure_and_a_broken_file_no_answer(tmp_path: Path) -> None:
    case = weighed(tmp_path, np.array([0, 2, 3, 3, 3]), over=2)
    result = Driver("liggghts").read(case, tmp_path)
    assert (result.status, result.observables["clogged"]) == ("failed", 1.0)
    assert "the outlet is clogged" in result.reason
    for text in ("# s kg 1 1\n", "# s kg 1 1\n0.1 2 3\n", "# s kg 1 1\n0.1 nan 3 4\n", "#\na b c d\n"):
        (tmp_path / DISCHARGE_FILE).write_text(text, encoding="utf-8")
        with pytest.raises(AnswerError, match=DISCHARGE_FILE):
            Driver("liggghts").read(case, tmp_path)


@pytest.mark.parametrize("code", CODES)
def test_clumps_are_weighed_as_the_union_of_their_spheres(code: str) -> None:
    case = hopper(shape=ROD, laws=code, diameter=0.03, outlet=0.018, grain_count=80)
    [result] = ProgramEngine(Driver(code))([case])
    assert result.status == "finished", result.reason
    seen = result.observables
    # nine digits of each radius
    assert seen["filled_mass"] == pytest.approx(80 * GRAIN.density * ROD.volume, rel=1e-6)
    assert seen["fallen_mass"] + seen["mass_left"] == pytest.approx(seen["filled_mass"], rel=1e-6)
    assert seen["grain_count"] == 80
    assert 0.0 < seen["fallen_mass"] < seen["filled_mass"]


@pytest.mark.parametrize("code", CODES)
def test_the_flow_rate_is_ours(code: str) -> None:
    cases = [hopper(seed, laws=code) for seed in (1, 2)]
    there, here = ProgramEngine(Driver(code))(cases), simulate(cases, device="cpu")
    assert [result.status for result in (*there, *here)] == ["finished"] * 4, there[0].reason
    for result in there:
        assert result.observables["filled_mass"] == pytest.approx(COUNT * MASS, rel=1e-6)
    theirs, ours = (
        np.array([[r.observables["flow_rate"], r.observables["flow_rate_se"]] for r in results]).T
        for results in (there, here)
    )
    # other fillings at random: three standard errors of the difference of the means
    error = np.sqrt((theirs[1] ** 2).sum() + (ours[1] ** 2).sum()) / 2
    assert abs(theirs[0].mean() - ours[0].mean()) < 3.0 * error
    # and the errors are so small that the test says something: the flow goes as the outlet to the power 2.5,
    # so that an outlet wider by a tenth would differ by 27 %
    assert 3.0 * error < 0.25 * ours[0].mean()
