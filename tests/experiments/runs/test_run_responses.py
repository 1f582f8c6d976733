"""Two scenes in one campaign's folder: really simulated, and a whole campaign on a stand-in engine."""

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from commandline import dem_warp, refused
from cone_engine import stand_in
from small_study import ANGLE, TUBE

from dem_warp import CaseResult, Drum, Hopper
from dem_warp.scenes.drum_surface import STATIONS
from experiments.calibrate import Campaign, Outcome
from experiments.cases import OwnWorkers, Store, run_cases
from experiments.runs import calibration as run
from experiments.runs.choices import measured_study, prepare
from experiments.runs.request import RunRequest
from experiments.studyfile import Study, load_study

BIN = """
[response-scene.bin.hopper]
diameter = "28 mm"
fill_depth = "16 mm"
outlet = "20 mm"
grain_count = 30

[target.twin]
truth = { E = 0.45 }

[[response]]
observable = "solid_fraction"

[[response]]
name = "emptying"
observable = "discharge_time"
scene = "bin"
"""


@pytest.fixture
def study(write_study: Callable[..., Path]) -> Study:
    return load_study(write_study(add=BIN))


def test_heap_and_bin_are_simulated_together(study: Study, tmp_path: Path) -> None:
    table = pd.DataFrame({"seed": [1, 2], "scene": ["target", "bin"], "E": [0.4, 0.4]})
    heap, outflow = run_cases(study, table, Store(tmp_path), OwnWorkers("cpu", 1)).to_dict("records")
    assert (heap["status"], outflow["status"]) == ("finished", "finished")
    assert 0.0 < heap["angle"] < 90.0
    assert math.isnan(outflow["angle"])
    assert outflow["reason"] == "", "a bin leaves no heap, and its measurement did not fail"
    assert 0.0 < outflow["discharge_time"] < outflow["simulated_time"]
    density = study.case({"E": 0.4}, 1).grain_material.density
    for row in (heap, outflow):
        assert row["bulk_density"] == pytest.approx(density * row["solid_fraction"], rel=1e-12)
    assert outflow["filled_mass"] == pytest.approx(outflow["fallen_mass"] + outflow["mass_left"], rel=1e-6)


def test_one_case_of_a_further_scene_is_shown_alone(study: Study, tmp_path: Path) -> None:
    words = ("heap", study.file, "--device", "cpu", "--out")
    code, shown, _ = dem_warp(*words, tmp_path / "one", "--scene", "bin", "--json")
    found = json.loads(shown)
    assert (code, found["scene"], found["angle"]) == (0, "bin", None)
    assert found["observable_units"]["discharge_time"] == "s"
    assert found["observable_units"]["bulk_density"] == "kg/m^3"
    assert found["observables"]["bulk_density"] > found["observables"]["solid_fraction"]
    assert "did you mean 'bin'" in refused(*words, tmp_path / "other", "--scene", "bim")
    assert not (tmp_path / "other").exists()


class Engine:
    """Stands in for the simulator: heaps and bins that follow the friction."""

    def __init__(self, heap: CaseResult) -> None:
        self.heap = heap

    def __call__(self, cases, *, on_result, **_) -> None:
        for index, case in enumerate(cases):
            friction, noise = case.grain_grain.static_friction, math.sin(12.9898 * case.seed)
            seen = {"grain_count": 30.0, "simulated_time": 1.5}
            if isinstance(case.scene, Drum):
                seen["dynamic_angle"] = 15.0 + 50.0 * friction + 0.5 * noise
                jitter = np.random.default_rng(case.seed).normal(0.0, 2e-5, len(STATIONS))
                heights = -(friction + 0.005 * noise) * 0.03 * np.array(STATIONS) + jitter
                seen |= {f"surface_{i}": float(height) for i, height in enumerate(heights, 1)}
            elif isinstance(case.scene, Hopper):
                seen["discharge_time"] = 0.5 + 0.4 * friction + 0.01 * noise
            else:
                seen |= {"truth": 15.0 + 30.0 * friction + 0.5 * noise}
                seen |= {"solid_fraction": 0.60 - 0.1 * friction + 0.004 * math.cos(78.233 * case.seed)}
            on_result(index, replace(self.heap, observables=seen))


