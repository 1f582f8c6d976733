"""The record of what further responses buy: gathered, and its page written anew from the cases."""

import json
from pathlib import Path

import pytest
from analytic_heaps import planes

from experiments.calibrate import Campaign, calibrate
from experiments.evidence.studies.buckwheat.records import point_record
from experiments.evidence.studies.buckwheat.records.direct_record import narrowed
from experiments.evidence.studies.buckwheat.records.point_record import (
    CASES,
    STUDY,
    KeptCases,
    gather,
    kept_campaign,
    write_record_page,
)
from experiments.io.errors import InputError
from experiments.studyfile import Study, load_study


@pytest.fixture(scope="module")
def study() -> Study:
    return load_study(STUDY, "bench")


@pytest.fixture(scope="module")
def campaign(study: Study) -> Campaign:
    return calibrate(study, lambda table: planes(study, table))


@pytest.fixture
def folder(campaign: Campaign, tmp_path: Path) -> Path:
    """Lay out what a campaign's folder has of it."""
    (tmp_path / "out" / "tables").mkdir(parents=True)
    campaign.tables()["cases"].to_csv(tmp_path / "out" / "tables" / CASES, index=False)
    (tmp_path / "out" / "results.json").write_text(json.dumps({"provenance": {"device": "cpu"}}))
    (tmp_path / "out" / "wall_times.csv").write_text("stage,simulated,seconds\nsurface,28,61.0\n")
    return tmp_path / "out"


def test_kept_cases_repeat_the_campaigns_findings_to_the_bit(
    campaign: Campaign, study: Study, folder: Path, tmp_path: Path
) -> None:
    gather("bench", folder, tmp_path / "record")
    again = kept_campaign(study, tmp_path / "record" / "bench")
    for stage in ("target", "screening", "selection", "surface", "optimum", "verification"):
        found, before = again.to_dict()[stage], campaign.to_dict()[stage]
        assert json.dumps(found) == json.dumps(before), stage
    assert again.reason == campaign.reason


def test_the_page_is_the_same_whenever_it_is_written(
    campaign: Campaign, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    record = tmp_path / "record"
    monkeypatch.setattr(point_record, "kept_campaign", lambda study, folder: campaign)
    gather("bench", folder, record)
    first = write_record_page(record).read_text(encoding="utf-8")
    assert write_record_page(record).read_text(encoding="utf-8") == first
    assert "In all 28 cases in 61 s." in first
    assert "| density |" in first
    assert (record / "bench" / "joint.png").stat().st_size > 10_000


def test_cases_of_another_campaign_are_refused(campaign: Campaign) -> None:
    cases = campaign.cases
    heaps = cases[cases["stage"] == "climb"].drop(columns=["status", "reason", "angle"])
    kept = KeptCases(cases, "cases.csv")
    assert len(kept(heaps[["stage", "scene", "run", "replicate", "E", "F", "G", "H", "seed"]])) == len(heaps)
    plan = heaps[["stage", "scene", "run", "replicate", "E", "F", "G", "H", "seed"]]
    with pytest.raises(InputError, match="asks for; gather them anew"):
        kept(plan.assign(seed=1))
    with pytest.raises(InputError, match="the study's settings"):
        kept(plan.assign(E=0.5))


def test_settings_may_end_in_other_digits_on_another_machine(campaign: Campaign) -> None:
    heaps = campaign.cases.query("stage == 'climb'")
    plan = heaps[["stage", "scene", "run", "replicate", "E", "F", "G", "H", "seed"]]
    kept = KeptCases(campaign.cases, "cases.csv")
    assert (kept(plan.assign(E=plan["E"] * (1 + 1e-10)))["E"] == heaps["E"].to_numpy()).all()
    with pytest.raises(InputError, match="the study's settings"):
        kept(plan.assign(E=plan["E"] * (1 + 1e-6)))


def test_a_folder_without_a_campaign_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        gather("bench", tmp_path, tmp_path / "record")


def test_readings_of_single_grains_narrow_what_the_tests_leave(campaign: Campaign, study: Study) -> None:
    hidden = dict(study.target.twin.truth)
    for table in narrowed(campaign.optimum.joint, hidden):
        bare, read = table.loc["angle, density"], table.loc["angle, density, F ± 0.01, E ± 0.015"]
        assert (read[["share", "E"]] < bare[["share", "E"]]).all()
        assert (table > 0.0).all(axis=None)
