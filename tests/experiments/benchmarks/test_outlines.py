"""The comparison of outlines and angles, on heaps of a formula."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

from doe import central_composite
from experiments.benchmarks.outlines import run
from experiments.measurement.observables import ANGLE
from experiments.studyfile import load_study
from imaging.profile import STATIONS


def heap(row: Mapping[str, float]) -> dict[str, float]:
    """Heights whose level goes with both factors, and whose bend with the second; an angle sees one sum."""
    rng, places = np.random.default_rng(int(row["seed"])), np.array(STATIONS)
    slope, bend = row["mu"] + 3.0 * row["mu_r"], 4.0 * row["mu_r"]
    heights = 10.0 - 4.0 * slope * places + 2.0 * bend * (places - 0.7) ** 2
    heights = 1e-3 * (heights + 0.05 * rng.normal(size=len(places)))
    found = dict(zip(run.HEIGHTS, heights, strict=True))
    return found | {ANGLE: 30.0 + 8.0 * slope + 0.2 * rng.normal(), "status": "finished"}


def test_an_outline_that_bends_pins_what_an_angle_leaves_open(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(run, "HIDDEN", ((0.0, 0.0),))
    study = load_study(run.STUDY)
    factors = study.factors[:2]
    design = central_composite(factors, "face", run.CENTER_POINTS)
    cases = run.plan(study, design)
    assert cases["seed"].is_unique
    cases = cases.assign(**cases.apply(heap, axis=1, result_type="expand"))
    found = run.Surfaces(design, cases)
    angle, outline = run.regions(found, cases, factors).to_dict("records")
    assert angle["holds the truth"]
    assert outline["holds the truth"]
    assert outline["ratio"] == pytest.approx(outline["share"] / angle["share"])
    assert outline["ratio"] < 0.25
    assert outline["range of mu"] < 0.5 < angle["range of mu"]
    moved = run.strengths(found).set_index("measured")
    # Two directions, and in their own scatter the first moves farther than the second.
    assert np.linalg.norm(moved.loc["outline, direction 1"]) > np.linalg.norm(
        moved.loc["outline, direction 2"]
    )
