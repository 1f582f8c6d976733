"""Scenes of a study: each in its own table, and the errors of a wrong one."""

import math
from collections.abc import Callable
from pathlib import Path

import pytest

from dem_warp import SCENES, DrawDown, Drum, Hopper
from experiments.io.errors import InputError, StudyError
from experiments.studyfile import load_study, write_template
from experiments.studyfile.loading import BUCKWHEAT

WriteStudy = Callable[..., Path]

TUBE = '[scene.lifted-cylinder]\ndiameter = "28 mm"\nheight = "28 mm"\n'
ANGLE = ('[target]\nmean = "30 deg"\nsd = "0.5 deg"\nn = 5\n', "")
"""The angle of a heap, which no other test leaves, is left out."""
OTHER_TESTS = {
    Hopper: """
[scene.hopper]
diameter = "40 mm"
fill_depth = "30 mm"
outlet = "18 mm"
""",
    Drum: """
[scene.drum]
diameter = "60 mm"
length = "20 mm"
rotation_rate = "30 1/min"
""",
    DrawDown: """
[scene.draw-down]
width = "80 mm"
depth = "20 mm"
fill_depth = "40 mm"
slot = "20 mm"
drop = "50 mm"
""",
}


@pytest.mark.parametrize("kind", OTHER_TESTS)
def test_a_study_may_be_of_another_test(write_study: WriteStudy, kind: type) -> None:
    case = load_study(write_study((TUBE, OTHER_TESTS[kind]), ANGLE)).case({}, seed=1)
    assert type(case.scene) is kind
    assert case.scene.grain_count == 30
    assert case.to_dict()["scene"]["kind"] == kind.__name__
    if kind is Drum:
        assert case.scene.spin == pytest.approx(math.pi, rel=1e-12)


def test_what_a_test_has_can_be_a_factor(write_study: WriteStudy) -> None:
    factor = """
[[factor]]
name = "W"
label = "outlet"
parameter = "scene.hopper.outlet"
low = "12 mm"
high = "20 mm"
"""
    bin_ = OTHER_TESTS[Hopper].replace('outlet = "18 mm"\n', "")
    study = load_study(write_study((TUBE, bin_), ANGLE, add=factor))
    assert study.case({"W": 13.0}, seed=1).scene.outlet == 0.013
    with pytest.raises(StudyError, match=r"Hopper.outlet: must be below .*, got 0.041"):
        study.case({"W": 41.0}, seed=1)
    with pytest.raises(StudyError, match=r"small.toml:\d+: scene.hopper.outlet: must be finite"):
        study.case({"W": math.nan}, seed=1)


@pytest.mark.parametrize(
    ("kind", "wide", "narrow"), [(Hopper, "18 mm", "1 mm"), (DrawDown, 'slot = "20 mm"', 'slot = "1 mm"')]
)
def test_an_outlet_that_no_grain_passes_is_refused(
    write_study: WriteStudy, kind: type, wide: str, narrow: str
) -> None:
    study = load_study(write_study((TUBE, OTHER_TESTS[kind].replace(wide, narrow)), ANGLE))
    with pytest.raises(StudyError, match=r"opening of the [\w-]+ must let grains through.* got 1 mm"):
        study.case({}, seed=1)


def test_the_options_of_a_lifted_cylinder_come_with_their_units(write_study: WriteStudy) -> None:
    options = """tilt = "3 deg"
plate_friction_excess = 0.2
vibration_amplitude = "50 um"
vibration_frequency = "60 Hz"
vibration_hold = "200 ms"
air_drag = "2 1/s"
"""
    scene = load_study(write_study((TUBE, TUBE + options))).case({}, seed=1).scene
    assert scene.tilt == pytest.approx(math.radians(3.0), rel=1e-15)
    assert (scene.plate_friction, scene.plate_friction_excess, scene.air_drag) == (None, 0.2, 2.0)
    vibration = (scene.vibration_amplitude, scene.vibration_frequency, scene.vibration_hold)
    assert vibration == (5e-5, 60.0, 0.2)


def test_a_grain_of_several_spheres_can_be_drawn_out(write_study: WriteStudy) -> None:
    sphere, clump = 'sphere = "2 mm"', f'clump = "{BUCKWHEAT.parent / "clump.txt"}"'
    base = load_study(write_study((sphere, clump))).case({}, seed=1).grains.shape
    longer = load_study(write_study((sphere, f"{clump}\nelongation = 0.3"))).case({}, seed=1).grains.shape
    assert longer == base.elongated(0.3) != base


@pytest.mark.parametrize("test", SCENES)
def test_a_new_study_may_be_of_any_test(tmp_path: Path, test: str) -> None:
    study = load_study(write_template("grain", tmp_path, test))
    assert study.case({}, seed=1).scene.name == test
    [response] = study.target.responses
    assert response.observable in {each.column for each in study.measurable} | {"angle"}


def test_a_new_study_of_an_unknown_test_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"--test: must be one of lifted-cylinder, poured-heap, ledge.*pile"):
        write_template("grain", tmp_path, "pile")
    assert not list(tmp_path.iterdir())
