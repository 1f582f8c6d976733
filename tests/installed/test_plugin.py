"""A package from outside, installed, adds a law, a scene, a mechanism, a design and an engine."""

import json
import shutil
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from installation import Installed, build, pip

TESTS = Path(__file__).resolve().parents[1]
SMALL = (TESTS / "experiments" / "small.toml").read_text(encoding="utf-8")
CORNERS = """
[campaign.screening]
design = "corners"

[campaign.selection]
at_least = 1  # two corners have no noise to compare an effect with
"""
MAGNETS = {"grain-magnets": "1.0"}
TUBE = '[scene.lifted-cylinder]\ndiameter = "28 mm"\nheight = "28 mm"\ngrain_count = 30\n'
JAR = '[scene.jar]\ndiameter = "12 mm"\nheight = "20 mm"\ngrain_count = 10\n'


@pytest.fixture(scope="module")
def plugged(installed: Installed, tmp_path_factory: pytest.TempPathFactory) -> Installed:
    """Install the wheel of this tree and the package from outside."""
    folder = tmp_path_factory.mktemp("plugin")
    wheel = build(TESTS / "plugin", ("pyproject.toml", "grain_magnets"), folder)
    pip("install", wheel, "--target", folder / "site")
    (folder / "work").mkdir()
    return replace(installed, sites=(*installed.sites, folder / "site"), work=folder / "work")


def probe(installation: Installed) -> dict[str, Any]:
    printed = installation.python(Path(__file__).with_name("probe.py"), TESTS / "dem_warp")
    return json.loads(printed.splitlines()[-1])


@pytest.fixture(scope="module")
def alone(installed: Installed) -> dict[str, Any]:
    return probe(installed)


@pytest.fixture(scope="module")
def together(plugged: Installed) -> dict[str, Any]:
    return probe(plugged)


def test_additions_of_a_package_follow_the_built_in_entries(
    alone: dict[str, Any], together: dict[str, Any]
) -> None:
    added = {
        "laws": "magnetism",
        "scenes": "jar",
        "designs": "corners",
        "engines": "cones",
        "exporters": "leaflet",
    }
    assert alone["warnings"] == []
    for kind, name in added.items():
        assert together[kind] == [*alone[kind], name]


def test_an_entry_that_cannot_be_used_is_named_and_skipped(together: dict[str, Any]) -> None:
    missing, taken, unknown = together["warnings"]
    assert missing.startswith(
        "package grain-magnets, entry forgotten = grain_magnets.forgotten:Nothing of dem_"
    )
    assert "No module named 'grain_magnets.forgotten'" in missing
    assert taken.endswith("dem_warp.laws: skipped, ValueError: the name is in use")
    assert "Parameter.unit: must be one of 1, m, " in unknown


def test_a_law_acts_in_a_contact_of_two_grains(together: dict[str, Any]) -> None:
    # Its force is the mechanism's size, half a millinewton; a step's speed is rounded to 1e-13 of itself.
    assert together["force"] == pytest.approx(0.5e-3, rel=1e-12)
    assert together["accelerations"] == [pytest.approx(0.5e-3, rel=1e-9)]


def test_cases_without_the_package_keep_their_keys(alone: dict[str, Any], together: dict[str, Any]) -> None:
    assert together["approach"] == alone["approach"] != 0.0
    assert together["key"] == alone["key"]
    assert together["keys by engine"] != [alone["key"]]


def test_its_law_and_its_scene_conform(plugged: Installed) -> None:
    shutil.copy(TESTS / "plugin" / "conformance.py", plugged.work)
    plugged.python("-m", "pytest", "-q", "-p", "no:cacheprovider", "conformance.py")


def test_a_scene_is_simulated(plugged: Installed) -> None:
    (plugged.work / "jar.toml").write_text(SMALL.replace(TUBE, JAR), encoding="utf-8")
    printed = plugged.dem_warp("heap", "jar.toml", "--device", "cpu", "--out", "jar", "--json")
    heap = json.loads(printed)
    assert (heap["status"], heap["observables"]["grain_count"]) == ("finished", 10.0)
    # Ten spheres of 2 mm in a jar of 12 mm lie in three layers at the most.
    assert 1e-3 < heap["observables"]["fill_height"] < 6e-3


def test_doctor_lists_the_package_and_its_entries(plugged: Installed) -> None:
    found = json.loads(plugged.dem_warp("doctor", "--json"))
    [listed] = (each["text"] for each in found if each["name"] == "plug-in")
    assert listed.startswith("grain-magnets 1.0 (designs: corners; engines: cones; exporters: leaflet; ")


def test_a_study_is_exported(plugged: Installed) -> None:
    (plugged.work / "leaves.toml").write_text(SMALL, encoding="utf-8")
    plugged.dem_warp("export", "leaves.toml", "--to", "leaflet", "--approximate", "--out", "leaflet")
    assert "mu = " in (plugged.work / "leaflet" / "leaflet.txt").read_text(encoding="utf-8")


def test_a_campaign_runs_with_its_design_on_its_engine(plugged: Installed) -> None:
    (plugged.work / "magnets.toml").write_text(SMALL + CORNERS, encoding="utf-8")
    words = ("calibrate", "magnets.toml", "--device", "cpu", "--engine", "cones", "--out", "out", "--json")
    found = json.loads(plugged.dem_warp(*words))
    assert found["outcome"] == "calibrated"
    # The cone's slope is 15 degrees and 30 more for a friction of 1, its noise 0.2 degrees.
    assert found["optimum"]["point"]["E"] == pytest.approx(0.5, abs=0.02)
    results = json.loads((plugged.work / "out" / "results.json").read_text(encoding="utf-8"))
    assert results["provenance"]["engine"] == {"engine": "cones"}
    # what made the results is with them, and in the card
    assert results["provenance"]["versions"]["grain-magnets"] == "1.0"
    assert json.loads((plugged.work / "out" / "study.json").read_text("utf-8"))["plug-ins"] == MAGNETS
    card = tomllib.loads((plugged.work / "out" / "material.toml").read_text(encoding="utf-8"))
    assert card["fitted"]["plug-ins"] == MAGNETS
    plugged.dem_warp(*words, "--resume")
    plugged.dem_warp("export", "out/material.toml", "--to", "leaflet", "--approximate", "--out", "card")
    design = pd.read_csv(plugged.work / "out" / "tables" / "screening_design.csv")
    assert design["E"].tolist() == [-1.0, 1.0] * 4
