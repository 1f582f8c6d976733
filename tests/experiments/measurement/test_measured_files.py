"""Files of measured heaps: what is read, what is refused with its row, and what is noted."""

import csv
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from drawn_heaps import Camera, DrawnHeap, draw
from small_study import CONDITIONS
from typer.testing import CliRunner

from doe.discrepancy import Measured
from experiments.cli import app
from experiments.io.errors import InputError
from experiments.measurement import data_notes, measured_file, readings
from experiments.studyfile import Study, load_study
from experiments.studyfile.observables import NAMES
from imaging import save_picture

HEADER = "condition,replicate,observable,value,unit,picture,pixel\n"

PLAIN = Camera(noise=0)


@pytest.fixture
def study(write_study: Callable[..., Path]) -> Study:
    return load_study(write_study(add=CONDITIONS))


@pytest.fixture
def read(tmp_path: Path, study: Study) -> Callable[[str], Measured]:
    """Read rows as a file of measured heaps."""

    def read_rows(rows: str, header: str = HEADER) -> Measured:
        path = tmp_path / "measured.csv"
        path.write_text(header + rows, encoding="utf-8")
        return measured_file.read_measured(path, study)

    return read_rows


def angles(condition: str, *values: float) -> str:
    return "".join(f"{condition},{i},flank_angle,{value}\n" for i, value in enumerate(values, start=1))


def noted(measured: Measured, *words: str) -> list[str]:
    return [note for note in measured.notes if all(word in note for word in words)]


def test_rows_become_heaps_in_the_order_of_the_study_with_units_converted(read) -> None:
    data = read(
        "# what follows was measured on a Monday, with a ruler\n"
        "fast,1,height,1.2,cm,,\n"
        "base,b,flank_angle,25.5,,,\n"
        "base,a,t75,400,ms,,\n"
        "base,a,flank_angle,24.5,deg,,\n"
        "base,a,rolled_fraction,0.1,1,,\n"
        ",,,,,,\n"
        "fast,1,asymmetry,-0.02,,,\n"
    )
    assert data.conditions == ("base", "fast")
    assert data.observables == ("flank_angle", "height", "asymmetry", "rolled_fraction", "t75")
    nan = np.nan
    np.testing.assert_array_equal(
        data.values["base"], [[25.5, nan, nan, nan, nan], [24.5, nan, nan, 0.1, 0.4]]
    )
    np.testing.assert_array_equal(data.values["fast"], [[nan, 0.012, -0.02, nan, nan]])


def test_a_clogged_tube_is_an_outcome(read) -> None:
    data = read(angles("base", 24.0, 26.0) + "base,3,clogged,,,,\n")
    assert data.reasons["base"] == ("", "", readings.CLOGGED)
    np.testing.assert_array_equal(data.mean("base"), [25.0])
    assert noted(data, "base", "1 of 3 replicates left no heap")


def test_pictures_are_measured_as_heaps_are(read, tmp_path: Path) -> None:
    save_picture(tmp_path / "heap.png", draw(DrawnHeap(27.0, 31.0), PLAIN))
    save_picture(tmp_path / "turned.png", draw(DrawnHeap(23.0, 27.0), PLAIN))
    rows = "base,1,,,,heap.png,0.1 mm\nbase,1,flank_angle,,,turned.png,\nfast,1,,,,heap.png,\n"
    data = read(rows)
    assert data.observables == NAMES[:6]
    fast = dict(zip(data.observables, data.values["fast"][0], strict=True))
    base = dict(zip(data.observables, data.values["base"][0], strict=True))
    # Drawn truth: 0.3 degrees is the promise for drawn heaps of 400 pixels. Two views count with their mean.
    assert fast["flank_angle"] == pytest.approx(29.0, abs=0.3)
    assert base["flank_angle"] == pytest.approx(27.0, abs=0.3)
    # Straight flanks: the outline is a triangle to about a pixel along its edges.
    assert fast["concavity"] == pytest.approx(0.0, abs=0.02)
    assert np.isnan([fast["height"], fast["r50"], fast["r90"]]).all()
    # Turned about its apex a triangle is a cone: half its volume lies where 3 s^2 - 2 s^3 = 1/2, at half the
    # radius.
    width = DrawnHeap(27.0, 31.0).width * 0.1e-3
    assert base["r50"] == pytest.approx(width / 4.0, rel=0.03)
    assert data.pictures["base"] == (tmp_path / "heap.png", tmp_path / "turned.png")


def test_a_picture_of_two_replicates_is_refused_with_both_places(read, tmp_path: Path) -> None:
    save_picture(tmp_path / "heap.png", draw(DrawnHeap(27.0, 31.0), PLAIN))
    (tmp_path / "copy.png").write_bytes((tmp_path / "heap.png").read_bytes())
    for name in ("heap.png", "copy.png"):
        message = rf"csv:3: picture: {name} is a copy of heap.png \(.*measured.csv:2: picture\)"
        with pytest.raises(InputError, match=message):
            read(f"base,1,,,,heap.png,0.1 mm\nbase,2,,,,{name},0.1 mm\n")
    # Another view of the same heap, or a row for each observable, is no repeat.
    data = read("base,1,flank_angle,,,heap.png,\nbase,1,concavity,,,copy.png,\n")
    assert len(data.values["base"]) == 1


