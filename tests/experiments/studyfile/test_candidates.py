"""``[[candidate]]`` of a study file: its meaning, its assumptions, and the errors of a wrong one."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from experiments.io.errors import StudyError
from experiments.studyfile import load_study

WriteStudy = Callable[..., Path]

BIN = '[response-scene.bin.hopper]\ndiameter = "30 mm"\nfill_depth = "30 mm"\noutlet = "18 mm"\n'
FLOW = BIN + '[[candidate]]\ntest = "bin"\nobservables = ["flow_rate"]\n'
SLEDGE = '[[candidate]]\ntest = "sledge"\nparameter = "contact.grain-grain.static_friction"\n'


def test_a_candidate_of_a_scene_has_its_errors_sizes_and_minutes(write_study: WriteStudy) -> None:
    add = FLOW + 'sd = "2 g/s"\ncommon = { flow_rate = "3 %" }\nmodel_sd = "1 %"\nrepeats = [4]\n'
    add += 'minutes = [6, 2.5]\nsizes = [{ fill_depth = "90 mm" }]\n'
    (found,) = load_study(write_study(add=add)).candidates
    (reading,) = found.readings
    assert (found.name, found.scene, found.repeats) == ("bin", "bin", (4,))
    assert found.minutes == (6.0, 2.5)
    assert (reading.response.name, reading.response.unit) == ("bin_flow_rate", "kg/s")
    assert reading.sd.at(np.array(5.0)) == pytest.approx(0.002)
    assert reading.common.at(np.array(-5.0)) == pytest.approx(0.15)
    [(words, scene)] = found.sizes
    assert words == "fill_depth 90 mm"
    assert scene.given["hopper"].fill_depth == pytest.approx(0.09)
    assert found.assumed == ()


def test_what_a_candidate_does_not_state_is_assumed_and_said_so(write_study: WriteStudy) -> None:
    (found,) = load_study(write_study(add=SLEDGE)).candidates
    (reading,) = found.readings
    assert (found.name, found.factor, found.scene) == ("sledge of E", "E", "")
    assert min(each.at(np.array(0.4)) for each in (reading.sd, reading.common, reading.model_sd)) > 0.0
    said = "; ".join(found.assumed)
    for part in ("E_sledge: sd 15 %, common 4 % (", "E_sledge: model_sd 5 % (", "sledge: minutes"):
        assert part in said


def test_a_candidate_changes_no_case(write_study: WriteStudy) -> None:
    plain, more = load_study(write_study()), load_study(write_study(add=FLOW + SLEDGE))
    assert plain.case({"E": 0.4}, 1) == more.case({"E": 0.4}, 1)


@pytest.mark.parametrize(
    ("add", "said"),
    [
        ('[[candidate]]\ntest = "bim"\n', "test must be a scene or a method"),
        (FLOW.replace("flow_rate", "angle_of"), "observables must be what the scene measures"),
        (BIN + '[[candidate]]\ntest = "bin"\n', "observables must be what the scene measures"),
        (FLOW + 'parameter = "E"\n', "parameter belongs to a direct reading"),
        (FLOW + 'sd = "2 mm"\n', "sd needs a unit of mass flow"),
        (FLOW + 'sd = { flow = "2 %" }\n', "sd must name observables of the candidate"),
        (FLOW + 'sd = "-2 %"\n', "must not be negative"),
        (FLOW + 'model_sd = "0 %"\n', "model_sd must be positive"),
        (FLOW + "repeats = []\n", "repeats"),
        (FLOW + 'sizes = [{ fill_depth = "-1 mm" }]\n', "must be"),
        (FLOW + "sizes = [{ fil_depth = 1 }]\n", "unknown key"),
        (SLEDGE + 'observables = ["angle"]\n', "belong to a scene"),
        (SLEDGE.replace("static_friction", "rolling_friction"), "parameter must be a factor"),
        ('[[candidate]]\ntest = "rebound"\nparameter = "E"\n', "rebound measures a restitution"),
        (SLEDGE + SLEDGE, "is given twice"),
    ],
)
def test_a_wrong_candidate_is_refused_with_its_place(write_study: WriteStudy, add: str, said: str) -> None:
    with pytest.raises(StudyError) as refused:
        load_study(write_study(add=add))
    assert "candidate" in str(refused.value)
    assert said in str(refused.value)
