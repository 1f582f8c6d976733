"""Texts of a study reach other codes, spreadsheets and headings as data: never as a command of theirs."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import pandas as pd
import pytest
from exported_lift import exported_lift
from hypothesis import given
from hypothesis import strategies as st

from experiments.export import EXPORTERS, Translation, export_input, write_export
from experiments.export.exporter import ExportedTest
from experiments.io.texts import is_number, safe_cell, safe_text
from experiments.report.writer import write_files
from experiments.studyfile import load_study

CODES = sorted(code for code, exporter in EXPORTERS.items() if exporter.translate is not None)
BREAKS = "\n\r\v\f\x1c\x1d\x1e\x85\u2028\u2029\0"
ATTACKS = (
    *(f"wheat{mark}shell touch hacked" for mark in BREAKS), "wheat &", 'wheat """', "wheat \\", "wheat ??/",
    "*/ int main() {}", '"""; import os', "`touch hacked`", "$(touch hacked)", "=cmd|' /C calc'!A1", "+1+1",
    "-2+3", "@SUM(A1)", "<script>alert(1)</script>", "| a | b |", "--> x", "\u202e wheat",
)  # fmt: skip
HOSTILE = (
    st.sampled_from(ATTACKS) | st.text(max_size=60) | st.text(alphabet=BREAKS + '"\\&*/`$=#', max_size=9)
)
TABLES = {"README.md", "values.md"}


@cache
def _translated(code: str) -> Translation:
    return export_input(exported_lift("edem"), code, approximate=True)


def _written(code: str, text: str, folder: Path) -> dict[str, str]:
    """Return the files of an export whose every text is `text`."""
    test = exported_lift("edem")
    hostile = ExportedTest(text, test.case, text, {text: text}, text)
    translation = replace(export_input(hostile, code, approximate=True), warnings=(text,))
    return {path.name: path.read_text("utf-8") for path in write_export(hostile, code, translation, folder)}


@cache
def _harmless(code: str) -> dict[str, str]:
    with TemporaryDirectory() as folder:
        return _written(code, "wheat", Path(folder))


def _commands(text: str, comment: str) -> list[str]:
    """Return the lines of a file that are no comments, cut where its languages cut them."""
    return [line for line in text.split("\n") if not line.startswith(comment)]


@pytest.mark.parametrize("code", CODES)
@pytest.mark.parametrize("text", ATTACKS)
def test_a_hostile_text_leaves_an_input_as_a_harmless_one_does(code: str, text: str, tmp_path: Path) -> None:
    harmless, got = _harmless(code), _written(code, text, tmp_path)
    comment = _translated(code).comment
    for name in harmless.keys() - TABLES:
        assert _commands(got[name], comment) == _commands(harmless[name], comment)
    # a table has as many rows, each in as many cells
    for name in harmless.keys() & TABLES:
        shape = [[line.count("|") for line in files[name].split("\n")] for files in (harmless, got)]
        assert shape[0] == shape[1]


@given(HOSTILE)
def test_a_safe_text_is_one_line_that_no_language_continues_ends_or_calls(text: str) -> None:
    safe = safe_text(text)
    assert safe
    assert len(safe.splitlines()) == 1
    assert not set(safe) & set('&\\"`$*#<>{}|?!\0')
    assert safe[0] not in "=+-@"
    assert safe_text(safe) == safe


@given(HOSTILE | st.floats(allow_nan=False).map(repr))
def test_a_cell_is_no_formula_and_numbers_stay_numbers(text: str) -> None:
    cell = str(safe_cell(text))
    assert is_number(cell) or not cell.startswith(("=", "+", "-", "@", "\t", "\r"))
    assert cell == text or not is_number(text)


def test_a_table_of_results_holds_no_formula(tmp_path: Path) -> None:
    study = load_study(Path("experiments/studies/buckwheat/study.toml"), "bench")
    table = pd.DataFrame({"term": ["=1+1", "E"], "value": [-1.5, 2.0]})
    write_files(tmp_path, study, "", {}, {}, {"effects": table})
    assert (tmp_path / "tables" / "effects.csv").read_text() == "term,value\n'=1+1,-1.5\nE,2.0\n"