@pytest.fixture
def engine(cone: Callable[..., CaseResult], monkeypatch: pytest.MonkeyPatch) -> Engine:
    engine = Engine(cone())
    stand_in(monkeypatch, engine)
    return engine


def calibrated(study: Study, folder: Path) -> Campaign:
    prepared = prepare(study, RunRequest(out=folder, device="cpu"))
    return run.run_calibration(prepared).campaign


NO_HEAP = ((TUBE, ""), (ANGLE, ""))
DRUM = """
[scene.drum]
diameter = "60 mm"
length = "20 mm"
rotation_rate = "30 1/min"
grain_count = 30
"""
SLOPE = """
[[response]]
observable = "dynamic_angle"
mean = "40 deg"
sd = "1 deg"
n = 5
"""


@pytest.mark.usefixtures("engine")
def test_a_drums_angle_may_be_the_only_target(write_study: Callable[..., Path], tmp_path: Path) -> None:
    study = load_study(write_study(*NO_HEAP, add=DRUM + SLOPE))
    measured_study(study)
    found = calibrated(study, tmp_path / "out")
    assert found.outcome in (Outcome.CALIBRATED, Outcome.UNDECIDED)
    assert [response.name for response in found.responses] == ["dynamic_angle"]
    # The stand-in engine turns 15 + 50 x friction: the target lies at 0.5, known to a fifth of a degree.
    assert found.optimum.point["E"] == pytest.approx(0.5, abs=0.05)
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "dynamic angle of 40.00°" in page


@pytest.mark.usefixtures("engine")
def test_a_campaign_of_two_scenes_matches_both(study: Study, tmp_path: Path) -> None:
    whole = calibrated(study, tmp_path / "whole")
    assert whole.outcome in (Outcome.CALIBRATED, Outcome.UNDECIDED)
    # Three standard errors of five cases through the slope: 0.5 / sqrt(5) deg over 30 deg, twice.
    assert whole.optimum.point["E"] == pytest.approx(0.45, abs=0.03)
    tables = tmp_path / "whole" / "tables"
    costs = pd.read_csv(tables / "scene_costs.csv", index_col="scene")
    assert costs["cases"].to_dict() == whole.cases["scene"].value_counts().to_dict()
    assert pd.read_csv(tables / "joint_shrinkage.csv")["response"].iloc[0] == "angle"


PROFILES = """
[target]
observable = "surface"
profiles = "profiles.csv"
"""


@pytest.mark.usefixtures("engine")
def test_the_profiles_of_a_drum_may_be_the_only_target(
    write_study: Callable[..., Path], tmp_path: Path
) -> None:
    """The stand-in engine turns a plane: profiles of slope 0.5 are those of a friction of 0.5."""
    x = np.linspace(-20.0, 20.0, 21)
    rng = np.random.default_rng(1)
    rows = [
        f"{label},{place} mm,{height!r} mm"
        for label in range(8)
        for slope, offset in [rng.normal([-0.5, 0.0], [0.005, 0.05])]
        for place, height in zip(x, (slope * x + offset + rng.normal(0.0, 0.02, 21)).tolist(), strict=True)
    ]
    (tmp_path / "profiles.csv").write_text("\n".join(["replicate,x,z", *rows]), encoding="utf-8")
    study = measured_study(load_study(write_study(*NO_HEAP, add=DRUM + PROFILES)))
    names = [response.name for response in study.target.responses]
    # Stations from -0.6 to 0.6 of 30 mm lie within the 20 mm that were measured.
    assert names == [f"surface_mode_{number}" for number in range(1, 8)]
    assert {name for name, _ in study.target.leading.weights} == {f"surface_{i}" for i in range(2, 9)}
    found = calibrated(study, tmp_path / "out")
    assert found.optimum.point["E"] == pytest.approx(0.5, abs=0.02)
