"""The test that a study is of: each in its own table, and what is said about a wrong one."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import pytest

from dem_warp import DrawDown, Drum, Hopper
from experiments.errors import StudyError
from experiments.study import load_study

WriteStudy = Callable[..., Path]

TUBE = '[scene.lifted-cylinder]\ndiameter = "28 mm"\nheight = "28 mm"\n'
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
    case = load_study(write_study((TUBE, OTHER_TESTS[kind]))).case({}, seed=1)
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
    study = load_study(write_study((TUBE, bin_), add=factor))
    assert study.case({"W": 13.0}, seed=1).scene.outlet == 0.013


@pytest.mark.parametrize(
    ("section", "key", "rule"),
    [
        (OTHER_TESTS[Hopper].replace('"18 mm"', '"41 mm"'), "scene.hopper", "outlet: must be below"),
        (OTHER_TESTS[Hopper].replace('"18 mm"', "18"), "scene.hopper.outlet", "unit of length"),
        (OTHER_TESTS[Hopper].replace("hopper", "hoper"), "scene.hoper", "did you mean 'hopper'?"),
        (OTHER_TESTS[Drum].replace("30 1/min", "300 1/min"), "scene.drum", "rotation_rate: must be below"),
        (OTHER_TESTS[Drum] + TUBE, "scene", "must be one of [scene.lifted-cylinder], [scene.hopper]"),
        ("[scene]\n", "scene", "not 0 of them"),
    ],
)
def test_a_test_that_cannot_be_is_named_with_its_place(
    write_study: WriteStudy, section: str, key: str, rule: str
) -> None:
    path = write_study((TUBE + "grain_count = 30\n", section))
    with pytest.raises(StudyError) as caught:
        load_study(path)
    problem = caught.value.problems[0]
    assert rule in problem.rule
    assert problem.place.startswith(f"{path}")
    assert problem.place.endswith(f": {key}")
