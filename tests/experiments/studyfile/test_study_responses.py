"""Further responses of a study file: their meaning, and the errors of a wrong one."""

from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from dem_warp import DrawDown, Drum, Hopper, LiftedCylinder
from doe import Sample
from experiments.io.errors import StudyError
from experiments.io.units import UNITS
from experiments.studyfile import BUCKWHEAT, load_study
from experiments.studyfile.campaign import Response, Target, Twin
from experiments.studyfile.observables import DIMENSIONS

WriteStudy = Callable[..., Path]

RESPONSES = """
[response-scene.bin.hopper]
diameter = "40 mm"
fill_depth = "30 mm"
outlet = "20 mm"

[response-scene.short.lifted-cylinder]
diameter = "28 mm"
height = "14 mm"

[[response]]
observable = "solid_fraction"
mean = 0.55
sd = 0.01
n = 4

[[response]]
name = "outflow"
observable = "flow_rate"
scene = "bin"
mean = "12 g/s"
sd = "0.4 g/s"
n = 5

[[response]]
name = "short_angle"
observable = "angle"
scene = "short"
mean = "25 deg"
sd = "0.6 deg"
n = 5
"""

TWIN = "[target.twin]\ntruth = { E = 0.3 }\n"


def test_responses_are_read_in_si_with_their_scenes(write_study: WriteStudy) -> None:
    study = load_study(write_study(add=RESPONSES))
    assert study.target == Target(
        (
            Response("angle", "angle", "deg", measured=Sample(30.0, 0.5, 5)),
            Response("solid_fraction", "solid_fraction", measured=Sample(0.55, 0.01, 4)),
            Response("outflow", "flow_rate", "kg/s", "bin", Sample(0.012, 0.0004, 5)),
            Response("short_angle", "angle", "deg", "short", Sample(25.0, 0.6, 5)),
        )
    )
    assert list(study.scenes) == ["target", "bin", "short"]


def test_a_bulk_density_is_an_observable_with_its_unit(write_study: WriteStudy) -> None:
    bulk = '[[response]]\nobservable = "bulk_density"\nmean = "0.42 g/cm^3"\nsd = "4 kg/m^3"\nn = 4\n'
    response = load_study(write_study(add=bulk)).target.responses[1]
    assert (response.observable, response.unit) == ("bulk_density", "kg/m^3")
    assert (response.measured.mean, response.measured.sd) == pytest.approx((420.0, 4.0))
    with pytest.raises(StudyError, match="unit of density"):
        load_study(write_study(add=bulk.replace("0.42 g/cm^3", "0.42")))


def test_a_twin_needs_no_measurements_of_its_responses(write_study: WriteStudy) -> None:
    path = write_study(add=f'{TWIN}[[response]]\nobservable = "fill_height"\n')
    responses = (Response("angle", "angle", "deg"), Response("fill_height", "fill_height", "m"))
    assert load_study(path).target == Target(responses, Twin({"E": 0.3}))


def test_a_case_of_a_further_scene_has_the_same_grains_and_contacts(write_study: WriteStudy) -> None:
    study = load_study(write_study(add=RESPONSES))
    heap, outflow = (study.case({"E": 0.3}, seed=1, scene=name) for name in ("target", "bin"))
    assert isinstance(heap.scene, LiftedCylinder)
    assert isinstance(outflow.scene, Hopper)
    assert outflow.scene.wall_material == heap.scene.wall_material
    assert (outflow.grains, outflow.grain_grain, outflow.grain_wall, outflow.numerics) == (
        heap.grains,
        heap.grain_grain,
        heap.grain_wall,
        heap.numerics,
    )
    with pytest.raises(StudyError, match="did you mean 'bin'"):
        study.case({}, seed=1, scene="bim")


def test_a_further_scene_has_only_the_parts_of_walls_that_it_has(write_study: WriteStudy) -> None:
    study = load_study(write_study(add=RESPONSES + "[walls.plate]\nstatic_friction = 0.1\n"))
    parts = {scene: [part.name for part in study.case({}, 1, scene).wall_parts] for scene in study.scenes}
    assert parts == {"target": ["plate"], "bin": [], "short": ["plate"]}


@pytest.mark.parametrize("scale", [None, "bench"])
def test_the_study_from_a_curve_to_a_point_hides_the_same_truth_at_every_scale(scale: str | None) -> None:
    study = load_study(BUCKWHEAT.with_name("curve_to_point.toml"), scale)
    assert [response.scene for response in study.target.responses] == ["target", "target", "bin"]
    assert study.target.twin.truth == {"E": 0.42, "F": 0.27, "G": 0.05}
    assert isinstance(study.case({}, seed=1, scene="bin").scene, Hopper)
    assert {f.name for f in study.factors} == set("EFGH")


@pytest.mark.parametrize("scene", [LiftedCylinder, Hopper, Drum, DrawDown])
def test_every_observable_has_a_unit_that_a_study_can_write(scene: type) -> None:
    observables: Mapping = scene.observables
    assert observables
    for observable in observables.values():
        dimension = DIMENSIONS[observable.unit]
        assert not dimension or UNITS[dimension][observable.unit] == 1.0
