"""Errors of instruments in a file of measured heaps: stated, usual, or none."""

from pathlib import Path

import pytest

from doe.discrepancy import Calibration, Measured
from experiments.io.errors import InputError
from experiments.measurement.instrument_error import usual_error
from experiments.measurement.measured_file import read_measured
from experiments.studyfile import load_study
from experiments.studyfile.observables import BY_NAME

TRIAL = Path(__file__).parents[3] / "experiments" / "studies" / "trial" / "study.toml"


def read(tmp_path: Path, *rows: str) -> Measured:
    path = tmp_path / "measured.csv"
    values = ("base,1,height,8,mm", "base,1,t55,0.26,s", "base,1,asymmetry,0.1,")
    text = "\n".join(("condition,replicate,observable,value,unit", *values, *rows))
    path.write_text(text + "\n", encoding="utf-8")
    return read_measured(path, load_study(TRIAL, "bench"))


def test_the_default_is_usual_for_the_instrument(tmp_path: Path) -> None:
    found = read(tmp_path).calibration
    assert found == {name: usual_error(BY_NAME[name]) for name in ("height", "t55", "asymmetry")}
    # Begin and end of a time are each read to half a frame: evenly within 1/60 s, twice.
    assert found["t55"].offset == pytest.approx((2.0 / 12.0) ** 0.5 / 60.0)


def test_a_file_states_offset_and_scale_in_any_unit(tmp_path: Path) -> None:
    rows = (
        "calibration,offset,t55,4,ms",
        "calibration,scale,height,0.5,%",
        "calibration,offset,height,0.2,mm",
    )
    found = read(tmp_path, *rows).calibration
    assert found["t55"] == Calibration(0.004, instrument="film")
    assert found["height"] == Calibration(2.0e-4, 0.005, "photograph")
    assert found["asymmetry"] == usual_error(BY_NAME["asymmetry"])


def test_a_file_may_exclude_all_errors_but_the_stated_ones(tmp_path: Path) -> None:
    found = read(tmp_path, "calibration,none,,,", "calibration,offset,t55,4,ms").calibration
    assert found == {
        "height": Calibration(instrument="photograph"),
        "t55": Calibration(0.004, instrument="film"),
        "asymmetry": Calibration(),
    }


@pytest.mark.parametrize(
    ("row", "said"),
    [
        ("calibration,bias,t55,4,ms", "offset, scale, none"),
        ("calibration,offset,t5,4,ms", "must be an observable"),
        ("calibration,offset,t55,-4,ms", "0 or more"),
        ("calibration,offset,t55,4,mm", "value"),
        ("calibration,offset,t55,4,%", "0 or more"),
        ("calibration,offset,t55,,", "nothing"),
    ],
)
def test_an_invalid_statement_is_an_error_with_its_row(tmp_path: Path, row: str, said: str) -> None:
    with pytest.raises(InputError, match=said) as error:
        read(tmp_path, row)
    assert "measured.csv:5" in str(error.value)
