"""Drum in LIGGGHTS and LAMMPS: its walls, the reading of its looks, and its dynamic angle next to ours."""

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from exported_lift import GRAIN, ROD, WALL

from dem_warp import PRESETS, Case, ClumpShape, Drum, GrainPopulation, Interaction, ShapeMixture, simulate
from experiments.cases.engines.driver import Driver
from experiments.cases.engines.program import AnswerError, ProgramEngine
from experiments.export import ExportedTest, export_input
from experiments.export.drum import TURNED_FILE, drum_meshes
from experiments.export.hopper_text import FILLED_FILE
from experiments.export.lift import Lift
from experiments.io.errors import InputError

CODES = [pytest.param(code, marks=pytest.mark.program(program)) for code, program in
         (("liggghts", "liggghts"), ("lammps", "lmp"))]  # fmt: skip
DIAMETER, LENGTH, COUNT = 0.03, 0.012, 300


def drum(
    seed: int = 1,
    shape: ClumpShape | ShapeMixture | None = None,
    laws: str = "liggghts",
    friction: float = 0.5,
    **changes: Any,
) -> Case[Drum]:
    scene = Drum(
        DIAMETER, LENGTH, WALL, 1.0, rest_speed=3e-3, grain_count=COUNT, start_up=0.25, revolutions=1.0
    )
    grains = GrainPopulation(shape or ClumpShape.sphere(1e-3), GRAIN, size_sd=0.0)
    contact = Interaction(0.5, friction, 0.05)
    return Case(
        replace(scene, **changes), grains, contact, contact,
        seed=seed, laws=PRESETS[laws],
    )  # fmt: skip


def exported(case: Case[Any]) -> ExportedTest:
    return ExportedTest("small", case, "a test")


def test_the_shell_touches_the_cylinder_and_the_ends_close_it() -> None:
    texts = drum_meshes(Lift(exported(drum()), "LIGGGHTS", (Drum,)))
    walls = {
        name: np.array([line.split()[1:] for line in text.splitlines() if "vertex" in line], float)
        for name, text in texts.items()
    }
    corners = walls["shell.stl"].reshape(-1, 3, 3) - np.array([0.0, 0.0, DIAMETER / 2])
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    # nine digits of each corner
    assert np.abs((normals * corners[:, 0]).sum(axis=1)) == pytest.approx(DIAMETER / 2, rel=1e-6)
    assert normals[:, 1] == pytest.approx(0.0, abs=1e-6)
    assert np.ptp(corners[..., 1]) == pytest.approx(LENGTH)
    shell = np.hypot(*corners[..., [0, 2]].reshape(-1, 2).T).max()
    for name, y in {"front.stl": -LENGTH / 2, "back.stl": LENGTH / 2}.items():
        x, along, z = walls[name].T
        assert along == pytest.approx(y)
        assert np.hypot(x, z - DIAMETER / 2).max() >= shell


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"inclination": 0.1, "grain_count": None}, "must be level and .* got inclination = 5.72958 deg"),
        ({"filling": 0.6}, "filled to a half at most: .* filling = 0.6"),
        ({"air_drag": 0.5}, "air_drag = 0.5 /s: left out"),
    ],
)
@pytest.mark.parametrize("code", ["liggghts", "lammps"])
def test_what_no_code_is_given_is_refused_by_name(
    changes: Mapping[str, Any], message: str, code: str
) -> None:
    with pytest.raises(InputError, match=message):
        export_input(exported(drum(laws=code, **changes)), code)


def test_a_mixture_and_other_codes_are_refused_by_name() -> None:
    mixture = ShapeMixture((ROD, ClumpShape.sphere(1e-3)), (0.5, 0.5))
    with pytest.raises(InputError, match="LIGGGHTS is given no drum of a mixture, got 2 shapes"):
        export_input(exported(drum(shape=mixture)), "liggghts")
    for code in ("yade", "deme", "mercurydpm"):
        with pytest.raises(InputError, match=r"must be a lifted-cylinder: .* is given no other, got drum"):
            export_input(exported(drum()), code)


def bed(angle: float) -> np.ndarray:
    """Return places of spheres of 1 mm in a square lattice below a plane of an angle [deg], (n, 3)."""
    along, across, down = np.meshgrid(
        np.arange(-9, 10, 2) * 1e-3, np.arange(-3, 4, 2) * 1e-3, -3e-3 - np.arange(3) * 2e-3
    )
    turn = math.radians(angle)
    x = along * math.cos(turn) + down * math.sin(turn)
    z = down * math.cos(turn) - along * math.sin(turn)
    # high at -x, where the turning shell lifts the bed
    return np.stack([x, across, z + DIAMETER / 2], axis=-1).reshape(-1, 3)


