"""The study of wheat in four tests: its data, and its fit and page on tests of a made-up model."""

import json

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from experiments.evidence.studies import batch
from experiments.evidence.studies.cellulose import cellulose_campaign
from experiments.evidence.studies.cellulose.__main__ import app as cellulose_app
from experiments.evidence.studies.wheat import wheat_campaign, wheat_page, wheat_plan
from experiments.evidence.studies.wheat.__main__ import app as wheat_app
from experiments.evidence.studies.wheat.wheat_fit import SETTINGS, Bench, fit_tests
from experiments.evidence.studies.wheat.wheat_plan import DENSITY, HEAP, LEVEL, SHELLS, Datum
from experiments.io.errors import InputError
from experiments.studyfile import Study

TRUTH = np.array([0.2, -0.3, 0.9, 0.1, -0.5, -0.2, 0.4])
"""Coded settings of the made-up grain and walls."""


@pytest.fixture(scope="module")
def study() -> Study:
    return wheat_plan.study_at("bench")


def response(scene: str, case: np.ndarray) -> np.ndarray:
    """Return what a model that is made up gives in a scene, at coded settings of cases."""
    mu, mu_r, wall, cover = case.T
    level = 36.0 + 5.0 * mu + 4.0 * mu_r + 0.5 * cover
    return {
        "target": level,
        "inclined": level + 9.0 + 3.0 * mu + 9.0 * wall + 3.0 * cover,
        "heap": 28.0 + 3.0 * mu + 6.0 * mu_r + 2.0 * wall,
        "bed": 730.0 - 40.0 * mu - 10.0 * mu_r,
    }[scene]


def cases_of(study: Study) -> pd.DataFrame:
    """Return the planned cases with what the made-up model gives, and its noise."""
    table = pd.DataFrame(wheat_plan.planned_cases(study, "bench"))
    coded = np.column_stack([(table[f.name] - f.center) / f.half_range for f in study.factors])
    rng = np.random.default_rng(2)
    for scene, name in wheat_plan.RESPONSES.items():
        rows = (table["scene"] == scene).to_numpy()
        table.loc[rows, name] = response(scene, coded[rows]) + rng.normal(0.0, 0.5, rows.sum())
    return table


def measured_of(truth: np.ndarray) -> dict[str, Datum]:
    """Return data of the made-up model at its truth, with the errors of the real ones."""
    drums = np.array([[*truth[:2], wall, truth[-2]] for wall in truth[2:-1]])
    tube, steel = np.array([[*truth[:2], truth[-1], 0.0]]), drums[[SHELLS.index("steel")]]
    means = [response("target", drums).mean(), *response("inclined", drums)]
    means += [response("heap", tube)[0], response("bed", steel)[0]]
    return {
        name: Datum(m, one.error) for (name, one), m in zip(wheat_plan.data().items(), means, strict=True)
    }


def test_the_data_are_those_of_the_source():
    found = wheat_plan.data()
    assert list(found) == [LEVEL, *SHELLS, HEAP, DENSITY]
    # table 2 of the source: five tests a shell, whose pooled variance it gives as 8.52
    assert [found[name].mean for name in SHELLS] == pytest.approx([61.33, 46.30, 40.31, 43.65], abs=0.01)
    assert found["soil"].error == pytest.approx(np.sqrt(8.52 / 5), abs=0.01)


def test_a_kernel_has_the_stated_size_and_a_heap_thirty_grams():
    case = wheat_plan.study_at("h200").case({}, 0, "heap")
    shape = case.grains.mixture.shapes[0]
    low = (shape.centers - shape.radii[:, None]).min(axis=0)
    high = (shape.centers + shape.radii[:, None]).max(axis=0)
    assert sorted(1e3 * (high - low)) == pytest.approx([2.6, 3.0, 6.5], abs=0.05)
    mass = case.scene.grain_count * case.grain_material.density * case.grains.mean(lambda one: one.volume)
    assert mass == pytest.approx(0.030, rel=0.02)


def test_drums_differ_by_their_axis_and_have_a_cover(study):
    rows = wheat_plan.planned_cases(study, "bench")
    assert len({row["seed"] for row in rows}) == len(rows)
    row = next(row for row in rows if row["scene"] == "inclined")
    case = study.case({f.name: row[f.name] for f in study.factors}, 1, "inclined")
    assert np.degrees(case.scene.inclination) == pytest.approx(45.0)
    assert case.grain_wall.static_friction == pytest.approx(row["mu_wall"])
    cover = {part.name: part.surface.static_friction for part in case.wall_parts}
    assert cover == {"front": pytest.approx(row["mu_cover"])}


@pytest.mark.usefixtures("few_moves")
def test_the_fit_finds_what_was_made_up_and_each_test_narrows_it(study):
    tests, data = Bench.of(study, cases_of(study)), measured_of(TRUTH)
    found = fit_tests(tests, data, {*data})
    assert found.chi2 < 5.0
    low, high = np.quantile(found.settings, [0.005, 0.995], axis=0)
    assert ((low <= TRUTH) & (high >= TRUTH)).all()
    ranges = found.ranges(study)
    assert list(ranges.index) == list(SETTINGS)
    # the drums alone cannot tell sliding from rolling, and say nothing of the tube
    drums = fit_tests(tests, data, {*data} - {HEAP, DENSITY}).ranges(study)
    assert (ranges["part"] < drums["part"])[["mu", "mu_r", "mu_tube"]].all()
    assert drums.loc["mu_tube", "part"] > 0.8  # of a uniform one, 0.9


@pytest.mark.usefixtures("few_moves")
def test_a_datum_that_contradicts_the_others_is_seen(study):
    tests, data = Bench.of(study, cases_of(study)), measured_of(TRUTH)
    wrong = data | {LEVEL: Datum(60.0, 0.7)}
    assert fit_tests(tests, wrong, {*wrong}).chi2 > 20.0
    without = fit_tests(tests, wrong, {*wrong} - {LEVEL}).predictions()
    assert without.loc[LEVEL, "agrees"] == "no"
    assert (without.drop(index=LEVEL)["agrees"] == "yes").all()


@pytest.mark.usefixtures("few_moves")
def test_a_run_is_measured_and_has_its_page(study, tmp_path, monkeypatch):
    monkeypatch.setattr(batch.OwnWorkers, "simulate", lambda *arguments, checkpoint: [])
    wheat_campaign.run_study("bench", tmp_path, "cpu")
    facts = json.loads((tmp_path / batch.FACTS).read_text())
    assert facts["scale"] == "bench"
    assert facts["wall_times"][0]["simulated"] == sum(wheat_plan.POINTS["bench"].values())
    cases_of(study).assign(status="finished").to_csv(tmp_path / batch.CASES)
    page = wheat_page.write_record(tmp_path).read_text(encoding="utf-8")
    assert "| heap | 31.7 |" in page
    assert (tmp_path / "data.png").is_file()


@pytest.mark.parametrize("campaign", [cellulose_campaign, wheat_campaign])
def test_an_unknown_scale_is_refused(campaign, tmp_path):
    with pytest.raises(InputError, match="must be one of h200, bench"):
        campaign.run_study("paper", tmp_path)


@pytest.mark.parametrize("study_app", [cellulose_app, wheat_app])
def test_the_page_of_no_run_is_refused(study_app, tmp_path):
    shown = CliRunner().invoke(study_app, ["page", "--out", str(tmp_path)])
    assert shown.exit_code == 2
    assert "must be the folder of a finished run: run the study first, got without" in shown.stderr
