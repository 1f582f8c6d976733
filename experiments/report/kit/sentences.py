"""Sentences of the reports, from ``texts.toml``."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from functools import cache
from importlib.resources import files


@cache
def texts() -> Mapping[str, Mapping[str, str]]:
    """Read every text by the name of its part and its own name."""
    return tomllib.loads((files("experiments.report") / "texts.toml").read_text(encoding="utf-8"))


def say(name: str, /, **values: object) -> str:
    """Return the text ``PART.NAME`` with its values filled in."""
    part, _, key = name.partition(".")
    return texts()[part][key].format(**values)
