"""Material cards: what a campaign found, read back as a study's material."""

import re
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from commandline import dem_warp

from doe import Sample
from experiments.calibrate import Campaign
from experiments.io.errors import StudyError
from experiments.report.clump_files import gather_clumps
from experiments.report.material_card import CARD, material_card, write_material_card
from experiments.studyfile import Study, load_card, load_study

TEST = """
name = "Another test of the same material"
material = "material.toml"

[scene.lifted-cylinder]
diameter = "50 mm"
height = "80 mm"
"""


@pytest.fixture
def card(campaign: Campaign, study: Study, tmp_path: Path) -> Path:
    path = write_material_card(campaign, study, tmp_path)
    assert path == tmp_path / CARD
    return path


def test_another_study_has_the_calibrated_material(
    card: Path, campaign: Campaign, study: Study, tmp_path: Path
) -> None:
    (tmp_path / "test.toml").write_text(TEST, encoding="utf-8")
    case, calibrated = (
        load_study(tmp_path / "test.toml").case({}, 1),
        study.case(campaign.optimum.settings, 1),
    )
    assert case.scene.diameter == 0.050
    # Clump, sizes, materials and contacts, to the bit.
    assert case.to_dict()["grains"] == calibrated.to_dict()["grains"]
    assert (case.grain_grain, case.grain_wall) == (calibrated.grain_grain, calibrated.grain_wall)
    assert case.scene.wall_material == calibrated.scene.wall_material


def test_a_factor_and_the_studys_own_values_come_before_the_card(card: Path, tmp_path: Path) -> None:
    own = "[contact.grain-wall]\nrestitution = 0.7\n"
    factor = '[[factor]]\nname = "E"\nlabel = "friction"\nparameter = "contact.grain-grain.static_friction"\n'
    text = f"{TEST}\n{own}\n{factor}low = 0.1\nhigh = 0.3\n"
    (tmp_path / "test.toml").write_text(text, encoding="utf-8")
    case = load_study(tmp_path / "test.toml").case({}, 1)
    assert case.grain_grain.static_friction == pytest.approx(0.2)
    assert case.grain_wall.restitution == 0.7


def test_a_card_tells_what_was_fitted_and_what_is_as_good(card: Path, campaign: Campaign) -> None:
    facts = tomllib.loads(card.read_text(encoding="utf-8"))
    angle = facts["fitted"]["response"]["angle"]
    optimum, target = campaign.optimum, campaign.target.leading
    assert {key: angle[key] for key in ("mean", "sd", "n")} == {
        "mean": "30.148 deg",
        "sd": "0.518 deg",
        "n": 5,
    }
    assert facts["fitted"]["outcome"] == campaign.outcome.value
    assert facts["compatible"]["factors"] == ["E", "F"]
    for name in ("E", "F"):
        entry = facts["factor"][name]
        # Four digits.
        assert entry["chosen"] == pytest.approx(optimum.point[name], rel=5e-4)
        assert entry["low"] == pytest.approx(optimum.region.ranges["low"][name], rel=5e-4)
        assert entry["not_explored_beyond"] == ["low", "high"]
        assert entry["identified"] == (name not in optimum.unidentified)
    points = np.array(facts["compatible"]["points"])
    assert 30 < len(points) <= 60
    # Each is compatible: the fit and the target agree within both errors, here within 4 of them together.
    fitted = campaign.surface.leading.reduced.predict(pd.DataFrame(points, columns=["E", "F"]))
    error = np.hypot(fitted["se"], Sample(target.mean, target.sd, target.n).se)
    assert (np.abs(fitted["mean"] - target.mean) < 4.0 * error).all()


def test_a_card_says_which_other_solver_made_it(campaign: Campaign, study: Study) -> None:
    other = study.with_engine({"command": "python3 solver.py"})
    assert material_card(campaign, campaign.optimum, other)["fitted"]["engine"] == "python3 solver.py"
    assert "engine" not in material_card(campaign, campaign.optimum, study)["fitted"]


def test_a_campaign_without_a_point_has_no_card(campaign: Campaign, study: Study, tmp_path: Path) -> None:
    assert write_material_card(replace(campaign, optimum=None), study, tmp_path) is None
    assert list(tmp_path.iterdir()) == []


def test_the_settings_of_a_card_are_those_of_the_study(campaign: Campaign, study: Study) -> None:
    sections = material_card(campaign, campaign.optimum, study)["material"]
    assert sections["grain"]["density"] == "698 kg/m^3"
    assert sections["grain"]["shear_modulus"] == "34.325 MPa"
    assert sections["contact"]["grain-grain"]["static_friction"] == campaign.optimum.point["E"]


@pytest.mark.parametrize(
    ("content", "rule"),
    [
        (None, "card.toml: no such file"),
        (
            "[material.scene]\nx = 1",
            r"card.toml: is not a material card, which has the tables \[material.grain\]",
        ),
        ("x = ", "card.toml:1: is not valid TOML"),
    ],
)
def test_what_is_no_card_is_refused(tmp_path: Path, content: str | None, rule: str) -> None:
    if content is not None:
        (tmp_path / "card.toml").write_text(content, encoding="utf-8")
    (tmp_path / "test.toml").write_text(TEST.replace("material.toml", "card.toml"), encoding="utf-8")
    with pytest.raises(StudyError, match=rule):
        load_study(tmp_path / "test.toml")


def test_a_card_of_another_version_is_refused(card: Path) -> None:
    card.write_text(card.read_text(encoding="utf-8").replace("format = 1", "format = 2"), encoding="utf-8")
    with pytest.raises(StudyError, match=r"format: must be 1: another version .* wrote the card, got 2"):
        load_card(card)


def test_a_card_in_the_place_of_a_study_is_called_a_card(card: Path) -> None:
    with pytest.raises(StudyError, match=r"this file is a material card, not a study") as refused:
        load_study(card)
    assert "{" not in str(refused.value)


def test_two_clumps_of_one_name_stay_two(tmp_path: Path) -> None:
    files = {"a/grain.txt": "0 0 0 1\n", "b/grain.txt": "0 0 0 2\n", "c/grain.txt": "0 0 0 1\n"}
    for name, text in files.items():
        (tmp_path / name).parent.mkdir()
        (tmp_path / name).write_text(text, encoding="utf-8")
    sections = {"grain": {"shapes": {name: {"clump": name} for name in files}}}
    folder = tmp_path / "out"
    gather_clumps(sections, tmp_path, folder, "material-")
    copies = {name: shape["clump"] for name, shape in sections["grain"]["shapes"].items()}
    assert {name: (folder / copy).read_text(encoding="utf-8") for name, copy in copies.items()} == files
    assert sorted({*copies.values()}) == ["material-grain-2.txt", "material-grain.txt"]


def test_what_a_card_lacks_is_said_where_it_is_exported(card: Path, tmp_path: Path) -> None:
    text = card.read_text(encoding="utf-8")
    bare = card.with_name("bare.toml")
    bare.write_text(
        re.sub(r"\[(material\.solver|fitted\.(numerics|measurement))\][^\[]*", "", text), encoding="utf-8"
    )
    lacking = (
        "the card lacks its contact laws ([material.solver]; 'edem' is taken), modulus scale and time step"
    )
    for path, said in ((card, False), (bare, True)):
        code, _, messages = dem_warp("export", path, "--to", "edem", "--out", tmp_path / path.stem)
        readme = (tmp_path / path.stem / "README.md").read_text(encoding="utf-8")
        assert (code, lacking in " ".join(messages.split()), lacking in readme) == (0, said, said)
