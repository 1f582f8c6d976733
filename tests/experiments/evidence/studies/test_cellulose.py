"""The cellulose study: its plan, and its fit, prediction and page on edges of a model that is made up."""

import json

import numpy as np
import pandas as pd
import pytest

from experiments.evidence.studies.cellulose import cellulose_campaign, cellulose_heaps, cellulose_plan
from experiments.evidence.studies.cellulose.cellulose_fit import measured_edge, residual_table, residuals
from experiments.evidence.studies.cellulose.cellulose_heaps import simulate_drums
from experiments.evidence.studies.cellulose.cellulose_page import write_record
from experiments.studyfile import Study

RADIUS_MM = 42.0


@pytest.fixture(scope="module")
def study() -> Study:
    return cellulose_plan.study_at("h200")


def test_measured_edges_lie_in_the_drum():
    table = cellulose_plan.measured()
    assert sorted(table["rpm"].unique()) == list(cellulose_plan.MEASURED)
    for rpm in cellulose_plan.MEASURED:
        edge = measured_edge(rpm)
        assert (np.hypot(edge["x_mm"], edge["z50_mm"]) < RADIUS_MM - 1.0).all()
        # darker below
        both = edge.dropna()
        assert (both["z20_mm"] > both["z50_mm"]).all()
        assert (both["z50_mm"] > both["z80_mm"]).all()


def test_the_published_filling_is_the_published_number_of_grains(study):
    # sizes are drawn anew, and the source's classes are not ours: one percent
    assert cellulose_plan.grain_count(study, cellulose_plan.PUBLISHED["fill"]) == pytest.approx(
        29_185, rel=0.01
    )
    bench = cellulose_plan.study_at("bench")
    # a slice of 15 of 20 mm, of spheres of 64 times the volume
    assert cellulose_plan.grain_count(bench, cellulose_plan.PUBLISHED["fill"]) == pytest.approx(
        29_185 * 0.75 / 64, rel=0.02
    )


def test_a_case_is_what_its_row_says(study):
    table = cellulose_plan.batch(
        cellulose_plan.first_points(study, cellulose_plan.RUNS["h200"]), "first", cellulose_plan.MEASURED, 1
    )
    row = table.iloc[-1]
    case = cellulose_plan.case_of(study, row)
    assert 60.0 * case.scene.rotation_rate == pytest.approx(45.0)
    assert case.grain_grain.static_friction == case.grain_wall.static_friction == 0.561
    assert case.grain_wall.rolling_friction == 0.293
    assert case.scene.grain_count == cellulose_plan.grain_count(study, 0.2553)
    assert table["seed"].is_unique


def test_second_points_are_about_what_is_compatible(study):
    rng = np.random.default_rng(1)
    center, spread = np.array([0.2, -0.4, 0.0, 0.5]), np.array([0.05, 0.1, 0.4, 0.02])
    compatible = center + spread * rng.normal(size=(500, 4))
    points = cellulose_plan.coded(study, cellulose_plan.second_points(study, compatible, 12))
    assert (np.abs(points) <= 1.0 + 1e-12).all()
    assert points.mean(axis=0) == pytest.approx(compatible.mean(axis=0), abs=1.5 * spread.max())
    assert (points.std(axis=0) > compatible.std(axis=0)).all()


def measured_at_places() -> list[np.ndarray]:
    """Heights of the measured edges at all places."""
    x = 1e3 * cellulose_plan.places()
    edges = map(measured_edge, cellulose_plan.MEASURED)
    return [np.interp(x, edge["x_mm"], edge["z50_mm"]) for edge in edges]


def made_up(study: Study, row: pd.Series, edges: list[np.ndarray], x: np.ndarray) -> np.ndarray:
    """Edge of a model that is made up: the mean of the measured ones, turned and lifted by the settings."""
    mu, mu_r, wall, fill = cellulose_plan.coded(study, row.to_frame().T.astype({"mu": float}))[0].astype(
        float
    )
    share = (np.log(row["rpm"]) - np.log(15)) / np.log(3)
    return (
        (1 - share) * edges[0]
        + share * edges[1]
        + 3.0 * (fill - 0.1)
        - 0.15 * (mu + 0.5 * mu_r - 0.2) * x
        + 0.002 * (wall - mu_r) * x**2 / 42.0
    )


