"""The name of a machine in records."""

import re
from pathlib import Path

import pytest

from experiments.evidence import machine


def test_a_machine_is_named_where_no_file_tells_of_it(monkeypatch: pytest.MonkeyPatch) -> None:
    def no_such_file(*_: object, **__: object) -> str:
        raise FileNotFoundError

    monkeypatch.setattr(Path, "read_text", no_such_file)
    named = machine.machine("cpu")
    assert re.match(r"one core of \S.*, Warp ", named)
