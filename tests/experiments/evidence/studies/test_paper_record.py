"""The record of the paper's runs: its page follows from its tables."""

import json
import tomllib
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from analytic_heaps import AnalyticHeaps, study_with

from experiments.calibrate import Campaign, calibrate
from experiments.evidence.studies.buckwheat.records import paper_page
from experiments.evidence.studies.buckwheat.replay.replay import Replay
from experiments.evidence.studies.buckwheat.replay.runs import planned_cases
from experiments.report.material_card import CARD
from experiments.studyfile import Study, load_study
from experiments.studyfile.card import with_material

WALL_TIMES = [{"stage": "paper, climb", "simulated": 6, "seconds": 44.7}]


def cases(shift: float = 0.0, replicates: int = 2) -> pd.DataFrame:
    plan = planned_cases(replicates)
    noise = 0.3 * np.random.default_rng(5).standard_normal(len(plan))
    return plan.assign(status="finished", reason="", angle=plan["published"] + shift + noise)


def numbers_of(page: str, heading: str) -> list[list[str]]:
    """Cells of the first table below a heading, row by row."""
    below = page.split(f"## {heading}\n", 1)[1]
    rows = [line for line in below.splitlines() if line.startswith("|")]
    table = rows[: next((i for i, row in enumerate(rows[2:], 2) if "---" in row), len(rows) + 1) - 1]
    return [[cell.strip() for cell in row.strip("|").split("|")] for row in table[2:]]


@pytest.fixture(scope="module")
def study() -> Study:
    return study_with(load_study(), selection={"keep": ("E", "F")})


@pytest.fixture(scope="module")
def campaign(study: Study) -> Campaign:
    return calibrate(study, AnalyticHeaps())


def test_the_committed_page_follows_from_the_committed_angles() -> None:
    page = (paper_page.FOLDER / paper_page.PAGE).read_text(encoding="utf-8")
    assert page == paper_page.record_page(paper_page.FOLDER)


def test_the_committed_card_is_that_of_the_committed_campaign() -> None:
    card = tomllib.loads((paper_page.FOLDER / CARD).read_text(encoding="utf-8"))
    campaign = json.loads((paper_page.FOLDER / paper_page.CAMPAIGN).read_text(encoding="utf-8"))
    assert (card["fitted"]["outcome"], card["fitted"]["reason"]) == (campaign["outcome"], campaign["reason"])
    study = load_study(None, "printed")
    case = study.case({name: factor["chosen"] for name, factor in card["factor"].items()}, 1)
    own = with_material({"material": CARD}, paper_page.FOLDER)
    assert own["grain"]["density"] == "698 kg/m^3"
    friction = own["contact"]["grain-wall"]["static_friction"]
    # The card has the chosen point in full, the table of its factors four figures of it.
    assert friction == pytest.approx(case.grain_wall.static_friction, rel=1e-3)


def test_a_page_shows_the_numbers_of_its_cases(tmp_path: Path, campaign: Campaign) -> None:
    page = paper_page.write_record(
        tmp_path, cases(1.5), {"device": "CPU", "wall_times": WALL_TIMES}, campaign
    ).read_text("utf-8")
    replay = Replay(cases(1.5))
    shown = numbers_of(page, "Agreement")
    expected = replay.agreement().bias
    assert shown[-1][5] == f"{expected.value:.2f} [{expected.low:.2f},\u00a0{expected.high:.2f}]"
    assert [row[0] for row in numbers_of(page, "Every run")].count("Table 6") == 13
    assert "In all 6 heaps in 45 s." in page
    # The campaign's own screening is compared.
    effect = campaign.screening.leading.screen.table["effect"]["F"]
    assert f"{effect:.2f}" in next(row for row in numbers_of(page, "Screening") if "F" in row[0])
    assert f"Outcome: {campaign.outcome.value}. {campaign.reason}" in page


def test_a_record_includes_a_card_notes_and_side_studies(tmp_path: Path, campaign: Campaign) -> None:
    paper_page.write_record(tmp_path, cases(), {"commit": "abc123"}, campaign)
    for name, text in ((CARD, ""), ("notes.md", "What we make of it."), ("side_studies.md", "## A clump")):
        (tmp_path / name).write_text(text, encoding="utf-8")
    page = paper_page.write_record_page(tmp_path).read_text(encoding="utf-8")
    for text in ("What we make of it.", f"]({CARD})", "- commit: abc123", "## A clump"):
        assert text in page