@pytest.mark.usefixtures("few_moves")
def test_the_whole_study_on_made_up_edges(tmp_path, monkeypatch):
    study, edges, x = cellulose_plan.study_at("bench"), measured_at_places(), 1e3 * cellulose_plan.places()

    def pretend(study, table, folder, device=None, workers=None):
        cellulose_heaps._note_time(folder, table["stage"].iloc[0], len(table), 1.0)
        values = {"status": "finished", "reason": "", "grain_count": 1.0, "dynamic_angle": 1.0}
        return table.assign(**values, case=[str(seed) for seed in table["seed"]])

    def curves_of(table, folder):
        rng = np.random.default_rng(len(table))
        rows = np.array([made_up(study, row, edges, x) for _, row in table.iterrows()])
        rows += rng.normal(0.0, 0.1, (len(rows), 1))
        return table.reset_index(drop=True), {0.2: rows + 0.6, 0.5: rows, 0.8: rows - 1.0}

    monkeypatch.setattr(cellulose_campaign, "simulate_drums", pretend)
    monkeypatch.setattr(cellulose_campaign, "with_curves", curves_of)
    cellulose_campaign.run_study("bench", tmp_path, "cpu")
    forecast = pd.read_csv(tmp_path / cellulose_campaign.PREDICTION)
    assert list(forecast.columns) == ["rpm", "x_mm", "z_mm", "low", "high"]
    places = np.unique(cellulose_plan.measured()["x_mm"])
    for rpm, own in forecast.groupby("rpm"):
        assert rpm in cellulose_plan.HELD_BACK
        assert own["x_mm"].to_numpy() == pytest.approx(places)
        assert ((own["low"] <= own["z_mm"]) & (own["z_mm"] <= own["high"])).all()
        assert (np.hypot(own["x_mm"], own["z_mm"]) <= RADIUS_MM + 1e-3).all()
        # the truth of this model, at settings that meet the measured edges
        inside = own[np.abs(own["x_mm"]) < 25.0]
        share = (np.log(rpm) - np.log(15)) / np.log(3)
        ends = [
            np.interp(inside["x_mm"], e["x_mm"], e["z50_mm"])
            for e in map(measured_edge, cellulose_plan.MEASURED)
        ]
        true = (1 - share) * ends[0] + share * ends[1]
        assert np.mean((inside["low"] < true) & (true < inside["high"])) > 0.9
    page = write_record(tmp_path).read_text(encoding="utf-8")
    assert "15 revolutions" in page
    assert (tmp_path / "edge-15.png").is_file()
    found = pd.read_csv(tmp_path / "residuals.csv")
    # the model can meet both edges: what is left is the noise of its runs
    assert found.loc[found["stage"] == "check", "rms_mm"].max() < 0.5
    assert json.loads((tmp_path / cellulose_campaign.FACTS).read_text())["scale"] == "bench"


def test_a_measured_edge_has_no_residual():
    edge = measured_edge(15)
    curve = np.interp(1e3 * cellulose_plan.places(), edge["x_mm"], edge["z50_mm"])
    assert np.abs(residuals(15, curve)).max() < 1e-9
    table = pd.DataFrame({"stage": ["check"], "point": [0], "rpm": [15]})
    # a millimetre too high, over the width of the counted disc
    row = residual_table(table, curve[None] + 1.0, 1e-3 * RADIUS_MM).iloc[0]
    assert row["rms_mm"] == pytest.approx(1.0)
    assert 40.0 < row["area_mm2"] < 2.0 * np.sqrt(0.6) * RADIUS_MM


def test_a_drum_is_simulated_once(tmp_path, monkeypatch):
    tiny = {"start_up": 0.01, "revolutions": 0.02, "rain_rate": "3000 1/s", "grain_count": 60}
    small = cellulose_plan.load_study(cellulose_plan.STUDY, "bench", {"scene": {"drum": tiny}})
    monkeypatch.setattr(cellulose_plan, "_filled", lambda study, fill: small)
    table = cellulose_plan.batch(pd.DataFrame([cellulose_plan.PUBLISHED]), "first", (15,), 1)
    found = simulate_drums(small, table, tmp_path, "cpu", 1)
    assert list(found["status"]) == ["finished"], found["reason"].iloc[0]
    assert (tmp_path / "edges" / f"{found['case'].iloc[0]}.npz").is_file()
    assert simulate_drums(small, table, tmp_path, "cpu", 1).equals(found)
    calls = pd.read_csv(tmp_path / cellulose_heaps.WALL_TIMES)
    assert calls[["stage", "simulated"]].to_numpy().tolist() == [["first", 1]]
    assert calls["seconds"].iloc[0] > 0.0
