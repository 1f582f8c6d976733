"""TOML files: read with the place of what is wrong, and written."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from experiments.errors import StudyError


def read_toml(path: Path, what: str = "the study") -> tuple[str, dict[str, Any]]:
    """Read a TOML file: its text, and what it says.

    Parameters
    ----------
    path
        The file.
    what
        What it is, for the error message.

    Raises
    ------
    StudyError
        When it cannot be read, or is no TOML.
    """
    try:
        text = path.read_text(encoding="utf-8")
        return text, tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        found = re.search(r"at line (\d+)", str(error))
        number = int(found[1]) if found else len(text.splitlines())
        shown = text.splitlines()[number - 1].strip()
        raise StudyError(f"must be valid TOML: {error}", shown, f"{path}:{number}") from None
    except UnicodeDecodeError:
        raise StudyError("must be a text file in UTF-8", "other bytes", str(path)) from None
    except OSError as error:
        raise StudyError(f"{what} must be a readable file", error.strerror or "none", str(path)) from None


def toml_text(document: Mapping[str, Any], path: tuple[str, ...] = ()) -> str:
    """Write nested tables of text, numbers, truth values and lists of them as TOML; None is left out."""
    values = {key: value for key, value in document.items() if not isinstance(value, Mapping)}
    lines = [f"{_key(key)} = {_value(value)}" for key, value in values.items() if value is not None]
    if path and (lines or not document):
        lines.insert(0, f"[{'.'.join(map(_key, path))}]")
    parts = ["\n".join(lines)] if lines else []
    tables = {key: value for key, value in document.items() if isinstance(value, Mapping)}
    parts += [toml_text(table, (*path, key)).rstrip() for key, table in tables.items()]
    return "\n\n".join(parts) + "\n"


def _key(key: str) -> str:
    return key if re.fullmatch(r"[\w-]+", key, re.ASCII) else json.dumps(key, ensure_ascii=False)


def _value(value: Any) -> str:
    match value:
        case bool():
            return "true" if value else "false"
        case str():
            return json.dumps(value, ensure_ascii=False)
        case int() | float():
            return repr(value)
        case list() | tuple():
            return f"[{', '.join(map(_value, value))}]"
        case _:
            raise TypeError(f"a {type(value).__name__} has no form in TOML")
