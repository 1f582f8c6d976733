"""The study of wheat in drums: its data, and its fit, search and page on slopes of a made-up model."""

import json

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from experiments.evidence.studies.cellulose import cellulose_campaign
from experiments.evidence.studies.cellulose.__main__ import app as cellulose_app
from experiments.evidence.studies.wheat_drums import drum_campaign, drum_plan
from experiments.evidence.studies.wheat_drums.__main__ import app as wheat_app
from experiments.evidence.studies.wheat_drums.drum_fit import SETTINGS, Slopes, fit_slopes
from experiments.evidence.studies.wheat_drums.drum_page import write_record
from experiments.evidence.studies.wheat_drums.drum_search import write_search
from experiments.io.errors import InputError
from experiments.measurement.measured_file import read_measured
from experiments.studyfile import Study, load_study

TRUTH = np.array([0.2, -0.3, 0.9, 0.1, -0.5, -0.2])
"""Coded settings of the made-up grain and walls."""


@pytest.fixture(scope="module")
def study() -> Study:
    return drum_plan.study_at("bench")


def slope(drums: np.ndarray, inclined: np.ndarray) -> np.ndarray:
    """Slopes of a model that is made up, at coded settings of drums [deg]."""
    mu, mu_r, shell, cover = drums.T
    level = 36.0 + 5.0 * mu + 4.0 * mu_r + 0.5 * cover
    return level + inclined * (9.0 + 3.0 * mu + 9.0 * shell + 3.0 * cover)


def drums_of(study: Study, count: int = 22) -> pd.DataFrame:
    table = drum_plan.planned_drums(study, count)
    inclined = (table["scene"] == drum_plan.INCLINED).to_numpy(float)
    noise = np.random.default_rng(2).normal(0.0, 0.5, len(table))
    return table.assign(dynamic_angle=slope(drum_plan.coded(study, table), inclined) + noise)


def measured_of(truth: np.ndarray) -> dict:
    """Return data of the made-up model at its truth, with the errors of the real ones."""
    drums = np.array([[*truth[:2], wall, truth[-1]] for wall in truth[2:]])
    means = [slope(drums, np.zeros(4)).mean(), *slope(drums, np.ones(4))]
    return {
        name: type(sample)(float(mean), sample.sd, sample.n)
        for (name, sample), mean in zip(drum_plan.data().items(), means, strict=True)
    }


def test_the_data_are_those_of_the_source():
    found = drum_plan.data()
    assert list(found) == [drum_plan.UPRIGHT, *drum_plan.SHELLS]
    assert [sample.n for sample in found.values()] == [20, 5, 5, 5, 5]
    # the source pools sqrt(8.52); its printed angles alone give 2.75
    angles = pd.read_csv(drum_plan.HERE / "angles.csv", comment="#").groupby("shell")["angle_deg"]
    assert np.sqrt(angles.var().mean()) == pytest.approx(drum_plan.INCLINED_SD, abs=0.2)


def test_a_kernel_has_the_stated_size():
    case = drum_plan.study_at("h200").case({}, 0)
    shape = case.grains.mixture.shapes[0]
    low = (shape.centers - shape.radii[:, None]).min(axis=0)
    high = (shape.centers + shape.radii[:, None]).max(axis=0)
    assert sorted(1e3 * (high - low)) == pytest.approx([2.6, 3.0, 6.5], abs=0.05)


def test_drums_differ_by_their_axis_and_their_cover(study):
    table = drum_plan.planned_drums(study, 8)
    assert table["seed"].is_unique
    row = table.iloc[1]
    settings = {factor.name: float(row[factor.name]) for factor in study.factors}
    case = study.case(settings, 1, row["scene"])
    assert np.degrees(case.scene.inclination) == pytest.approx(45.0)
    assert case.grain_wall.static_friction == pytest.approx(row["mu_shell"])
    cover = {part.name: part.surface.static_friction for part in case.wall_parts}
    assert cover == {"front": pytest.approx(row["mu_cover"])}


