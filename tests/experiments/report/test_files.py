"""The report's files, and its pictures of heaps."""

import base64
import json
import math
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
import pytest
from cone_engine import resting
from page_reader import Page

import dem_warp
from dem_warp import CaseResult
from experiments.calibrate import Campaign
from experiments.report import heap_pictures, render_page, write_report
from experiments.studyfile import Study


def test_files_hold_the_same_numbers(campaign: Campaign, study: Study, tmp_path: Path) -> None:
    written = write_report(campaign, study, tmp_path / "out", provenance={"device": "cpu"})
    assert written == tmp_path / "out" / "report.html"
    assert written.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    results = json.loads((tmp_path / "out" / "results.json").read_text(encoding="utf-8"))
    assert results["campaign"]["outcome"] == "calibrated"
    assert results["campaign"]["optimum"]["point"] == campaign.optimum.point
    assert results["provenance"]["device"] == "cpu"
    versions = results["provenance"]["versions"]
    assert (versions["numpy"], versions["dem-warp"]) == (np.__version__, dem_warp.__version__)
    files = {path.stem: path for path in (tmp_path / "out" / "tables").iterdir()}
    assert set(files) == set(campaign.tables())
    effects = pd.read_csv(files["screening_effects"], index_col="factor")
    np.testing.assert_array_equal(
        effects.drop(columns="response").to_numpy(), campaign.screening.leading.screen.table.to_numpy()
    )
    names = "material-clump.txt material.toml report.html results.json tables"
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == names.split()


def test_a_report_that_cannot_be_written_leaves_nothing(
    campaign: Campaign, study: Study, tmp_path: Path
) -> None:
    with pytest.raises(TypeError, match="object"):
        write_report(campaign, study, tmp_path / "out", provenance={"device": object()})
    assert not (tmp_path / "out").exists()


def heap_of(angle: float) -> CaseResult:
    """Stack spheres into a cone of a known slope [deg]."""
    radius, rise = 2e-3, math.tan(math.radians(angle))
    grid = np.arange(-15, 16) * 1.5 * radius
    x, y, z = (axis.ravel() for axis in np.meshgrid(grid, grid, np.arange(0, 12) * 1.5 * radius))
    inside = z <= rise * (0.04 - np.hypot(x, y))
    centers = np.column_stack([x, y, z + radius])[inside]
    return resting(centers, [[0.0, 0.0, 0.0, radius]])


def test_pictures_show_the_extremes_of_a_stage_with_their_flanks(campaign: Campaign, study: Study) -> None:
    coarse = study.measurement.model_copy(update={"pixels": 200, "azimuths": 2})
    study = study.model_copy(update={"measurement": coarse})
    asked = []

    def load(key: str) -> CaseResult:
        asked.append(key)
        return heap_of(28.0)

    pictures = heap_pictures(campaign, study, load)
    climb = campaign.cases[campaign.cases["stage"] == "climb"].sort_values("angle")["case_key"]
    assert {climb.iloc[0], climb.iloc[-1]} <= set(asked)
    assert len(pictures) == len(asked) == 7
    page = Page(render_page(campaign, study, pictures[:1]))
    [source] = [link for link in page.links if link.startswith("data:image")]
    data = np.frombuffer(base64.b64decode(source.partition(",")[2]), np.uint8)
    assert cv2.imdecode(data, cv2.IMREAD_COLOR).shape == pictures[0].image.shape
    assert "heaps" in page.ids