def test_a_picture_without_a_heap_is_noted_and_the_rest_stays(read, tmp_path: Path) -> None:
    save_picture(tmp_path / "empty.png", np.full((300, 500), 200, np.uint8))
    data = read(angles("base", 25.0) + "base,2,flank_angle,,,empty.png,\n")
    np.testing.assert_array_equal(data.values["base"], [[25.0]])
    assert noted(data, "row 3", "contrast")


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ("base,1,flank_angle,nan,,,", "must be a number"),
        ('base,1,flank_angle,"25,5",,,', "decimal point"),
        ("bsae,1,flank_angle,25,,,", "did you mean 'base'"),
        ("base,,flank_angle,25,,,", "needs a label"),
        ("base,1,flank_angel,25,,,", "did you mean 'flank_angle'"),
        ("base,1,,25,,,", "is missing for the value"),
        ("base,1,clogged,1,,,", "no heap"),
        ("base,1,flank_angle,,,absent.png,", "no such file"),
        ("base,1,fill_height,,,absent.png,", "photographs do not show it"),
        ("base,1,flank_angle,25,,,,,a comma", "quotes"),
        ("base,1,flank_angle,25,mm", "3: value: flank_angle needs a unit of angle.*got 25.0 mm"),
        ("base,1,height,0.2,in", "3: value: height needs a unit of length.*got 0.2 in"),
        ("base,1,height,12,1", "3: value: height needs a unit of length.*got 12"),
        ("base,1,concavity,0.1,mm", "3: value: concavity must be a plain number.*got 0.1 mm"),
    ],
)
def test_what_cannot_be_read_is_refused_with_its_row(read, row: str, message: str) -> None:
    with pytest.raises(InputError, match=message) as error:
        read(angles("fast", 25.0) + f"{row}\nbase,1,asymmetry,0.1\n")
    assert "measured.csv:3" in error.value.place


@pytest.mark.parametrize(
    ("row", "note"),
    [
        ("height,40,m", ", got 40 m; ignored. Check the unit."),
        ("height,12,", "in this test, got 12 m; ignored. Check the unit (default: m)."),
        ("rolled_fraction,12,", "rolled_fraction must be between 0 and 1 in this test"),
    ],
)
def test_an_impossible_value_is_ignored_with_its_row(read, row: str, note: str) -> None:
    data = read(angles("base", 25.0) + f"base,1,{row}\nbase,1,asymmetry,0.1\n")
    assert data.observables == ("flank_angle", "asymmetry")
    assert len(noted(data, "row 3:", note)) == 1


def test_one_error_names_all_rows_of_a_wrong_unit(read) -> None:
    with pytest.raises(InputError, match=r"csv:3: value, rows 3, 4: .*, got 0.2 in, 0.3 furlong"):
        read(angles("base", 25.0) + "base,1,height,0.2,in\nbase,2,height,0.3,furlong\n")


def test_one_note_names_all_values_of_one_wrong_unit(read) -> None:
    data = read(angles("base", 25.0) + "".join(f"base,{i},height,1{i},m\n" for i in range(2, 7)))
    assert noted(data, "rows 3, 4, 5 and 2 more: height must be between", ", got 12 m, ...; ignored")
    # A heap of which nothing is left is none.
    np.testing.assert_array_equal(data.values["base"], [[25.0]])


def test_wrong_units_that_leave_no_value_are_refused(read) -> None:
    with pytest.raises(InputError, match=r"2: value, rows 2, 3: .*, got 40 m, 41 m\. Check the unit"):
        read("base,1,height,40,m\nbase,2,height,41,m\n")


def test_a_length_on_a_picture_needs_a_scale(read, tmp_path: Path) -> None:
    save_picture(tmp_path / "heap.png", draw(DrawnHeap(27.0, 31.0), PLAIN))
    with pytest.raises(InputError, match="size of its pixels"):
        read("base,1,height,,,heap.png,\n")
    data = read("base,1,,,,heap.png,1 cm\n")
    assert "flank_angle" in data.observables
    assert "height" not in data.observables
    assert noted(data, "row 2: height must be between", "ignored")


@pytest.mark.parametrize(("small", "large"), [("r50", "r90"), ("t75", "t55")])
def test_observables_of_a_heap_that_exclude_each_other_are_ignored(read, small: str, large: str) -> None:
    data = read(angles("base", 25.0) + f"base,1,{small},0.03\nbase,1,{large},0.02\n")
    assert data.observables == ("flank_angle",)
    assert noted(data, "base, replicate 1", f"{small} cannot be above {large}", "(0.03 > 0.02)", "ignored")


