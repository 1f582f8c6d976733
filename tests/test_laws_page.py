"""The page of contact laws names every choice and every set, and nothing that does not exist."""

import re
from pathlib import Path

from dem_warp.laws.conventions import PRESETS, ContactLaws
from dem_warp.parameters import choices_of

CHOICES = choices_of(ContactLaws)
PAGE = Path(__file__).parents[1] / "docs" / "laws.md"


def rows() -> list[list[str]]:
    """Cells of every row of every table."""
    lines = PAGE.read_text(encoding="utf-8").splitlines()
    # a bar inside a cell is written \|
    return [
        [cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in lines if line[:1] == "|"
    ]


def test_every_choice_has_its_row_with_formula_lever_direction_limit_keyword_and_source() -> None:
    named = [re.fullmatch(r"(\w+): `(\w+)`", row[0]) for row in rows()]
    found = [(match[1], match[2]) for match in named if match]
    assert found == [(law, choice) for law, known in CHOICES.items() for choice in known]
    table = [row for row, match in zip(rows(), named, strict=True) if match]
    assert all(len(row) == 7 and all(row) for row in table)


def test_the_table_of_sets_is_that_of_the_engine() -> None:
    header = next(row for row in rows() if row[0] == "law" and row[1] == "`edem`")
    assert [name.strip("`") for name in header[1:]] == list(PRESETS)
    table = {row[0]: row[1:] for row in rows() if row[0] in CHOICES}
    assert table == {law: [getattr(laws, law) for laws in PRESETS.values()] for law in CHOICES}
