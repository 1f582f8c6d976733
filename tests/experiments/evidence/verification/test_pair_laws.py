"""Driven pairs: sets of laws give their closed forms, and a wrong law is seen."""

import numpy as np
import pytest

from dem_warp import PRESETS
from experiments.evidence.verification.problems.pair_laws import driven, expected, pair_rows


@pytest.mark.parametrize("name", ["edem", "liggghts"])
def test_a_set_of_laws_gives_its_closed_forms(name: str) -> None:
    rows = pair_rows(name, "cpu")
    assert len(rows) == 4
    assert all(row.passed for row in rows), rows


def test_the_rolling_law_of_another_set_is_seen() -> None:
    seen = driven(PRESETS["liggghts"], "rolling", "cpu")
    want, size = expected("rolling", PRESETS["liggghts-cdt"])
    assert np.abs(seen - want).max() > 0.5 * size
