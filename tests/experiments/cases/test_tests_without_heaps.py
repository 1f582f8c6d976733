"""Tests that leave no heap: alone, in a search, from a file, with walls of several materials."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from small_study import ANGLE, TUBE

from dem_warp import Drum, Interaction, WallPart
from doe.discrepancy import Point
from experiments.cases import OwnWorkers, Store, run_cases
from experiments.cases.store.outcome_table import OutcomeTable
from experiments.discover.engine_simulator import EngineSimulator
from experiments.discover.search import Search
from experiments.export import ExportedTest
from experiments.io.errors import InputError
from experiments.measurement import measured_file, measured_target, measured_template
from experiments.studyfile import Study, load_study

WriteStudy = Callable[..., Path]

DRUM = """[scene.drum]
diameter = "32 mm"
length = "12 mm"
rotation_rate = "1 1/s"
start_up = 0.0
revolutions = 0.1
rest_speed = "0.05 m/s"
"""
FAST = '[condition.base]\n[condition.fast]\nscene.drum.rotation_rate = "2 1/s"\n'
MEASURABLE = [
    "fill_height", "solid_fraction", "dynamic_angle", "upper_angle", "lower_angle", "mass_angle",
    *(f"surface_{number}" for number in range(1, 10)),
]  # fmt: skip


@pytest.fixture
def drum(write_study: WriteStudy) -> Study:
    return load_study(write_study((TUBE, DRUM), (ANGLE, ""), add=FAST))


def test_a_drum_is_searched_with_what_a_laboratory_measures_of_it(drum: Study, tmp_path: Path) -> None:
    assert [each.name for each in drum.measurable] == MEASURABLE
    search = Search.of(drum)
    assert "plate_tilt" not in search.space.names  # a drum has no plate
    table = OutcomeTable(tmp_path / "o.sqlite")
    with EngineSimulator(drum, search.library, table, OwnWorkers("cpu", 1)) as simulator:
        assert list(simulator.observables) == MEASURABLE
        points = [Point((0.4,), (), name, 1) for name in ("base", "fast")]
        found = simulator(points)
        assert found.reasons == ("", "")
        rows = found.values  # noqa: PD011  (an array)
        slow, fast = (dict(zip(MEASURABLE, row, strict=True)) for row in rows)
        assert np.isfinite([*slow.values(), *fast.values()]).all()
        assert slow["dynamic_angle"] != fast["dynamic_angle"]


def test_a_table_to_fill_in_has_the_observables_of_the_test(drum: Study, tmp_path: Path) -> None:
    path = measured_template.write_measured_template(drum, tmp_path)
    text = path.read_text(encoding="utf-8")
    assert all(f",{name}," in text for name in MEASURABLE)
    assert "flank_angle" not in text
    assert "photograph of the heap" not in text
    filled = text.replace("base,1,dynamic_angle,,deg", "base,1,dynamic_angle,31.5,deg")
    filled = filled.replace("base,2,fill_height,,mm", "base,2,fill_height,11,mm")
    path.write_text(filled, encoding="utf-8")
    measured = measured_file.read_measured(path, drum)
    assert measured.observables == ("fill_height", "dynamic_angle")
    assert measured.only(["dynamic_angle"]).observables == ("dynamic_angle",)


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ("base,1,height,12,mm,", "m.csv:2: observable: must be an observable or 'clogged'"),
        ("base,1,dynamic_angle,95,deg,", "dynamic_angle must be between 0 and 90 deg in this test"),
        ("base,1,fill_height,11,,", "fill_height must be between 0.0017 and .* Check the unit"),
        (
            "base,1,,,,drum.jpg",
            "m.csv:2: picture: has no measurable drum: .*drum.jpg: not a picture",
        ),
    ],
)
def test_a_measurement_that_the_test_cannot_give_is_refused(
    drum: Study, tmp_path: Path, row: str, message: str
) -> None:
    path = tmp_path / "m.csv"
    path.write_text(f"condition,replicate,observable,value,unit,picture\n{row}\n", encoding="utf-8")
    (tmp_path / "drum.jpg").write_bytes(b"")
    with pytest.raises(InputError, match=message):
        measured_file.read_measured(path, drum)


def test_a_file_of_measurements_is_the_target_of_a_drum(write_study: WriteStudy, tmp_path: Path) -> None:
    rows = "\n".join(f"base,{number},dynamic_angle,{angle},deg" for number, angle in enumerate((31, 33, 32)))
    (tmp_path / "m.csv").write_text(f"condition,replicate,observable,value,unit\n{rows}\n", encoding="utf-8")
    target = '[target]\nobservable = "dynamic_angle"\nfile = "m.csv"\n'
    study, _ = measured_target.with_measurements(load_study(write_study((TUBE, DRUM), (ANGLE, target))))
    leading = study.target.leading
    assert (leading.observable, leading.unit) == ("dynamic_angle", "deg")
    assert (leading.measured.mean, leading.measured.sd, leading.measured.n) == (32.0, 1.0, 3)


def test_photographs_give_no_angle_of_a_heap_to_a_drum(write_study: WriteStudy) -> None:
    path = write_study((TUBE, DRUM), (ANGLE, '[target]\npictures = "photos"\n'))
    with pytest.raises(InputError, match=r"pictures: photographs give only the observable dynamic_angle or"):
        measured_target.with_measurements(load_study(path))


SEVERAL = """
[response-scene.bin.hopper]
diameter = "28 mm"
fill_depth = "20 mm"
outlet = "20 mm"

