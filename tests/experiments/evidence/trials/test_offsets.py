"""Offsets of another code: a drawn one comes back, that of the record is there, and nothing else changes."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dem_warp import PRESETS
from doe.discrepancy import Point
from experiments.cases import OwnWorkers
from experiments.cases.store.outcome_table import OutcomeTable
from experiments.discover.engine_simulator import EngineSimulator
from experiments.discover.mechanism_files import library_for
from experiments.evidence.trials.generate_trials import STUDY
from experiments.evidence.trials.other_codes.convention_effects import (
    ERROR,
    OFF,
    OtherWorkshop,
    Taken,
    made_offsets,
    parted,
)
from experiments.evidence.trials.other_codes.offsets import offsets_table
from experiments.evidence.trials.truth import Kind, Label
from experiments.studyfile import load_study


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


def test_what_laws_make_is_told_from_what_is_left() -> None:
    rng, shape = np.random.default_rng(2), (40, 5, 6, 1)
    ours, theirs = 2.0 * rng.standard_normal(shape), 2.0 * rng.standard_normal(shape) + 0.6
    theirs[4, 2, 1] = np.nan  # a heap that failed
    laws = made_offsets(ours, theirs, {"t55": "s"})
    # means of six heaps each, over 200: an error of sqrt(2 / 1200) = .041; four of them
    assert laws.loc[0, OFF] == pytest.approx(0.3, abs=0.16)
    assert laws.loc[0, ERROR] == pytest.approx(0.041, rel=0.5)
    [row] = parted(laws.assign(**{OFF: 0.5, ERROR: 0.03}), laws).to_dict("records")
    assert row["left"] == pytest.approx(0.5 - laws.loc[0, OFF])
    assert row["error of what is left"] == pytest.approx(np.hypot(0.03, laws.loc[0, ERROR]))


@pytest.mark.parametrize("taken", [(Taken.LAWS,), (Taken.RAIN,), (Taken.STEP,), tuple(Taken)])
def test_what_is_taken_from_the_other_workshop_is_all_that_changes(
    tmp_path: Path, taken: tuple[Taken, ...]
) -> None:
    study, workers = load_study(STUDY, "relative"), OwnWorkers("cpu")
    library, table = library_for(study), OutcomeTable(tmp_path / "outcomes.sqlite")
    null = Label("alone-001", Kind.NULL, (0.6, 0.5, 0.3), (), (), 7, "")
    point = Point(null.theta, (), study.conditions[0].name, 7)
    with (
        EngineSimulator(study, library, table, workers) as ours,
        OtherWorkshop(study, "liggghts", taken, [null], table, workers) as theirs,
    ):
        own, other = ours.case(point), theirs.case(point)
    parts = {
        Taken.LAWS: (own.laws != other.laws, other.laws.sliding == PRESETS["liggghts"].sliding),
        Taken.RAIN: (own.scene != other.scene, 100.0 < other.scene.rain_rate < own.scene.rain_rate),
        Taken.STEP: (own.numerics != other.numerics, 0.6 <= other.time_step / own.time_step <= 1.0),
    }
    for part, (differs, as_theirs) in parts.items():
        assert differs is (part in taken)
        assert as_theirs or part not in taken
    assert other.laws.rolling == own.laws.rolling
    same = replace(other, laws=own.laws, numerics=own.numerics)
    assert replace(same, scene=replace(same.scene, rain_rate=own.scene.rain_rate)) == own
