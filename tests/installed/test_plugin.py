"""A package from outside, installed, adds a law, a scene, a mechanism, a design and an engine."""

import json
import shutil
import sys
import tomllib
from contextlib import redirect_stdout
from dataclasses import replace
from io import StringIO
from pathlib import Path
from runpy import run_path
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
TUBE = SMALL[SMALL.index("[scene") : SMALL.index("\n[numerics]")]
JAR = '[scene.jar]\ndiameter = "12 mm"\nheight = "20 mm"\ngrain_count = 10\n'
TABLE = "[scene.table]\ngrain_count = 4\n"


@pytest.fixture(scope="module")
def plugged(installed: Installed, tmp_path_factory: pytest.TempPathFactory) -> Installed:
    """Install the wheel of this tree and the package from outside."""
    folder = tmp_path_factory.mktemp("plugin")
    wheel = build(TESTS / "plugin", ("pyproject.toml", "grain_magnets"), folder)
    pip("install", wheel, "--target", folder / "site")
    (folder / "work").mkdir()
    return replace(installed, sites=(*installed.sites, folder / "site"), work=folder / "work")


COMMANDS = {
    "doctor": "doctor --json",
    "heap": "heap jar.toml --device cpu --out jar --json",
    "table": "heap table.toml --device cpu --out table --json",
    "export": "export leaves.toml --to leaflet --approximate --out leaflet",
    "calibrate": "calibrate magnets.toml --device cpu --engine cones --out out --json",
    "resume": "calibrate magnets.toml --device cpu --engine cones --out out --json --resume",
    "card": "export out/material.toml --to leaflet --approximate --out card",
}


PROBE = (Path(__file__).with_name("probe.py"), TESTS / "dem_warp", TESTS / "experiments")


@pytest.fixture(scope="module")
def alone() -> dict[str, Any]:
    """Run the probe here, where the package is not installed."""
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(StringIO()) as printed:
        patch.setattr(sys, "argv", [*map(str, PROBE), "[]"])
        patch.setattr(sys, "path", [*sys.path])
        run_path(str(PROBE[0]))
    return json.loads(printed.getvalue().splitlines()[-1])


@pytest.fixture(scope="module")
def together(plugged: Installed) -> dict[str, Any]:
    shutil.copy(TESTS / "plugin" / "conformance.py", plugged.work)
    scenes = {"jar": SMALL.replace(TUBE, JAR), "table": SMALL.replace(TUBE, TABLE)}
    for name, text in {**scenes, "leaves": SMALL, "magnets": SMALL + CORNERS}.items():
        (plugged.work / f"{name}.toml").write_text(text, encoding="utf-8")
    words = json.dumps([command.split() for command in COMMANDS.values()])
    found = json.loads(plugged.python(*PROBE, words).splitlines()[-1])
    assert [code for code, _, _ in found["commands"]] == [0] * len(COMMANDS), found["commands"]
    return found | {name: said for name, (_, said, _) in zip(COMMANDS, found["commands"], strict=True)}


def test_additions_of_a_package_follow_the_built_in_entries(
    alone: dict[str, Any], together: dict[str, Any]
) -> None:
    added = {
        "laws": ["magnetism"],
        "scenes": ["jar", "table"],
        "designs": ["corners"],
        "engines": ["cones"],
        "exporters": ["leaflet"],
    }
    for kind, names in added.items():
        assert together[kind] == [*alone[kind], *names]


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


def test_its_law_and_its_scene_conform(together: dict[str, Any]) -> None:
    assert together["conformance"] == 0


def test_a_scene_is_simulated(together: dict[str, Any]) -> None:
    heap = json.loads(together["heap"])
    assert (heap["status"], heap["observables"]["grain_count"]) == ("finished", 10.0)
    # Ten spheres of 2 mm in a jar of 12 mm lie in three layers at the most.
    assert 1e-3 < heap["observables"]["fill_height"] < 6e-3


def test_a_scene_may_place_its_grains(together: dict[str, Any]) -> None:
    table = json.loads(together["table"])
    assert (table["status"], table["observables"]["grain_count"]) == ("finished", 4.0)
    # the study's spheres of 2 mm, with a spread of sizes of 5 %, stand on it
    assert table["observables"]["mean_height"] == pytest.approx(2e-3, rel=0.15)


def test_doctor_lists_the_package_and_its_entries(together: dict[str, Any]) -> None:
    found = json.loads(together["doctor"])
    [listed] = (each["text"] for each in found if each["name"] == "plug-in")
    assert listed.startswith("grain-magnets 1.0 (designs: corners; engines: cones; exporters: leaflet; ")


@pytest.mark.parametrize("folder", ["leaflet", "card"])
def test_a_study_and_a_card_are_exported(plugged: Installed, together: dict[str, Any], folder: str) -> None:
    assert "mu = " in (plugged.work / folder / "leaflet.txt").read_text(encoding="utf-8")


def test_a_campaign_runs_with_its_design_on_its_engine(plugged: Installed, together: dict[str, Any]) -> None:
    found = json.loads(together["calibrate"])
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
    assert json.loads(together["resume"])["optimum"] == found["optimum"]
    design = pd.read_csv(plugged.work / "out" / "tables" / "screening_design.csv")
    assert design["E"].tolist() == [-1.0, 1.0] * 4
