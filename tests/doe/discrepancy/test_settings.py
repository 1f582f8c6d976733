"""The rules of an analysis: written, hashed, read again, refused where they make no sense."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path

import pytest

from doe.discrepancy import Settings
from doe.discrepancy.problem.settings import read_settings
from doe.errors import RuleError


def test_rules_come_back_from_their_file_with_their_hash(tmp_path: Path) -> None:
    rules = Settings(tie_margin=4.5, resolvable=("shape", "vibration"))
    rules.write(tmp_path / "settings.json")
    back = read_settings(tmp_path / "settings.json")
    assert back == rules
    assert back.sha256 == rules.sha256


def test_every_rule_is_in_the_hash() -> None:
    plain = Settings()
    for field in fields(Settings):
        value = getattr(plain, field.name)
        other = ("shape",) if value is None else value + 1 if isinstance(value, int) else value / 2.0
        assert replace(plain, **{field.name: other}).sha256 != plain.sha256, field.name


@pytest.mark.parametrize(
    ("rule", "message"),
    [
        ({"false_alarm": 0.0}, "false_alarm: must lie between 0 and 1"),
        ({"bank_repeats": 1}, "bank_repeats: must be at least 2"),
        ({"tie_margin": -1.0}, "tie_margin: must not be negative"),
    ],
)
def test_a_rule_without_sense_is_refused(rule: dict[str, float], message: str) -> None:
    with pytest.raises(RuleError, match=message):
        replace(Settings(), **rule)


def test_an_unknown_rule_is_refused_with_its_file(tmp_path: Path) -> None:
    path = tmp_path / "settings.json"
    path.write_text('{"tie_margn": 3.0}')
    with pytest.raises(
        RuleError, match=r"settings\.json: must be one of .*tie_margin.* \(received tie_margn\)"
    ):
        read_settings(path)


def test_a_file_that_is_no_json_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "settings.json"
    path.write_text("tie_margin = 3")
    with pytest.raises(RuleError, match="must be a JSON object"):
        read_settings(path)
