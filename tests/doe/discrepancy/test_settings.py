"""The rules of an analysis: written, hashed, read again, refused where they make no sense."""

import json
from dataclasses import fields, replace
from pathlib import Path

import pytest

from doe.discrepancy import Settings, settings_of
from doe.errors import RuleError


def test_rules_come_back_from_their_file_with_their_hash(tmp_path: Path) -> None:
    rules = Settings(tie_margin=4.5, resolvable=("shape", "vibration"))
    rules.write(tmp_path / "settings.json")
    written = json.loads((tmp_path / "settings.json").read_text(encoding="utf-8"))
    back = settings_of(written, "settings.json")
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
        ({"false_alarm": 0.0}, "false_alarm: must be between 0 and 1"),
        ({"bank_repeats": 1}, "bank_repeats: must be a whole number of at least 2"),
        ({"bank_points": 24.5}, "bank_points: must be a whole number"),
        ({"bank_points": 10**9}, "bank_points: must be .* at most 100,000"),
        ({"tie_margin": -1.0}, "tie_margin: must not be negative"),
    ],
)
def test_a_rule_without_sense_is_refused(rule: dict[str, float], message: str) -> None:
    with pytest.raises(RuleError, match=message):
        replace(Settings(), **rule)


def test_an_unknown_rule_is_refused_with_its_place() -> None:
    with pytest.raises(RuleError, match=r"settings\.json: must be one of .*tie_margin.*, got tie_margn"):
        settings_of({"tie_margn": 3.0}, "settings.json")
