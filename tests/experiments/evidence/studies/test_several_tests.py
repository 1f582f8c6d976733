"""Studies of several tests that `dem-warp` runs as they are: they are what their pages state."""

import math
from pathlib import Path

import pytest

from experiments.evidence import studies
from experiments.studyfile import Study, load_study

FOLDER = Path(studies.__file__).parent
TO_WEIGHT = 0.26e-3
"""Work of adhesion at which a contact carries a sphere of the powder [J/m2], as its page has it."""


def study_of(name: str, scale: str | None = None) -> Study:
    return load_study(FOLDER / name, scale)


@pytest.mark.parametrize("scale", ["gpu", "bench"])
def test_the_joint_campaign_hides_a_truth_inside_the_ranges_of_every_scale(scale: str) -> None:
    study = study_of("joint/study.toml", scale)
    ranges = {one.name: (one.low, one.high) for one in study.factors}
    truth = study.target.twin.truth
    assert set(truth) == set(ranges)
    assert all(ranges[name][0] < value < ranges[name][1] for name, value in truth.items())
    assert {one.scene for one in study.target.responses} == {"target", "ledge", "press"}
    assert study.case({}, 1).scene.grain_count == (3000 if scale == "gpu" else 300)


def test_the_pull_of_the_powder_is_as_its_page_says() -> None:
    study = study_of("ledge_and_cone/powder.toml")
    case = study.case({"W": TO_WEIGHT}, 1, "cone")
    [shape] = case.grains.mixture.shapes
    radius = float(shape.radii[0])
    [adhesion] = case.mechanisms
    # Johnson, Kendall and Roberts: (3/2) pi W R*, of equal spheres R* = R / 2
    pull = 1.5 * math.pi * adhesion.work_of_adhesion * radius / 2
    weight = case.grain_material.density * shape.volume * 9.81
    assert pull / weight == pytest.approx(1.0, abs=0.01)  # two digits are printed


@pytest.mark.parametrize("scale", ["gpu", "bench"])
def test_the_pellets_meet_a_ledge_eighteen_or_nine_deep(scale: str) -> None:
    study = study_of("ledge_and_cone/pellets.toml", scale)
    box = study.case({}, 1).scene
    assert box.depth / 0.011 == pytest.approx(18 if scale == "gpu" else 9, abs=0.5)
    assert {one.name: one.measured.mean for one in study.target.responses} == {
        "ledge_angle": 41.0,
        "cone": 26.0,
    }
    assert study.case({}, 1, "cone").scene.plate == "grains"
