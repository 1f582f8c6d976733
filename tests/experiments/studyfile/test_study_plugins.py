"""Scenes and mechanisms that the libraries gain: a class and a line, and study files know them."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import pytest

from dem_warp import Hopper
from dem_warp.laws.library import MECHANISMS
from dem_warp.laws.mechanism import Mechanism
from dem_warp.parameters import Parameter, parameters_of
from dem_warp.scenes.library import SCENES
from experiments.io.errors import StudyError
from experiments.studyfile import load_study
from experiments.studyfile.reference import study_reference

WriteStudy = Callable[..., Path]

TUBE = '[scene.lifted-cylinder]\ndiameter = "28 mm"\nheight = "28 mm"\n'
TILTED = """
[scene.tilted-hopper]
diameter = "40 mm"
fill_depth = "30 mm"
outlet = "18 mm"
lean = "9 deg"
"""


@dataclass(frozen=True)
class TiltedHopper(Hopper):
    """A hopper that leans."""

    name = "tilted-hopper"
    lean: Annotated[float, Parameter("rad", at_least=0.0, below=0.5)] = 0.0
    """Angle that it leans by."""


@dataclass(frozen=True, kw_only=True)
class Sticky(Mechanism):
    """Surfaces that stick."""

    name = "sticky"
    strength = "stickiness"
    stickiness: Annotated[float, Parameter("J/m^2", at_least=0.0)] = 0.0
    """Energy of the contact."""


@pytest.fixture(autouse=True)
def grown(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(SCENES._outside, TiltedHopper.name, TiltedHopper)
    monkeypatch.setitem(MECHANISMS._outside, Sticky.name, Sticky)


def test_a_new_scene_has_its_section_with_units_bounds_and_rules(write_study: WriteStudy) -> None:
    scene = load_study(write_study((TUBE, TILTED))).case({}, seed=1).scene
    assert isinstance(scene, TiltedHopper)
    assert scene.lean == pytest.approx(0.15707963267948966, rel=1e-15)
    for wrong, rule in (
        ('lean = "40 deg"', "tilted-hopper.lean: must be less than 28.6"),
        ("lean = 9", "tilted-hopper.lean: needs a unit of angle"),
        ('leen = "9 deg"', "tilted-hopper.leen: unknown key, did you mean 'lean'"),
        ('lean = "9 deg"\nrest_time = "0 s"', "tilted-hopper.rest_time: must be greater than 0"),
    ):
        with pytest.raises(StudyError, match=rule):
            load_study(write_study((TUBE, TILTED.replace('lean = "9 deg"', wrong))))


@pytest.mark.parametrize("written", ['"2 mJ/m^2"', "0.002"])
def test_a_new_mechanism_takes_its_units_and_plain_numbers(write_study: WriteStudy, written: str) -> None:
    study = load_study(write_study(add=f"\n[mechanism.sticky]\nstickiness = {written}\n"))
    assert study.case({}, seed=1).mechanisms == (Sticky(stickiness=0.002),)


def test_the_reference_knows_them() -> None:
    known = {(row.section, row.key): row.meaning for row in study_reference()}
    assert known["[scene.tilted-hopper]", "lean"] == "Angle that it leans by."
    assert known["[mechanism.sticky]", "stickiness"] == "Energy of the contact."


def test_a_number_without_a_unit_is_no_parameter() -> None:
    @dataclass(frozen=True)
    class Careless(Hopper):
        lean: float = 0.0

    with pytest.raises(TypeError, match=r"Careless.lean: a number needs its unit and bounds"):
        parameters_of(Careless)