@pytest.mark.usefixtures("few_moves")
def test_the_fit_finds_what_was_made_up(study):
    slopes, data = Slopes.of(study, drums_of(study)), measured_of(TRUTH)
    found = fit_slopes(slopes, data)
    assert found.chi2 < 5.0
    low, high = np.quantile(found.settings, [0.005, 0.995], axis=0)
    assert ((low <= TRUTH) & (high >= TRUTH)).all()
    # one slope cannot tell sliding from rolling, and each inclined one has a wall of its own
    ranges = found.ranges(study).set_index("setting")
    assert list(ranges.index) == list(SETTINGS)
    assert ranges.loc["mu", "part of the design"] > ranges.loc["mu_steel", "part of the design"]


@pytest.mark.usefixtures("few_moves")
def test_a_datum_that_contradicts_the_others_is_seen(study):
    slopes, data = Slopes.of(study, drums_of(study)), measured_of(TRUTH)
    wrong = data | {drum_plan.UPRIGHT: type(data["steel"])(60.0, 3.12, 20)}
    assert fit_slopes(slopes, wrong).chi2 > 20.0
    without = fit_slopes(slopes, wrong, leave_out=drum_plan.UPRIGHT).foretold().set_index("test")
    assert without.loc[drum_plan.UPRIGHT, "high"] < 60.0


@pytest.mark.usefixtures("few_moves")
def test_a_run_has_its_tables_its_page_and_its_search(study, tmp_path, monkeypatch):
    def pretend(study, table, store, workers):
        if "scene" in table:
            values = {
                "dynamic_angle": drums_of(study, len(table) // 2)["dynamic_angle"],
                "dynamic_angle_se": 0.3,
            }
        else:
            values = {"angle": 30.0 + np.arange(len(table)), "angle_se": 0.4}
        return table.assign(status="finished", reason="", grain_count=150.0, **values)

    monkeypatch.setattr(drum_campaign, "run_cases", pretend)
    drum_campaign.run_study("bench", tmp_path, "cpu")
    heaps = pd.read_csv(tmp_path / drum_campaign.HEAPS)
    assert len(heaps) == drum_plan.RUNS["bench"].heaps
    assert heaps["mu_wall"].between(0.05, 1.0).all()
    assert json.loads((tmp_path / drum_campaign.FACTS).read_text())["scale"] == "bench"
    page = write_record(tmp_path).read_text(encoding="utf-8")
    assert "31.7 deg" in page
    assert (tmp_path / "slopes.png").is_file()
    fit = fit_slopes(Slopes.of(study, drums_of(study)), drum_plan.data())
    made, table = write_search(tmp_path, study, fit)
    search = load_study(made)
    assert [factor.name for factor in search.factors] == ["mu", "mu_r"]
    assert read_measured(table, search).observables == ("dynamic_angle",)
    walls = {name: search.case({}, 1, name).grain_wall.static_friction for name in drum_plan.SHELLS}
    assert len(set(walls.values())) == 4


def test_the_heap_is_of_thirty_grams():
    for scale in drum_plan.RUNS:
        drum_plan.heap_study_at(scale).case({}, 0)
    case = drum_plan.heap_study_at("h200").case({}, 0)
    mass = case.scene.grain_count * case.grain_material.density * case.grains.mean(lambda shape: shape.volume)
    assert mass == pytest.approx(0.030, rel=0.02)


@pytest.mark.parametrize("campaign", [cellulose_campaign, drum_campaign])
def test_an_unknown_scale_is_refused(campaign, tmp_path):
    with pytest.raises(InputError, match="must be one of h200, bench"):
        campaign.run_study("paper", tmp_path)


@pytest.mark.parametrize("study_app", [cellulose_app, wheat_app])
def test_the_page_of_no_run_is_refused(study_app, tmp_path):
    shown = CliRunner().invoke(study_app, ["page", "--out", str(tmp_path)])
    assert shown.exit_code == 2
    assert "must be the folder of a finished run: run the study first, got without" in shown.stderr
