"""Programs of other codes: the same rain, the same grains, the same course, and walls that close."""

import ast
import io
import json
import math
import re
import subprocess
from typing import Any

import numpy as np
import pytest
from exported_lift import GRAIN, exported_lift

from dem_warp import Case, ClumpShape
from experiments import export
from experiments.export.deme_exporter import obj_text, thick_tube
from experiments.export.same_rain import template

CLUMP = ClumpShape.from_spheres([[-6e-4, 0.0, 0.0], [7e-4, 1e-4, 0.0], [0.0, 4e-4, 3e-4]], [1e-3, 8e-4, 7e-4])
PROGRAMS = {"yade": "yade", "deme": "deme"}
"""Codes driven by Python, and the laws that they have."""


def exported(laws: str, **changes: Any) -> export.ExportedTest:
    """Return a small lifted cylinder in the laws of a code."""
    return exported_lift(laws, CLUMP, **{"diameter": 0.02, "height": 0.03, "grain_count": 40} | changes)


@pytest.fixture(scope="module")
def inputs() -> dict[str, export.Translation]:
    return {code: export.export_input(exported(laws), code) for code, laws in PROGRAMS.items()}


@pytest.mark.parametrize("code", PROGRAMS)
def test_the_rain_is_ours_grain_by_grain(code: str, inputs: dict[str, export.Translation]) -> None:
    rows = np.genfromtxt(io.StringIO(inputs[code].files["rain.csv"]), delimiter=",", names=True)
    case = exported(PROGRAMS[code]).case
    [world] = case.scene.prepare([case], "cpu")
    drawn = case.grains.draw(40, case.seed)
    assert sorted(rows["size"]) == pytest.approx(sorted(drawn.sizes), rel=1e-8)
    assert (np.diff(rows["release_time"]) >= 0.0).all()
    # every grain is released as it crosses the plane of release, in a step that takes it no farther than this
    plane = case.scene.release(float(world.bounding_radii.max()))
    assert np.abs(rows["z"] - plane).max() <= case.scene.rain_speed * world.time_step
    norms = np.sqrt(sum(rows[name] ** 2 for name in ("qx", "qy", "qz", "qw")))
    assert norms == pytest.approx(1.0, abs=1e-7)


@pytest.mark.parametrize("code", PROGRAMS)
def test_mass_and_inertia_are_those_of_the_union(code: str, inputs: dict[str, export.Translation]) -> None:
    written = json.loads(inputs[code].files["test.json"])
    assert written["masses"] == pytest.approx([GRAIN.density * CLUMP.volume])
    assert written["moments"][0] == pytest.approx(GRAIN.density * CLUMP.volume * CLUMP.inertia_over_mass)
    spheres = np.loadtxt(io.StringIO(inputs[code].files["clump-1.csv"]), delimiter=",", skiprows=1)
    assert spheres == pytest.approx(np.column_stack([CLUMP.centers, CLUMP.radii]), abs=1e-11)
    assert written["time_step"] == exported("yade").case.time_step
    assert inputs[code].warnings == ()
    ast.parse(inputs[code].files["lift.py"])


def test_yade_gets_a_contact_for_every_pair(inputs: dict[str, export.Translation]) -> None:
    written = json.loads(inputs["yade"].files["test.json"])
    among, wall = (
        export.values(export.EXPORTERS["yade"].contact_terms(c))
        for c in export.contacts_of(_case("yade"), 1e-3, 1e-5)
    )
    for found, terms in zip(written["contacts"], (among, wall, wall), strict=True):
        assert {name: found[name] for name in terms} == terms
    assert [found["maxBendPl"] for found in written["contacts"]] == [0.1, 0.2, 0.2]
    # a softened modulus leaves softened: E of the grains is 2 G (1 + v) / 4
    assert written["materials"][0]["young"] == pytest.approx(2.0 * 3e5 * 1.25 / 4.0)


def test_hertz_leaves_for_dem_engine_with_a_modulus_that_gives_its_force() -> None:
    own, hertz = (json.loads(_deme(laws).files["test.json"]) for laws in ("deme", "liggghts"))
    ratio = own["materials"][0]["E"] / hertz["materials"][0]["E"]
    # equal spheres: the circle of overlap has sqrt(2) times Hertz's radius
    assert ratio == pytest.approx(math.sqrt(2.0))


def _deme(laws: str) -> export.Translation:
    return export.export_input(exported(laws), "deme", approximate=True)


def _case(laws: str) -> Case[Any]:
    return exported(laws).case


def test_a_thick_tube_is_closed_and_faces_the_grains() -> None:
    radius, height, thickness, sides = 0.01, 0.03, 0.002, 24
    triangles = thick_tube(radius, height, thickness, sides)
    # divergence: the volume that the surface holds, positive where its normals point out of the wall
    volume = np.linalg.det(triangles).sum() / 6.0
    corner = radius / math.cos(math.pi / sides)
    area = 0.5 * sides * math.sin(2.0 * math.pi / sides) * ((corner + thickness) ** 2 - corner**2)
    assert volume == pytest.approx(area * height, rel=1e-12)
    edges: dict[tuple[int, int], int] = {}
    for line in obj_text(triangles).splitlines():
        if line.startswith("f "):
            a, b, c = map(int, line.split()[1:])
            for edge in ((a, b), (b, c), (c, a)):
                edges[edge] = edges.get(edge, 0) + 1
    assert set(edges.values()) == {1}
    assert all((b, a) in edges for a, b in edges)


