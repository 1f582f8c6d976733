"""Measured forces on a tool: their means over parts of the depth, the body of a file, and what is refused."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from small_study import ANGLE, TUBE

from dem_warp.scenes.penetration import PENETRATION_OBSERVABLES
from dem_warp.solids import cylinder_mesh
from experiments.io.errors import InputError, StudyError
from experiments.measurement import profile_responses
from experiments.measurement.measured_file import read_measured
from experiments.measurement.profile_files import read_force_curves
from experiments.studyfile import load_study
from experiments.studyfile.observables import FORCE_PROFILE, PROFILES, Instrument, instrument_of

DEPTH = 0.02
OWN = 'tool = "cone"\ntool_diameter = "12 mm"\n'
BIN = '[scene.penetration]\ndiameter = "40 mm"\nfill_depth = "30 mm"\ndepth = "20 mm"\n'
TARGET = '[target]\nobservable = "force_depth"\nprofiles = "p.csv"\n'


def drawn(name: str, slope: float = 1.0, points: int = 201) -> str:
    """Return forces that grow as the square of the depth, 4 N in the end, times a slope."""
    depths = np.linspace(0.0, DEPTH, points)
    return "".join(f"{name},{1e3 * z:.6f} mm,{slope * 4 * (z / DEPTH) ** 2:.9f} N\n" for z in depths)


def file(folder: Path, text: str) -> Path:
    path = folder / "p.csv"
    path.write_text(f"replicate,depth,force\n{text}", encoding="utf-8")
    return path


def test_a_curve_gives_the_mean_force_of_each_part(tmp_path: Path) -> None:
    _, kept, forces, _ = read_force_curves(file(tmp_path, drawn("1")), DEPTH)
    edges = np.arange(6) / 5
    # The integral of 4 x^2 over a fifth; straight lines between points at every 200th are too high by 1e-4.
    assert forces[0] == pytest.approx(5 * 4 / 3 * np.diff(edges**3), abs=1e-4)
    assert kept == list(range(5))
    began_above = drawn("1").replace("1,0.000000 mm", "1,-3 mm,0 N\n1,0.000000 mm")
    assert read_force_curves(file(tmp_path, began_above), DEPTH).heights[0] == pytest.approx(forces[0])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1,5,2 N\n", r"p.csv:2: depth: needs a unit of length"),
        ("1,5 mm,2\n", r"p.csv:2: force: needs a unit of force"),
        (",5 mm,2 N\n", r"p.csv:2: replicate: needs a label"),
        ("1,5 mm,2 N\n1,5 mm,2 N\n", r"p.csv:3: depth: must be larger than in the row before"),
        (drawn("1", points=4), r"replicate 1: points must be at most 4 mm apart, down to the study's"),
        (drawn("1").split("1,19.0")[0], r"down to the study's depth, 20 mm, got 18.9 mm"),
        (drawn("1") + drawn("2"), r"replicate 2 is a copy of replicate 1"),
        ("", r"p.csv: has no rows below"),
    ],
)
def test_a_bad_curve_is_refused(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        read_force_curves(file(tmp_path, text), DEPTH)


def test_curves_become_responses_in_newton(write_study: Callable[..., Path], tmp_path: Path) -> None:
    file(tmp_path, "".join(drawn(str(n), 1 + 0.01 * n * (-1) ** n) for n in (1, 2, 3, 4)))
    study = profile_responses.with_profiles(load_study(write_study((TUBE, BIN + OWN), (ANGLE, TARGET))))
    first = study.target.responses[0]
    assert (first.unit, first.part_of) == ("N", "force_depth")
    assert {name for name, _ in first.weights} == set(PROFILES[FORCE_PROFILE])
    of_heap = load_study(write_study((ANGLE, TARGET)))
    with pytest.raises(InputError, match=r'"force_depth" of a penetration, got force_depth of lifted-'):
        profile_responses.with_profiles(of_heap)


def test_a_search_reads_the_curve_of_a_condition(write_study: Callable[..., Path], tmp_path: Path) -> None:
    file(tmp_path, drawn("1", 0.01))
    conditions = '[condition.base]\n\n[condition.plate]\nscene.penetration.tool = "plate"\n'
    study = load_study(write_study((TUBE, BIN + OWN), (ANGLE, ""), add=conditions))
    assert study.under("plate").case({}, 1).scene.tool == "plate"
    table, head = tmp_path / "measured.csv", "condition,replicate,observable,value,unit,profile\n"
    table.write_text(f"{head}base,1,force_depth,,,p.csv\nbase,1,work,0.4,mJ,\n", encoding="utf-8")
    assert {*PROFILES[FORCE_PROFILE], "work"} <= set(read_measured(table, study).observables)
    # A wrong unit gives a force that no bed bears.
    table.write_text(f"{head}base,1,tip_force_5,40,kN,\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"tip_force_5"):
        read_measured(table, study)


def test_what_a_tool_measures_has_its_instrument(write_study: Callable[..., Path]) -> None:
    study = load_study(write_study((TUBE, BIN + OWN), (ANGLE, "")))
    tested = {each.name for each in study.measurable if instrument_of(each) is Instrument.PENETROMETER}
    assert tested == set(PENETRATION_OBSERVABLES)


def test_a_body_is_read_from_its_file_in_millimetres(
    write_study: Callable[..., Path], tmp_path: Path
) -> None:
    cylinder_mesh(30.0, 10.0).export(tmp_path / "rod.stl")
    study = load_study(write_study((TUBE, f'{BIN}tool = "body"\nbody = "rod.stl"\n'), (ANGLE, "")))
    scene = study.case({}, 0).scene
    assert scene.width == pytest.approx(0.01, abs=1e-8)
    assert scene.tip_height == pytest.approx(0.03, abs=1e-8)
    # Its content is a part of the case: another file of this name is another case.
    assert study.case({}, 0).to_dict()["scene"]["body"]
    assert load_study(study.file).case({}, 0) == study.case({}, 0)


def test_a_study_refuses_impossible_tools(write_study: Callable[..., Path], tmp_path: Path) -> None:
    (tmp_path / "bad.stl").write_text("solid nothing", encoding="utf-8")
    body = 'tool = "body"\nbody = '
    for keys, message in (
        (f'{OWN}speed = "5 m/s"\n', r"scene: Penetration.speed: must be below .* inertial number of 0.3"),
        (f'{body}"none.stl"\n', r"scene.penetration.body: no such file: .*none.stl"),
        (f'{body}"bad.stl"\n', r"scene.penetration.body: .*bad.stl: the surface must be closed"),
        ('tool = "plate"\n', r"Penetration.tool_diameter: needed with tool = 'plate'"),
    ):
        with pytest.raises(StudyError, match=message):
            load_study(write_study((TUBE, BIN + keys), (ANGLE, "")))
