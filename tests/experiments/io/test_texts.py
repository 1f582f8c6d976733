"""Texts as people's programs write them: marks, encodings, commas, units, brackets."""

import math
import re
import time
from pathlib import Path

import pytest
import typer
from commandline import refused

from dem_warp.device import resolve_device
from experiments.cli import app
from experiments.commands.results import HEAP_COLUMNS, print_angles
from experiments.io.errors import LONGEST_VALUE, MOST_PROBLEMS, InputError, Problem
from experiments.io.rows import read_rows
from experiments.io.texts import is_number, read_text
from experiments.io.units import Quantity
from experiments.studyfile import load_study

CSV = "name,value,note\nα,1.5,a b\nb,-2.25e3,1 mm\n"
EXCEL = "name;value;note\r\nα;1,5;a b\r\nb;-2,25e3;1 mm\r\n"

SMALL_STUDY = (Path(__file__).parents[1] / "small.toml").read_text(encoding="utf-8")


@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"])
@pytest.mark.parametrize("text", [CSV, EXCEL, EXCEL.replace(";", "\t")])
def test_tables_of_german_excel_are_read(tmp_path: Path, mark: bytes, text: str) -> None:
    (tmp_path / "t.csv").write_bytes(mark + text.encode())
    rows = list(read_rows(tmp_path / "t.csv", ["name", "value"], ["name", "value", "note"]))
    assert [(row.line, dict(row.cells)) for row in rows] == [
        (2, {"name": "α", "value": "1.5", "note": "a b"}),
        (3, {"name": "b", "value": "-2.25e3", "note": "1 mm"}),
    ]


@pytest.mark.parametrize("text", ["1", "-1.", ".5", "+2.5e-3", "1E5", "NaN", "-inf", "Infinity"])
def test_numbers_are_known(text: str) -> None:
    assert is_number(text)
    assert not is_number(f"{text}x")


def test_a_long_row_of_digits_takes_no_longer_than_reading_it() -> None:
    started = time.process_time()
    assert not is_number("9" * 1_000_000 + "x")
    assert time.process_time() - started < 2.0


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-32"])
def test_wide_encodings_are_named(tmp_path: Path, encoding: str) -> None:
    (tmp_path / "t").write_bytes(CSV.encode(encoding))
    with pytest.raises(InputError, match=encoding[:6].upper()):
        read_text(tmp_path / "t")


@pytest.mark.parametrize(
    ("text", "dimension", "value"),
    [
        ("698 kg/m3", "density", 698.0),
        ("698 kg/m**3", "density", 698.0),
        ("0.698 g/cm³", "density", 698.0),
        ("1.2 g/cm^3", "density", 1200.0),
        (" 1.5e-3  m ", "length", 1.5e-3),
        ("28mm", "length", 0.028),
        ("5 µm", "length", 5e-6),
        ("5 μm", "length", 5e-6),
        ("34.325 MPa", "pressure", 34.325e6),
        ("3000 1/s", "rate", 3000.0),
        ("250 ms", "time", 0.25),
        ("30°", "angle", 30.0),
        ("0.5 rad", "angle", math.degrees(0.5)),
        ("2 J/m²", "surface energy", 2.0),
        ("+3", "", 3.0),
    ],
)
def test_units_are_known_as_people_write_them(text: str, dimension: str, value: float) -> None:
    # The nearest double to the decimal value, or one rounding away from it (degrees).
    assert Quantity.parse(text).to_base(dimension) == pytest.approx(value, rel=3e-16)


@pytest.mark.parametrize(
    ("text", "readings"),
    [
        ("28,5 mm", '"28.5 mm"'),
        (" -1,2e3 kg/m3", '"-1.2e3 kg/m3"'),
        ("1,250 kg/m^3", '"1.250 kg/m^3" or "1250 kg/m^3"'),
        ("1,250,000 Pa", '"1250000 Pa"'),
        ("0,250 mm", '"0.250 mm"'),
        ("1,25,0 mm", "one number"),
    ],
)
def test_both_readings_of_a_comma_are_named(text: str, readings: str) -> None:
    with pytest.raises(ValueError, match=f"decimal point if any: {re.escape(readings)}$"):
        Quantity.parse(text)


def test_long_values_and_many_problems_are_cut_short() -> None:
    error = InputError("here", "must be short", "x" * 10_000_000)
    assert len(str(error)) < 2 * LONGEST_VALUE
    assert "(10000000 characters)" in str(error)
    many = InputError.of(Problem(f"line {n}", "must be", str(n)) for n in range(1000))
    assert len(str(many).splitlines()) == MOST_PROBLEMS + 1
    assert len(many.problems) == 1000


def test_an_error_has_a_place_a_problem_a_value_and_a_hint() -> None:
    assert str(InputError("g.stl", "no such file")) == "g.stl: no such file"
    assert str(InputError("x", "must be one", "2", "Use 1.")) == "x: must be one, got 2. Use 1."


def test_a_value_after_a_question_begins_a_sentence() -> None:
    asked = Problem("s.toml: grain.size_sdd", "unknown key, did you mean 'size_sd'?", "500.0")
    assert str(asked) == "s.toml: grain.size_sdd: unknown key, did you mean 'size_sd'? Got 500.0"


def test_a_machine_without_a_gpu_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dem_warp.device.wp.get_devices", lambda: ["cpu"])
    with pytest.raises(ValueError, match="no NVIDIA GPU with a CUDA driver was found"):
        resolve_device("cuda")


def test_brackets_are_no_markup(capsys: pytest.CaptureFixture[str]) -> None:
    row = {"picture": "heap[bold].png", "left": 1.0, "right": 1.0, "mean": 1.0, "se": 0.1, "doubts": []}
    print_angles([row], "Repose angles", HEAP_COLUMNS)
    assert "heap[bold].png" in capsys.readouterr().out
    assert "[red]none[blue].toml" in refused("heap", "[red]none[blue].toml", "--device", "cpu")


def commands() -> dict[str, typer.core.TyperCommand]:
    group = typer.main.get_command(app)
    return group.commands  # type: ignore[attr-defined]


@pytest.mark.parametrize("name", commands())
def test_no_bracket_of_a_help_text_is_taken_for_markup(name: str) -> None:
    unescaped = re.compile(r"(?<!\\)\[(?!bold\]|/\])[a-z#/@]")
    helps = [commands()[name].help, *(getattr(each, "help", "") for each in commands()[name].params)]
    assert [text for text in helps if text and unescaped.search(text)] == []


def test_a_narrow_tube_is_reported(tmp_path: Path) -> None:
    """Grains are 4 mm long: 7 and 3.5 of them fit across."""
    path = tmp_path / "s.toml"
    for diameter, said in (("28 mm", ""), ("14 mm", "3.5 lengths")):
        path.write_text(SMALL_STUDY.replace('diameter = "28 mm"', f'diameter = "{diameter}"'), "utf-8")
        doubts = load_study(path).doubts()
        assert len(doubts) == bool(said)
        assert all(said in doubt for doubt in doubts)


@pytest.mark.parametrize(("density", "doubts"), [("1.250", 1), ("50", 0), ("7850", 0), ("78500", 1)])
def test_a_density_of_no_solid_is_doubted(density: str, doubts: int, tmp_path: Path) -> None:
    path = tmp_path / "s.toml"
    path.write_text(re.sub(r'density = "\d+', f'density = "{density}', SMALL_STUDY, count=1), "utf-8")
    found = load_study(path).doubts()
    assert len(found) == doubts
    assert all(one.startswith("grain.density") for one in found)
