"""The reached filling of a drum: printed for a case, and cautioned about in a campaign."""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pandas as pd
import pytest
from commandline import dem_warp
from small_study import ANGLE, TUBE

from dem_warp import Drum, Material
from experiments.measurement.filling import filling_missed, filling_reached, filling_text
from experiments.report.cautions import _filling
from experiments.studyfile import load_study

SCENE = """[scene.drum]
diameter = "32 mm"
length = "12 mm"
rotation_rate = "1 1/s"
filling = 0.4
start_up = 0.0
revolutions = 0.05
rest_speed = "0.05 m/s"
"""
STEEL = Material(density=7800.0, shear_modulus=70e9, poisson_ratio=0.3)
DRUM = Drum(diameter=0.1, length=0.02, wall_material=STEEL, rotation_rate=0.5, filling=0.4)


def test_a_bed_up_to_the_axis_fills_half_of_a_drum() -> None:
    assert filling_reached(DRUM, {"fill_height": 0.05}) == pytest.approx(0.5)
    assert filling_reached(DRUM, {"fill_height": DRUM.brim}) == pytest.approx(DRUM.filling, abs=1e-6)
    assert filling_reached(DRUM, {}) is None
    assert filling_reached(SimpleNamespace(filling=0.4), {"fill_height": 0.05}) is None


def test_another_filling_is_missed_unless_grains_are_counted() -> None:
    assert filling_missed(DRUM, 0.33)
    assert not filling_missed(DRUM, 0.39)
    assert filling_text(DRUM, 0.331) == "0.33 of the drum, 0.4 in the study"
    counted = replace(DRUM, grain_count=100)
    assert not filling_missed(counted, 0.33)
    assert filling_text(counted, 0.331) == "0.33 of the drum"


def test_the_filling_of_a_drum_is_printed(write_study: Callable[..., Path], tmp_path: Path) -> None:
    study = write_study((TUBE, SCENE), (ANGLE, ""))
    code, out, _ = dem_warp("heap", study, "--device", "cpu", "--out", tmp_path / "a")
    assert code == 0
    printed = re.fullmatch(r"filling: (0\.\d\d) of the drum, 0.4 in the study", out.splitlines()[-1])
    # The rain heaps up in the middle, and what is above the brim is cut off.
    assert printed
    assert 0.2 < float(printed[1]) < 0.4


def test_another_filling_is_a_caution_of_a_campaign(
    write_study: Callable[..., Path],
) -> None:
    study = load_study(write_study((TUBE, SCENE), (ANGLE, "")))
    for height, cautioned in ((0.0105, True), (float(study.case({}, 1).scene.brim), False)):
        cases = pd.DataFrame({"scene": ["target"] * 3, "fill_height": [height] * 3})
        texts = [caution.text for caution in _filling(SimpleNamespace(cases=cases), study)]
        assert len(texts) == cautioned
        assert all("0.4 in the study" in text for text in texts)