def test_every_wrong_row_is_named_at_once(read) -> None:
    with pytest.raises(InputError) as error:
        read("base,1,height,40,m,,\nbase,1,flank_angle,x,,,\n")
    assert [problem.place.rpartition("/")[2] for problem in error.value.problems] == [
        "measured.csv:2: value",
        "measured.csv:3: value",
    ]


@pytest.mark.parametrize(
    ("rows", "header", "message"),
    [
        ("", "condition|replicate|observable|value\n", "name the columns"),
        ("", HEADER.replace("unit", "units"), "known column"),
        ("base,1,flank_angle,,deg,,\nbase,2,clogged,,,,\n", HEADER, "no measured value"),
    ],
)
def test_a_file_that_says_nothing_is_refused(read, rows: str, header: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        read(rows, header)


def test_rows_that_contradict_each_other_are_ignored_and_copies_count_once(read) -> None:
    data = read("base,1,flank_angle,25\nbase,1,flank_angle,27\nbase,1,height,11,mm\nbase,1,height,0.011,m\n")
    assert data.observables == ("height",)
    np.testing.assert_array_equal(data.values["base"], [[0.011]])
    assert noted(data, "rows 2 and 3", "ignored")
    assert noted(data, "rows 4 and 5", "counts once")


def test_what_is_missing_is_noted(read) -> None:
    data = read(angles("base", 25.0, 26.0) + "base,1,height,11,mm\n" + angles("fast", 22.0))
    assert noted(data, "condition wide was not measured")
    assert noted(data, "no held-out condition")
    assert noted(data, "fast", "without height")
    assert noted(data, "base", "only one heap")
    assert not noted(data, "only one condition is fitted")


def test_copies_and_missing_scatter_are_noted(read) -> None:
    rows = "".join(f"base,{i},flank_angle,25\nbase,{i},height,{h},mm\n" for i, h in enumerate((11, 12, 11)))
    data = read(rows)
    assert noted(data, "flank_angle is 25 in all 3 heaps")
    assert noted(data, "heaps 1 and 3", "a copy?")
    assert not noted(data, "heaps 1 and 2")


def test_one_gross_error_is_found_by_the_scatter_of_all_conditions(read) -> None:
    data = read(angles("base", 25, 26, 25.5, 24.5, 2.55) + angles("fast", 22, 23, 22.5, 21.5, 22.2))
    assert noted(data, "base", "2.55", "an error?")
    assert not noted(data, "fast:", "an error?")
    assert not noted(data, "contradict")
    np.testing.assert_array_equal(data.counts("base"), [5])


def test_two_kinds_of_heaps_in_one_condition_are_found(read) -> None:
    data = read(angles("base", 15, 15.2, 15.1, 33, 33.1) + angles("fast", 22, 22.1, 22.2, 21.9, 22))
    assert noted(data, "base", "contradict")
    assert not noted(data, "fast:", "contradict")


def test_sound_data_are_suspected_no_oftener_than_stated(read) -> None:
    suspected = 0
    random = np.random.default_rng(11)
    for _ in range(100):
        rows = random.normal([[25.0], [22.0], [28.0]], 1.0, (3, 5))
        data = read(
            "".join(angles(name, *row) for name, row in zip(("base", "fast", "wide"), rows, strict=True))
        )
        suspected += bool(noted(data, "counts like them") or noted(data, "contradict"))
    # At most 2 x SUSPICION = 2 % of 100; 7 or more then have a probability of 0.4 %.
    assert 2 * data_notes.SUSPICION == 0.02
    assert suspected < 7


def test_the_template_is_valid_once_filled_in(
    write_study: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_study(add=CONDITIONS)
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(app, ["new", "small", "--measured"])
    assert result.exit_code == 0, result.stderr
    path = tmp_path / "small-measured.csv"
    text = path.read_text(encoding="utf-8")
    assert "dem-warp discover small.toml small-measured.csv" in text
    assert "fast: scene.lifted-cylinder.lift_speed = 0.25 m/s" in text
    assert "wide: scene.lifted-cylinder.diameter = 40 mm (held out" in text
    study = load_study("small.toml")
    with pytest.raises(InputError, match="no measured value"):
        measured_file.read_measured(path, study)

    values = dict.fromkeys(NAMES, "0.1") | {"flank_angle": "25", "height": "12", "r50": "15", "r90": "30"}
    values |= {"fill_height": "28", "centre_height": "5", "t55": "0.2"}
    head = [line for line in text.splitlines(keepends=True) if line.startswith("#")]
    rows = list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))
    with path.open("w", encoding="utf-8", newline="") as file:
        file.writelines(head)
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(row | {"value": values[row["observable"]]} for row in rows)
    data = measured_file.read_measured(path, study)
    assert data.conditions == ("base", "fast", "wide")
    assert data.observables == NAMES
    assert {rows.shape for rows in data.values.values()} == {(5, 12)}
    assert data.mean("base")[2] == pytest.approx(0.012, rel=1e-15)
