"""The rules of an analysis: written, hashed, read again."""

import json
from dataclasses import fields, replace
from pathlib import Path

from doe.discrepancy import Settings, settings_of


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
