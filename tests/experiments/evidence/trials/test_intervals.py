"""Intervals of sizes over emulated twins: what is counted, and what the command refuses."""

from pathlib import Path

import pandas as pd
import pytest

from experiments.evidence.trials.intervals import coverage, read_twins
from experiments.io.errors import InputError


def twin(mechanism: str, true: float, low: float, size: float, high: float) -> dict[str, object]:
    return {"mechanism": mechanism, "true_size": true, "low": low, "size": size, "high": high}


def test_intervals_of_named_effects_are_counted_by_the_side_on_which_they_miss() -> None:
    nothing = float("nan")
    table = pd.DataFrame(
        [
            twin("tilt", 2.0, 1.0, 2.5, 3.0),
            twin("tilt", 0.5, 1.0, 1.5, 3.0),
            twin("tilt", 4.0, 1.0, 2.5, 3.0),
            twin("tilt", 2.0, nothing, nothing, nothing),
            twin("shape", 2.0, 2.0, 2.5, 3.0),
        ]
    )
    shape, tilt, every = coverage(table).to_dict("records")
    assert (shape["effect"], tilt["effect"], every["effect"]) == ("shape", "tilt", "all")
    assert (tilt["twins"], tilt["named"], tilt["truth below"], tilt["truth above"]) == ("4", "3", "1", "1")
    # Clopper and Pearson of 1 in 3 and 2 in 4; an end of an interval belongs to it
    assert tilt["held"] == "33.3 % (1 to 91)"
    assert every["held"] == "50.0 % (7 to 93)"


def test_a_folder_without_twins_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="needs twins"):
        read_twins(tmp_path)
