"""A plan of tests in a folder: its batches, its answer, and its way on from a finished campaign."""

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from commandline import dem_warp, refused
from cone_engine import stand_in

from dem_warp import Case, CaseResult

Write = Callable[..., Path]

CANDIDATES = """
[response-scene.wide.lifted-cylinder]
diameter = "40 mm"
height = "28 mm"
grain_count = 60

[[candidate]]
test = "wide"
observables = ["angle"]
sd = "0.5 deg"
sizes = [{ grain_count = 240 }]

[[candidate]]
test = "sledge"
parameter = "E"
sd = 0.03
minutes = [5, 1]
"""


@pytest.fixture
def seeds(cone: Callable[..., CaseResult], monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Seeds of the cases that an engine simulated whose angle rises by 30 degrees over a friction of 1."""
    simulated, heap = [], cone()

    def engine(cases: Sequence[Case], *, on_result: Callable[[int, CaseResult], None], **_: Any) -> list:
        for index, case in enumerate(cases):
            simulated.append(case.seed)
            angle = 15.0 + 30.0 * case.grain_grain.static_friction + 0.3 * math.sin(12.9898 * case.seed)
            on_result(index, replace(heap, observables={"truth": angle}))
        return []

    stand_in(monkeypatch, engine)
    return simulated


def planned(*words: object) -> dict[str, Any]:
    code, out, err = dem_warp("plan", *words, "--device", "cpu", "--json")
    assert code == 0, err
    return json.loads(out)


def test_a_plan_simulates_each_scene_once_and_says_what_to_do(
    write_study: Write, tmp_path: Path, seeds: list[int]
) -> None:
    study, out = write_study(add=CANDIDATES), tmp_path / "plan"
    found = planned(study, "--out", out)
    # a line of four points and five at its middle, for the target and the further scene
    assert len(seeds) == len(set(seeds)) == 2 * (4 + 5)
    assert found["sentence"].startswith("Next test: ")
    now, *rows = found["rows"]
    assert now["tests"] == "nothing more"
    assert rows[-1]["E"] < 0.95 * now["E"]
    assert 0.0 < found["share"] < 0.5
    assert any("Assumed: wide_angle: common 0.3 deg" in note for note in found["notes"])
    assert json.loads((out / "results.json").read_text(encoding="utf-8"))["plan"] == found
    page = (out / "report.html").read_text(encoding="utf-8")
    assert found["sentence"] in page
    assert (out / "tables" / "plan.csv").is_file()
    assert planned(study, "--out", out, "--resume") == found
    assert len(seeds) == 18


def test_a_plan_after_a_campaign_takes_its_region(
    write_study: Write, tmp_path: Path, seeds: list[int]
) -> None:
    study, campaign = write_study(add=CANDIDATES), tmp_path / "campaign"
    assert dem_warp("calibrate", study, "--out", campaign, "--device", "cpu")[0] == 0
    page = (campaign / "report.html").read_text(encoding="utf-8")
    assert "Next test: " in page
    assert "Not judged: wide: it was not simulated: run dem-warp plan" in page
    assert page.index("Next test: ") < page.index("computer time") < page.index("Assumed: ")
    del seeds[:]
    found = planned(study, "--after", campaign, "--out", tmp_path / "plan")
    assert len(seeds) == 9  # the target is known
    assert found["share"] < 1.0
    again = planned(study, "--after", campaign / "material.toml", "--out", tmp_path / "again")
    times = {row.pop("seconds") for row in (*found["rows"], *again["rows"])}  # all else is the same
    assert 0.0 in times
    assert found == again
    # what it knows of the angle is of other heaps
    grain, name = ('sphere = "2 mm"\ndensity = "700', 'name = "E"')
    other, renamed = (grain, 'sphere = "3 mm"\ndensity = "900'), (name, 'name = "friction"')
    said = refused("plan", write_study(other, add=CANDIDATES), "--after", campaign)
    assert "is of a grain with another shape, size or density" in said
    candidates = CANDIDATES.replace('parameter = "E"', 'parameter = "friction"')
    said = refused("plan", write_study(renamed, add=candidates), "--after", campaign)
    assert "must name a factor" in said


def test_a_campaign_with_a_cheaper_scale_has_a_next_test(
    write_study: Write, tmp_path: Path, seeds: list[int]
) -> None:
    scales = '[campaign.fidelity]\nscale = "soft"\n[scale.soft]\nnumerics.modulus_scale = 800.0\n'
    study, campaign = write_study(add=CANDIDATES + scales), tmp_path / "campaign"
    assert dem_warp("calibrate", study, "--out", campaign, "--device", "cpu")[0] == 0
    page = (campaign / "report.html").read_text(encoding="utf-8")
    assert "Next test: " in page
    # a surface of the cheaper scale would be another one
    assert "Not judged: wide: it was not simulated: run dem-warp plan" in page
    assert "had a cheaper scale" in refused("plan", study, "--after", campaign)


def test_the_cases_of_a_plan_are_forecast(write_study: Write) -> None:
    plan = planned(write_study(add=CANDIDATES), "--dry-run")
    assert [batch["name"] for batch in plan["batches"]] == ["test wide", "test target", "start, report"]
    assert plan["cases"] == 18


def test_a_plan_that_cannot_be_is_refused(write_study: Write, tmp_path: Path) -> None:
    assert "needs a [[candidate]]" in refused("plan", write_study())
    study = write_study(add=CANDIDATES)
    assert "no such file" in refused("plan", study, "--after", tmp_path)
    (tmp_path / "card.toml").write_text("format = 1\n", encoding="utf-8")
    assert "is not the card of a finished" in refused("plan", study, "--after", tmp_path / "card.toml")