def frame(step: int, places: np.ndarray) -> str:
    rows = "".join(f"{i} 1 {x:.9g} {y:.9g} {z:.9g} 0.001\n" for i, (x, y, z) in enumerate(places, 1))
    head = f"ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF ATOMS\n{len(places)}\nITEM: BOX BOUNDS ff ff ff\n"
    return f"{head}-1 1\n-1 1\n-1 1\nITEM: ATOMS id type x y z radius\n{rows}"


def looked_at(folder: Path, angles: list[float]) -> Case[Drum]:
    """Write a filled drum, and looks at it at these angles from its start-up to its end [deg]."""
    case = drum(grain_count=None, start_up=0.5, revolutions=0.5)
    (folder / FILLED_FILE).write_text(frame(1000, bed(0.0)), encoding="utf-8")
    # half a revolution takes half a second
    times = np.linspace(0.5, 1.001, len(angles))
    steps = 1000 + np.ceil(times / case.time_step).astype(int)
    text = "".join(frame(step, bed(angle)) for step, angle in zip(steps.tolist(), angles, strict=True))
    (folder / TURNED_FILE).write_text(text, encoding="utf-8")
    return case


@pytest.mark.parametrize("code", ["liggghts", "lammps"])
def test_a_plane_bed_has_its_angle(tmp_path: Path, code: str) -> None:
    # the first look only begins the measuring
    case = looked_at(tmp_path, [10.0, *[28.0, 32.0] * 20])
    result = Driver(code).read(replace(case, laws=PRESETS[code]), tmp_path)
    seen = result.observables
    assert result.status == "finished"
    # nine digits of each place
    for name in ("dynamic_angle", "upper_angle", "lower_angle", "mass_angle"):
        assert seen[name] == pytest.approx(30.0, abs=1e-4)
    assert seen["dynamic_angle_sd"] == pytest.approx(2.0, abs=1e-4)
    assert (seen["grain_count"], seen["grains_lost"]) == (120.0, 0.0)
    # half a grain above the highest centres
    assert seen["fill_height"] == pytest.approx(DIAMETER / 2 - 3e-3 + 0.5e-3)
    assert len(result.positions) == 120


def test_a_missing_or_a_broken_dump_is_no_answer(tmp_path: Path) -> None:
    case = looked_at(tmp_path, [30.0] * 10)
    path = tmp_path / TURNED_FILE
    whole = path.read_text(encoding="utf-8")
    few = whole[: whole.index("ITEM: TIMESTEP", len(whole) // 2)]
    for text, message in {
        few: "ends before the drum has turned 0.5 times",
        whole[:-200]: f"^{TURNED_FILE}, line .*: must be a complete frame with its time step",
        whole.replace("ITEM: TIMESTEP\n", "ITEM: TIMESTEP\n-"): "must be a complete frame",
        whole.replace("x y z radius", "x y z", 1): "needs the columns x y z",
        whole.replace(" 0.001", " nan", 1): "a sphere must be x y z r",
    }.items():
        path.write_text(text, encoding="utf-8")
        with pytest.raises(AnswerError, match=message):
            Driver("liggghts").read(case, tmp_path)
    path.unlink()
    with pytest.raises(AnswerError, match=f"the program wrote no {TURNED_FILE}"):
        Driver("liggghts").read(case, tmp_path)


@pytest.mark.parametrize("code", CODES)
def test_clumps_stay_in_the_drum_with_the_volume_of_the_union_of_their_spheres(code: str) -> None:
    case = drum(shape=ROD, laws=code, grain_count=80, start_up=0.1, revolutions=0.1)
    [result] = ProgramEngine(Driver(code))([case])
    assert result.status == "finished", result.reason
    seen = result.observables
    assert (seen["grain_count"], seen["grains_lost"]) == (80.0, 0.0)
    # nine digits of each radius
    volume = seen["solid_fraction"] * case.scene.volume_below(seen["fill_height"])
    assert volume == pytest.approx(80 * ROD.volume, rel=1e-6)


@pytest.mark.parametrize("code", CODES)
def test_the_dynamic_angle_is_ours(code: str) -> None:
    cases = [drum(seed, laws=code) for seed in (1, 2)]
    there, here = ProgramEngine(Driver(code))(cases), simulate(cases, device="cpu")
    assert [result.status for result in (*there, *here)] == ["finished"] * 4, there[0].reason
    theirs, ours = (
        np.array([[r.observables["dynamic_angle"], r.observables["dynamic_angle_se"]] for r in results]).T
        for results in (there, here)
    )
    # other fillings at random: three standard errors of the difference of the means
    error = np.sqrt((theirs[1] ** 2).sum() + (ours[1] ** 2).sum()) / 2
    assert abs(theirs[0].mean() - ours[0].mean()) < 3.0 * error
    # and the errors are so small that the test says something: with a shell that does not turn, or turns the
    # other way, the bed is ten degrees lower
    assert 3.0 * error < 5.0