[response-scene.box.draw-down]
width = "50 mm"
depth = "12 mm"
fill_depth = "24 mm"
slot = "18 mm"
drop = "40 mm"

[[response]]
observable = "dynamic_angle"
mean = "32 deg"
sd = "1 deg"
n = 3

[[response]]
observable = "mass_left"
scene = "bin"
mean = "1 g"
sd = "0.1 g"
n = 3

[[response]]
observable = "filled_mass"
scene = "box"
mean = "1 g"
sd = "0.1 g"
n = 3
"""


def test_several_tests_of_one_grain_are_simulated_in_one_campaign(
    write_study: WriteStudy, tmp_path: Path
) -> None:
    study = load_study(write_study((TUBE, DRUM), (ANGLE, ""), add=SEVERAL))
    assert study.target.leading.observable == "dynamic_angle"
    table = pd.DataFrame({"seed": [1, 2, 3], "scene": ["target", "bin", "box"], "E": [0.4] * 3})
    cases = run_cases(study, table, Store(tmp_path), OwnWorkers("cpu", 1))
    assert cases["status"].tolist() == ["finished"] * 3
    assert np.isfinite([cases["dynamic_angle"][0], cases["mass_left"][1], cases["filled_mass"][2]]).all()


WALLS = """
[walls.front]
static_friction = 0.1
density = "2500 kg/m^3"

[[factor]]
name = "S"
label = "friction on the shell"
parameter = "walls.shell.static_friction"
low = 0.2
high = 0.8
"""


def test_a_study_has_walls_of_several_materials(write_study: WriteStudy) -> None:
    study = load_study(write_study((TUBE, DRUM), (ANGLE, ""), add=WALLS))
    front, shell = study.case({"S": 0.7}, seed=1).wall_parts
    assert (front.name, shell.name) == ("front", "shell")
    assert (front.material.density, shell.material.density) == (2500.0, 7800.0)
    assert front.surface == Interaction(0.5, 0.1, 0.05)
    assert shell.surface == Interaction(0.5, 0.7, 0.05)


def test_a_test_with_walls_of_several_materials_leaves_for_no_other_code(drum: Study) -> None:
    case = drum.case({}, seed=1)
    parts = (WallPart("ends", case.scene.wall_material, case.grain_wall),)
    with pytest.raises(InputError, match="must be of one material, but ends have their own"):
        ExportedTest("a drum", type(case)(**{**vars(case), "wall_parts": parts}), "here")


def test_a_drum_of_a_study_has_its_options(write_study: WriteStudy) -> None:
    options = 'inclination = "30 deg"\nfilling = 0.4\npicture = "silhouette"\ncamera_distance = "300 mm"\n'
    scene = load_study(write_study((TUBE, DRUM + options), (ANGLE, ""))).case({}, seed=1).scene
    assert isinstance(scene, Drum)
    assert (scene.picture, scene.camera_distance, scene.filling) == ("silhouette", 0.3, 0.4)
    assert scene.inclination == pytest.approx(np.pi / 6, rel=1e-12)


def test_a_bulk_density_is_the_solid_fraction_of_a_search_and_itself_as_a_target(
    write_study: WriteStudy, tmp_path: Path
) -> None:
    rows = "".join(f"base,{number},bulk_density,{value},g/cm^3\n" for number, value in ((1, 0.35), (2, 0.42)))
    path = tmp_path / "m.csv"
    path.write_text(f"condition,replicate,observable,value,unit\n{rows}", encoding="utf-8")
    drum = load_study(write_study((TUBE, DRUM), (ANGLE, "")))
    measured = measured_file.read_measured(path, drum)
    assert measured.observables == ("solid_fraction",)
    # grains of 700 kg/m3
    [[loose], [dense]] = measured.values["base"]  # noqa: PD011  (an array)
    assert (loose, dense) == pytest.approx((0.5, 0.6), rel=1e-12)
    target = '[target]\nobservable = "bulk_density"\nfile = "m.csv"\n'
    for replaced in ([(TUBE, DRUM)], []):
        study = load_study(write_study(*replaced, (ANGLE, target)))
        leading = measured_target.with_measurements(study)[0].target.leading
        assert (leading.observable, leading.unit, leading.measured.n) == ("bulk_density", "kg/m^3", 2)
        assert leading.measured.mean == pytest.approx(385.0, rel=1e-12)
    path.write_text(path.read_text("utf-8").replace("g/cm^3", "kg/m^3"), encoding="utf-8")
    with pytest.raises(InputError, match="bulk_density must be between 7 and 700 kg"):
        measured_file.read_measured(path, drum)
