"""Conditions: the same grain tested in other ways."""

from collections.abc import Callable
from pathlib import Path

import pytest

from experiments.io.errors import StudyError
from experiments.studyfile import load_study

WriteStudy = Callable[..., Path]

CONDITIONS = """
[condition.base]

[condition.fast]
held_out = true
scene.lifted-cylinder.lift_speed = "0.25 m/s"

[condition.wide]
scene.lifted-cylinder.diameter = "40 mm"

[scale.stiff.condition.wide]
scene.lifted-cylinder.height = "50 mm"
"""


def test_a_study_without_conditions_has_its_own_test_alone(write_study: WriteStudy) -> None:
    study = load_study(write_study())
    assert [condition.name for condition in study.conditions] == ["base"]
    assert study.under("base").case({"E": 0.3}, 5).to_dict() == study.case({"E": 0.3}, 5).to_dict()


def test_a_condition_changes_what_it_says_and_nothing_else(write_study: WriteStudy) -> None:
    study = load_study(write_study(add=CONDITIONS))
    assert [(c.name, c.held_out) for c in study.conditions] == [
        ("base", False),
        ("fast", True),
        ("wide", False),
    ]
    plain, fast = (study.under(name).case({"E": 0.3}, 5).to_dict() for name in ("base", "fast"))
    assert plain == study.case({"E": 0.3}, 5).to_dict()
    assert fast["scene"].pop("lift_speed") == 0.25
    assert plain["scene"].pop("lift_speed") == 0.05
    assert fast == plain


def test_a_scale_may_change_a_condition(write_study: WriteStudy) -> None:
    wide = load_study(write_study(add=CONDITIONS), scale="stiff").under("wide").case({}, 5)
    assert (wide.scene.diameter, wide.scene.height) == (0.04, 0.05)
    assert wide.numerics.modulus_scale == 1.0


def test_what_a_condition_fixes_no_factor_varies_there(write_study: WriteStudy) -> None:
    known = "\n[condition.base]\n[condition.known]\ncontact.grain-grain.static_friction = 0.9\n"
    study = load_study(write_study(add=known))
    frictions = [
        study.under(c.name).case({"E": 0.3}, 5).grain_grain.static_friction for c in study.conditions
    ]
    assert frictions == [0.3, 0.9]
    with pytest.raises(StudyError, match="must name a factor"):
        study.under("known").case({"X": 0.3}, 5)


def test_a_factor_may_have_several_places(write_study: WriteStudy) -> None:
    both = '["contact.grain-grain.static_friction", "contact.grain-wall.static_friction"]'
    study = load_study(
        write_study(
            ('parameter = "contact.grain-grain.static_friction"', f"parameter = {both}"),
            ("static_friction = 0.4\n", ""),
        )
    )
    case = study.case({"E": 0.3}, 5)
    assert (case.grain_grain.static_friction, case.grain_wall.static_friction) == (0.3, 0.3)
