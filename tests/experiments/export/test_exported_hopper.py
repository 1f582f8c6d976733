"""Hopper in LIGGGHTS: its walls, the reading of its weighed discharge, and its flow rate next to ours."""

import math
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
from experiments.export.lift import Lift
from experiments.export.liggghts_hopper import DISCHARGE_FILE, FILLED_FILE, hopper_meshes
from experiments.io.errors import InputError

COUNT, MASS = 500, 4.0 / 3.0 * math.pi * 1e-9 * GRAIN.density
"""Number and mass of the grains [kg]."""


def hopper(seed: int = 1, shape: ClumpShape | ShapeMixture | None = None, **changes: Any) -> Case[Hopper]:
    scene = Hopper(0.02, 0.02, 0.012, WALL, rest_speed=3e-3, grain_count=COUNT)
    grains = GrainPopulation(shape or ClumpShape.sphere(1e-3), GRAIN, size_sd=0.0)
    friction = Interaction(0.5, 0.3, 0.05)
    return Case(
        replace(scene, **changes), grains, friction, friction,
        seed=seed, laws=PRESETS["liggghts"],
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
    for code in ("lammps", "yade", "deme", "mercurydpm"):
        with pytest.raises(InputError, match=r"be a lifted-cylinder.*: .* is given no other, got hopper"):
            export_input(exported(hopper()), code)
    mixture = ShapeMixture((ROD, ClumpShape.sphere(1e-3)), (0.5, 0.5))
    with pytest.raises(InputError, match="LIGGGHTS is given no hopper of a mixture, got 2 shapes"):
        export_input(exported(hopper(shape=mixture)), "liggghts")


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


@pytest.mark.program("liggghts")
def test_clumps_are_weighed_as_the_union_of_their_spheres() -> None:
    case = hopper(shape=ROD, diameter=0.03, outlet=0.018, grain_count=80)
    [result] = ProgramEngine(Driver("liggghts"))([case])
    assert result.status == "finished", result.reason
    seen = result.observables
    # nine digits of each radius
    assert seen["filled_mass"] == pytest.approx(80 * GRAIN.density * ROD.volume, rel=1e-6)
    assert seen["fallen_mass"] + seen["mass_left"] == pytest.approx(seen["filled_mass"], rel=1e-6)
    assert seen["grain_count"] == 80
    assert 0.0 < seen["fallen_mass"] < seen["filled_mass"]


@pytest.mark.program("liggghts")
def test_the_flow_rate_is_ours() -> None:
    cases = [hopper(seed) for seed in (1, 2)]
    there, here = ProgramEngine(Driver("liggghts"))(cases), simulate(cases, device="cpu")
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
