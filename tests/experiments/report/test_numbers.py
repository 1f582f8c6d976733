"""Numbers and sentences as a reader expects them."""

import pandas as pd
import pytest
from page_reader import Page

from experiments.report.kit import numbers
from experiments.report.kit.html import flat
from experiments.report.kit.markdown import markdown_table
from experiments.report.kit.table import Column, make_table


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (numbers.fixed(-0.004, 2), "0.00"),
        (numbers.fixed(-1.234, 2), "−1.23"),
        (numbers.fixed(12345.6, 1), "12\u202f345.6"),
        (numbers.fixed(float("nan"), 2), "–"),
        (numbers.significant(0.00123456), "0.001235"),
        (numbers.significant(1.0e-9), "1.000e−09"),
        (numbers.trimmed(0.4600, 4), "0.46"),
        (numbers.trimmed(340.0, 2), "340"),
        (numbers.p_value(3e-6), "< 0.0001"),
        (numbers.p_value(0.05), "0.0500"),
        (numbers.plain({"E": 0.5, "F": None}), "E 0.5, F –"),
        (numbers.plain((True, 3)), "yes, 3"),
        (
            numbers.prose("from -0.58 to +0.60 deg, p-value, degrees"),
            "from −0.58 to +0.60°, p-value, degrees",
        ),
        (numbers.enumeration(["B", "E", "F"]), "B, E and F"),
        (numbers.enumeration(["E"]), "E"),
        (flat({"a": {"b": 1.5}, "c": [{"d": 2}], "e": {}}), {"a.b": "1.5", "c 1.d": "2", "e": "–"}),
    ],
)
def test_numbers_read_as_a_reader_expects(text: object, expected: object) -> None:
    assert text == expected


def test_an_equation_is_typeset_with_signs_and_powers() -> None:
    text = numbers.equation({"intercept": -60.8, "E:F": 121.17, "E^2": -72.09}, digits=4)
    assert (
        Page(f"<p>{text}</p>").text.replace("\xa0", " ").replace("\u2009", " ")
        == "−60.80 + 121.2 E·F − 72.09 E2"
    )
    assert "<sup>2</sup>" in text


def test_a_markdown_table_is_one() -> None:
    frame = pd.DataFrame({"name": ["a|b", "c"], "size": [1.0, 2.5]})
    columns = [Column("name", "name"), Column("size", "size", "ratio", "mm")]
    table = make_table("t", frame, columns, "Sizes.", "A note.", ["strong", ""])
    assert markdown_table(table).splitlines() == [
        "*Sizes.*", "", "| name | size [mm] |", "| --- | ---: |", "| **a\\|b** | 1.00 |", "| c | 2.50 |", "",
        "A note.",
    ]  # fmt: skip
