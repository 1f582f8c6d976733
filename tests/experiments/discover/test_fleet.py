"""Several devices as one simulator: the answers of one, in the order of the points."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from experiments.discover.engine import EngineSimulator
from experiments.discover.fleet import Fleet, engine_on
from experiments.discover.library import library_for
from experiments.discover.outcome_table import OutcomeTable
from experiments.discover.simulator import Point
from experiments.study import load_study

CONDITIONS = """
[condition.base]
"""


def test_two_processes_answer_as_one_does(write_study: Callable[..., Path], tmp_path: Path) -> None:
    study = load_study(write_study(add=CONDITIONS))
    library = library_for(study)
    points = [
        Point((0.4,), (("rolling_torque", 0.1),), "base", 1),
        Point((0.4,), (), "base", 2),
    ]
    alone, together = (OutcomeTable(tmp_path / f"{name}.sqlite") for name in ("alone", "together"))
    with engine_on("cpu", study, library, alone, workers=1) as one:
        assert isinstance(one, EngineSimulator)
        expected = one(points)
    # A share of one point each: the two mechanisms' points come in another order than they were asked for.
    with engine_on("cpu,cpu", study, library, together, workers=2) as fleet:
        assert isinstance(fleet, Fleet)
        outcomes = fleet(points)
    np.testing.assert_array_equal(outcomes.values, expected.values)
    assert outcomes.reasons == expected.reasons
    assert len(together) == 2
