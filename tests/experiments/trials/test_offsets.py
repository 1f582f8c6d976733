"""Offsets of another code: a drawn offset comes back, and that of the record is there."""

from pathlib import Path

import numpy as np
import pytest

import experiments.trials
from experiments.trials.other_codes.offsets import measured_offsets, offsets_table

RECORD = Path(experiments.trials.__file__).parent / "record" / "liggghts"


def test_a_drawn_offset_comes_back_with_its_error() -> None:
    rng, shape = np.random.default_rng(1), (60, 5, 2)
    runs = np.broadcast_to([2.0, 0.01], shape)
    off = runs * (np.array([0.5, 0.0]) + 0.3 * rng.standard_normal(shape))
    off[3, 1, 0] = np.nan
    table = offsets_table({"flank_angle": "deg", "t55": "s"}, off, runs).set_index("observable")
    # 60 nulls of five conditions: an error of .3 / sqrt(300) = .017; four of them
    assert table["off, sd of one run"].tolist() == pytest.approx([0.5, 0.0], abs=0.07)
    assert table["standard error"].tolist() == pytest.approx([0.017, 0.017], rel=0.4)
    assert table.loc["flank_angle", "off"] == pytest.approx(1.0, abs=0.14)
    assert list(table["unit"]) == ["deg", "s"]
    assert table.loc["t55", table.columns[-1]] == pytest.approx(0.3, rel=0.1)


def test_heaps_of_liggghts_run_out_later_than_ours() -> None:
    table, nulls = measured_offsets(RECORD)
    late = table.set_index("observable").loc["t55"]
    assert nulls == 25
    # 4 ms in 270, less than a film's frame; seven standard errors
    assert 3.0 < late["off, sd of one run"] / late["standard error"] < 15.0
    assert 1e-3 < late["off"] < 1e-2
