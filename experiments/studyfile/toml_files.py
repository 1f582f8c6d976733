"""TOML files: read with the place of what is wrong, and written."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from experiments.errors import InputError, StudyError
from experiments.texts import read_text


def read_toml(path: Path, what: str = "the study") -> tuple[str, dict[str, Any]]:
    """Read a TOML file, of a kind named for the error message: its text, and what it says.

    Raises
    ------
    StudyError
        When it cannot be read, or is no TOML.
    """
    try:
        text = read_text(path).replace("\r\n", "\n")
        return text, tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        found = re.search(r"at line (\d+)", str(error))
        number = int(found[1]) if found else len(text.splitlines())
        shown = text.splitlines()[number - 1].strip()
        raise StudyError(f"must be valid TOML: {error}", shown, f"{path}:{number}") from None
    except InputError as error:
        raise StudyError(f"{what} {error.rule}", error.value, error.place) from None


def toml_text(document: Mapping[str, Any], path: tuple[str, ...] = (), array: bool = False) -> str:
    """Write nested tables of text, numbers, truth values, lists of them and lists of tables as TOML.

    None is left out; `path` is where the document stands in the file, in an `array` of tables or alone.
    """
    arrays = {key: value for key, value in document.items() if _holds_tables(value)}
    tables = {key: value for key, value in document.items() if isinstance(value, Mapping)}
    values = {key: value for key, value in document.items() if key not in arrays and key not in tables}
    lines = [f"{_key(key)} = {_value(value)}" for key, value in values.items() if value is not None]
    if path and (lines or array or not document):
        head = f"[{'.'.join(map(_key, path))}]"
        lines.insert(0, f"[{head}]" if array else head)
    parts = ["\n".join(lines)] if lines else []
    parts += [toml_text(table, (*path, key)).rstrip() for key, table in tables.items()]
    for key, items in arrays.items():
        parts += [toml_text(item, (*path, key), array=True).rstrip() for item in items]
    return "\n\n".join(parts) + "\n"


def _holds_tables(value: Any) -> bool:
    return isinstance(value, list | tuple) and bool(value) and isinstance(value[0], Mapping)


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