def test_a_plate_with_an_end_leaves_as_triangles() -> None:
    for code, laws in PROGRAMS.items():
        translation = export.export_input(exported(laws, plate_diameter=0.05), code)
        written = json.loads(translation.files["test.json"])
        assert written["plate"], code
    assert "plate.obj" in translation.files


def test_mercury_gets_springs_and_dashpots_that_come_to_ours() -> None:
    contact = export.contacts_of(_case("edem"), 1e-3, 1e-5)[0]
    terms, law = export.values(export.EXPORTERS["mercurydpm"].contact_terms(contact)), contact.coefficients
    # its tangential spring is 2/3 x 8 G a, its dashpots root the mass with 4/3 E a and 8 G a
    assert 2.0 / 3.0 * terms["EffectiveShearModulus"] == pytest.approx(law.shear_modulus)
    assert terms["Dissipation"] * math.sqrt(4.0 / 3.0) == pytest.approx(law.damping * math.sqrt(2.0))
    tangential = terms["SlidingDissipation"] * math.sqrt(8.0 * terms["EffectiveShearModulus"])
    assert tangential == pytest.approx(law.damping * math.sqrt(8.0 * law.shear_modulus))


def test_mercury_gets_every_number_that_its_driver_asks_for() -> None:
    files = export.export_input(exported("edem"), "mercurydpm", approximate=True).files
    asked = set(re.findall(r"test::(\w+)", files["lift.cpp"]))
    written = set(re.findall(r"(\w+)(?:\[\])*(?:\[3\])? = ", files["test.h"])) | {"Contact"}
    assert asked <= written


@pytest.fixture
def course(tmp_path: Any, monkeypatch: pytest.MonkeyPatch, inputs: dict[str, export.Translation]) -> Any:
    """Return a course as a program has it, of a tube that is filled to its rim."""
    for name, text in inputs["yade"].files.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    written = json.loads((tmp_path / "test.json").read_text(encoding="utf-8"))
    written["phases"] |= {"strike_off": True, "duration": None}
    (tmp_path / "test.json").write_text(json.dumps(written), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    exec(template("course"), names)
    return names["Course"]()


def _states(heights: list[float], speeds: list[float]) -> tuple[np.ndarray, np.ndarray]:
    positions, velocities = np.zeros((len(heights), 3)), np.zeros((len(heights), 3))
    positions[:, 2], velocities[:, 2] = heights, speeds
    return positions, velocities


def test_a_course_strikes_off_settles_lifts_and_ends(course: Any) -> None:
    falling = np.array([False, False, False, False, False, True])
    full = _states([0.01, 0.031, 0.032, 0.033, 0.034, 0.05], [0.0] * 5 + [-0.5])
    out, then = course.look(0.1, *full, falling)
    assert (out.tolist(), then, course.phase) == ([False, True, True, True, True, True], "", "settle")
    calm = _states([0.01, 0.02], [0.0, 0.0])
    none = np.zeros(2, bool)
    assert course.look(0.2, *calm, none)[1] == ""
    assert course.look(0.3, *calm, none)[1] == "lift"
    # 0.05 m/s: after 0.5 s the tube is above both grains, which must then have been slow for the time of rest
    assert course.look(0.5, *calm, none)[1] == ""
    assert course.look(0.9, *calm, none)[1] == ""
    assert course.look(1.0, *calm, none)[1] == "end"


def test_a_course_takes_out_what_falls_off_and_gives_up_in_time(course: Any) -> None:
    below = _states([0.01, -0.05], [0.0, -1.0])
    assert course.look(0.1, *below, np.zeros(2, bool))[0].tolist() == [False, True]
    restless = _states([0.01, 0.02], [0.3, 0.3])
    with pytest.raises(SystemExit, match="filling"):
        course.look(1e3, *restless, np.zeros(2, bool))


@pytest.mark.program("yade")
def test_yade_runs_the_program_and_leaves_every_grain(tmp_path: Any) -> None:
    test = exported("yade", grain_count=6, height=0.012)
    translation = export.export_input(test, "yade")
    export.write_export(test, "yade", translation, tmp_path)
    subprocess.run(translation.command, cwd=tmp_path, check=True, capture_output=True)
    rows = (tmp_path / translation.heap).read_text().split("radius mol\n")[1].splitlines()
    spheres = np.array([row.split() for row in rows], dtype=float)
    assert (len(spheres), set(spheres[:, 6])) == (18, set(range(1, 7)))
    # sizes of the grains are ours, and no sphere lies under the plate
    drawn = test.case.grains.draw(6, test.case.seed).sizes
    assert sorted(spheres[:, 5]) == pytest.approx(sorted(np.outer(drawn, CLUMP.radii).ravel()), rel=1e-6)
    assert (spheres[:, 4] > 0.8 * spheres[:, 5]).all()
    # the distances within a grain are those of the clump: it has stayed rigid
    for grain, size in zip(np.split(spheres, 6), spheres[::3, 5] / CLUMP.radii[0], strict=True):
        apart = np.linalg.norm(grain[0, 2:5] - grain[1, 2:5])
        assert apart == pytest.approx(size * np.linalg.norm(CLUMP.centers[0] - CLUMP.centers[1]), rel=1e-6)


@pytest.mark.parametrize("code", PROGRAMS)
def test_a_test_that_ends_in_time_does_so_there(code: str) -> None:
    translation = export.export_input(exported(PROGRAMS[code], duration=1.5), code)
    assert json.loads(translation.files["test.json"])["phases"]["duration"] == 1.5
