"""The comparison of outlines and angles, on heaps of a formula and on drums that an emulator draws."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
import pytest

from dem_warp.scenes.drum_surface import STATIONS
from doe import central_composite
from experiments.evidence.accuracy.outlines import drawn_outlines, outlines_record
from experiments.evidence.studies.cellulose.cellulose_plan import places
from experiments.studyfile import load_study
from experiments.studyfile.observables import ANGLE
from imaging import profile


def heap(row: Mapping[str, float]) -> dict[str, float]:
    """Heights whose level goes with both factors, and whose bend with the second; an angle sees one sum."""
    rng, places = np.random.default_rng(int(row["seed"])), np.array(profile.STATIONS)
    slope, bend = row["mu"] + 3.0 * row["mu_r"], 4.0 * row["mu_r"]
    heights = 10.0 - 4.0 * slope * places + 2.0 * bend * (places - 0.7) ** 2
    heights = 1e-3 * (heights + 0.05 * rng.normal(size=len(places)))
    found = dict(zip(outlines_record.HEIGHTS, heights, strict=True))
    return found | {ANGLE: 30.0 + 8.0 * slope + 0.2 * rng.normal(), "status": "finished"}


def test_an_outline_that_bends_pins_what_an_angle_leaves_open(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(outlines_record, "HIDDEN", ((0.0, 0.0),))
    study = load_study(outlines_record.STUDY)
    factors = study.factors[:2]
    design = central_composite(factors, "face", outlines_record.CENTER_POINTS)
    cases = outlines_record.plan(study, design)
    assert cases["seed"].is_unique
    cases = cases.assign(**cases.apply(heap, axis=1, result_type="expand"))
    found = outlines_record.Surfaces(design, cases)
    angle, outline = outlines_record.regions(found, cases, factors).to_dict("records")
    assert angle["holds the truth"]
    assert outline["holds the truth"]
    assert outline["ratio"] == pytest.approx(outline["share"] / angle["share"])
    assert outline["ratio"] < 0.25
    assert outline["range of mu"] < 0.5 < angle["range of mu"]
    moved = outlines_record.strengths(found).set_index("measured")
    # Two directions, and in their own scatter the first moves farther than the second.
    assert np.linalg.norm(moved.loc["outline, direction 1"]) > np.linalg.norm(
        moved.loc["outline, direction 2"]
    )


def test_drums_drawn_from_the_record_are_those_of_its_emulator() -> None:
    drums = drawn_outlines.Drums()
    middle = pd.DataFrame([{factor.name: factor.center for factor in drums.factors}] * 400)
    seen = drums.draw(middle, seed=1)
    curves, _ = drums.emulator.predict(np.zeros((1, 4)))
    expected = 1e-3 * np.interp(np.array(STATIONS) * drums.radius, places(), curves[0])
    heights = seen[list(drawn_outlines.HEIGHTS)].to_numpy()
    # Four standard errors of a mean of 400.
    assert np.all(np.abs(heights.mean(axis=0) - expected) < 4.0 * heights.std(axis=0) / np.sqrt(400))
    assert (heights.std(axis=0) > 1e-3 * drawn_outlines.READING).all()
    # The bed is high on the left; a slope over the middle is near the line through its ends.
    ends = heights[:, 1] - heights[:, -2]
    assert seen[drawn_outlines.ANGLE].to_numpy() == pytest.approx(
        np.degrees(np.arctan(ends / (1.2 * drums.radius))), abs=5.0
    )


def test_surfaces_of_drawn_drums_leave_less_open_than_their_slopes(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(drawn_outlines, "HIDDEN", drawn_outlines.HIDDEN[:2])
    monkeypatch.setattr(drawn_outlines, "COUNTS", (20,))
    monkeypatch.setattr(drawn_outlines, "SERIES", 3)
    table, moved = drawn_outlines.compare(drawn_outlines.Drums())
    [row] = drawn_outlines.summary(table).to_dict("records")
    assert row["regions"] == 6
    assert row["ratio, mean"] < 0.6
    # At 95 %, two misses of six have a chance of 3 %.
    assert min(row["angle holds the truth"], row["surface holds the truth"]) > 0.6
    page = drawn_outlines.write(tmp_path, table, moved).read_text(encoding="utf-8")
    assert "surface, direction 1" in page
