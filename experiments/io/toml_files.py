"""TOML files: read with the place of what is wrong, and written."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from experiments.io.errors import InputError, StudyError
from experiments.io.texts import read_text

LARGEST = 500_000
"""Bytes of the largest file; studies and cards have some thousands."""

DEEPEST = 20
"""Levels of nested tables and lists that a file may have."""

MOST_DOTS = 100
"""Dots in one part of a line: the time to read a key grows with the square of its levels."""

LONGEST_SHOWN = 200
"""Characters of a wrong line that are shown."""


def read_toml(path: Path) -> tuple[str, dict[str, Any]]:
    """Read a TOML file: its text and its document; StudyError when it cannot be read or is not TOML."""
    try:
        text = read_text(path, LARGEST).replace("\r\n", "\n")
        _check_keys(text)
        document = tomllib.loads(text)
        _check(document)
        return text, document
    except tomllib.TOMLDecodeError as error:
        found = re.search(r"at line (\d+)", str(error))
        number = int(found[1]) if found else len(text.splitlines())
        # tomllib ends a line at \n alone
        shown = "".join(text.split("\n")[number - 1 : number]).strip()[:LONGEST_SHOWN]
        raise StudyError(f"{path}:{number}", f"is not valid TOML: {error}", shown) from None
    except RecursionError:
        raise StudyError(str(path), f"has more than {DEEPEST} levels of tables and lists") from None
    except InputError as error:
        raise StudyError.of(error.problems) from None
    except ValueError as error:
        # e.g. an integer of thousands of digits
        raise StudyError(str(path), f"is not valid TOML: {error}") from None


def _check_keys(text: str) -> None:
    """Refuse keys of very many levels before they are read."""
    if any(part.count(".") > MOST_DOTS for part in re.split(r"[\n,=\[\]{}]", text)):
        raise RecursionError


def _check(document: Mapping[str, Any]) -> None:
    """Refuse too many levels, without recursion, and integers that TOML does not have."""
    level: list[Any] = [document]
    for _ in range(DEEPEST):
        inner = [value for each in level for value in (each.values() if isinstance(each, Mapping) else each)]
        if large := [value for value in inner if isinstance(value, int) and not -(2**63) <= value < 2**63]:
            raise ValueError(f"integers have 64 bits, not {str(large[0])[:40]} ...")
        level = [value for value in inner if isinstance(value, Mapping | list)]
    if level:
        raise RecursionError


def leaves(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the values of nested tables with their dotted places."""
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from leaves(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def toml_text(document: Mapping[str, Any], path: tuple[str, ...] = (), array: bool = False) -> str:
    """Write nested tables of text, numbers, truth values, lists of them and lists of tables as TOML.

    Keys whose value is None are skipped; `path` is the key path of the document, `array` if of an array.
    """
    lists = {key: value for key, value in document.items() if isinstance(value, list | tuple)}
    arrays = {key: value for key, value in lists.items() if value and isinstance(value[0], Mapping)}
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


def _key(key: str) -> str:
    return key if re.fullmatch(r"[\w-]+", key, re.ASCII) else _text(key)


def _text(text: str) -> str:
    # TOML takes all that JSON takes, save the one control character that JSON does not escape
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _value(value: Any) -> str:
    match value:
        case bool():
            return "true" if value else "false"
        case str():
            return _text(value)
        case int() | float():
            return repr(value)
        case list() | tuple():
            return f"[{', '.join(map(_value, value))}]"
        case _:
            raise TypeError(f"a {type(value).__name__} has no form in TOML")
