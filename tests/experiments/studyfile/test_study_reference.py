"""The reference of the study file, and the defaults that the template names."""

import re
import tomllib
from pathlib import Path

import pytest

from doe.discrepancy import Settings
from experiments.studyfile import load_study, write_template
from experiments.studyfile.campaign import CampaignSettings
from experiments.studyfile.new_study import TEMPLATE
from experiments.studyfile.physics import Physics
from experiments.studyfile.reference import Row, study_reference
from experiments.studyfile.setters import setter_at
from experiments.studyfile.study import MeasurementSection


@pytest.fixture(scope="module")
def rows() -> dict[tuple[str, str], Row]:
    return {(row.section, row.key): row for row in study_reference()}


def test_every_section_and_key_has_its_meaning_in_one_line(rows: dict[tuple[str, str], Row]) -> None:
    assert len(rows) == len(study_reference()) > 150
    for place, row in rows.items():
        assert re.fullmatch(r"\S.*[.)]", row.meaning) or row.meaning.endswith("..."), place
        assert row.kind or not row.key, place


@pytest.mark.parametrize(
    ("section", "key", "kind", "default", "bounds"),
    [
        ("[scene.lifted-cylinder]", "lift_speed", "m/s, cm/s, mm/s", "0.05 m/s", "> 0"),
        ("[scene.lifted-cylinder]", "tilt", "deg, rad", "0 deg", ">= 0, < 90"),
        ("[scene.drum]", "filling", "number", "0.35", "> 0, <= 0.8"),
        ("[mechanism.jkr]", "work_of_adhesion", "J/m^2, mJ/m^2, N/m, mN/m", "0 J/m^2", ">= 0"),
        ("[mechanism.jkr]", "between", '"all" or "grains" or "walls"', '"all"', ""),
        ("[campaign.selection]", "at_most", "whole number", "3", ">= 1"),
        ("[campaign.verification]", "margin", "deg, rad", "", "> 0"),
        ("[solver]", "laws", "text", '"edem"', ""),
    ],
)
def test_a_row_says_unit_default_and_bounds(
    rows: dict[tuple[str, str], Row], section: str, key: str, kind: str, default: str, bounds: str
) -> None:
    row = rows[section, key]
    assert (row.kind, row.default, row.bounds) == (kind, default, bounds)


def test_every_quantity_of_the_physics_can_be_a_factor(rows: dict[tuple[str, str], Row]) -> None:
    # but laws are choices, numbers of which hold with the others
    parts = set(Physics.model_fields) - {"solver"}
    found = 0
    for (section, key), row in rows.items():
        path = section.strip("[]").replace("NAME", "whole")
        if key and path.partition(".")[0] in parts and row.bounds and row.kind != "whole number":
            assert setter_at(f"{path}.{key}").path[-1] == key
            found += 1
    assert found > 60


def test_the_template_names_the_defaults(tmp_path: Path) -> None:
    study = load_study(write_template("grain", tmp_path))
    assert study.campaign == CampaignSettings()
    assert study.measurement.model_dump() == MeasurementSection().model_dump()
    [line] = re.findall(r"^# (settings = .*)#.*these are defaults$", TEMPLATE.read_text(), re.MULTILINE)
    settings = tomllib.loads(line)["settings"]
    assert settings
    assert settings == {name: getattr(Settings(), name) for name in settings}
