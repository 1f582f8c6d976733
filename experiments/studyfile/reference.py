"""Reference of the study file: every section and key, as the sections themselves say."""

from __future__ import annotations

import ast
import functools
import inspect
import json
import math
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from types import NoneType
from typing import Annotated, Any, Literal, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt
from pydantic import AfterValidator, BaseModel
from pydantic.fields import FieldInfo

from experiments.io.units import UNITS, Quantity
from experiments.studyfile.schema import Generated, dimension_of, fields_of, marks_of, section_of
from experiments.studyfile.study import Study

_KINDS = {
    Any: "any value",
    Path: "text",
    Quantity: "quantity",
    bool: "true or false",
    float: "number",
    int: "whole number",
    str: "text",
}


@dataclass(frozen=True)
class Row:
    """A key of the study file, or a section of it."""

    section: str
    """Its section, as ``[scene.drum]``; of one among several, as ``[[factor]]`` and ``[condition.NAME]``."""
    key: str
    """The key; empty: the row is about the section."""
    kind: str = ""
    """Units that it may be written in, the base unit first, or the kind of its value."""
    default: str = ""
    """Default, as a file would write it; empty where there is none or the key is required."""
    bounds: str = ""
    """Rule of its numbers."""
    meaning: str = ""
    """One line in words."""
    required: bool = False
    """The key must be written."""


def study_reference() -> tuple[Row, ...]:
    """List every section and key of a study file, those of plug-ins included."""
    return (
        Row("", "material", "text", meaning="Material card whose sections hold where the study lacks them."),
        *_rows(Study, ""),
        Row("[scale.NAME]", "", meaning="Sections that differ at a scale; factor.NAME changes a factor."),
    )


def meanings(kind: type) -> dict[str, str]:
    """Texts below the fields of a class and of its bases, each on one line."""
    found: dict[str, str] = {}
    for each in reversed(inspect.getmro(kind)[:-1]):
        if each.__module__.startswith("pydantic."):
            continue
        for pair in pairwise(_bodies(each.__module__)[each.__name__]):
            match pair:
                case ast.AnnAssign(target=ast.Name(id=name)), ast.Expr(value=ast.Constant(value=str(words))):
                    found[name] = " ".join(words.split())
    return found


@functools.cache
def _bodies(module: str) -> dict[str, list[ast.stmt]]:
    """Statements of the classes of a module, by name."""
    tree = ast.parse(inspect.getsource(sys.modules[module]))
    return {node.name: node.body for node in ast.walk(tree) if isinstance(node, ast.ClassDef)}


def _rows(section: type[BaseModel], path: str, array: bool = False) -> Iterator[Row]:
    described = getattr(section, "engine", section)
    head = f"[[{path}]]" if array else f"[{path}]" if path else ""
    yield Row(head, "", meaning=_sentence(described))
    keys = [(key, name, field, section_of(field)) for key, (name, field) in fields_of(section).items()]
    texts = meanings(described) if any(inner is None for *_, inner in keys) else {}
    if described is not section:
        texts = meanings(section.__bases__[0]) | texts
    for key, name, field, inner in keys:
        if inner is None:
            cells = (_kind(field), _default(field), _rule(field), texts.get(name, ""))
            yield Row(head, key, *cells, required=field.is_required())
        elif default := _name(field):
            yield Row(head, key, "text", json.dumps(default), "", texts.get(name, ""))
    for key, _, field, inner in keys:
        below = f"{path}.{key}".removeprefix(".")
        if key == "response-scene":
            yield Row(f"[{below}.NAME]", "", meaning=texts[key.replace("-", "_") + "s"])
        elif inner is not None:
            origin = get_origin(field.annotation)
            yield from _rows(inner, f"{below}.NAME" if origin is dict else below, origin is tuple)


def _sentence(described: type) -> str:
    """First line of a docstring, without the name of the section before it."""
    line = (inspect.getdoc(described) or "").partition("\n")[0]
    sentence = line.partition("``: ")[2] if line.startswith("``[") and "``: " in line else line
    return sentence[:1].upper() + sentence[1:]


def _kind(field: FieldInfo) -> str:
    dimension = dimension_of(field)
    return ", ".join(UNITS[dimension.name]) if dimension and dimension.name else _type(field.annotation)


def _type(kind: Any) -> str:
    inner = [each for each in get_args(kind) if each not in (NoneType, ...)]
    match get_origin(kind):
        case None:
            return _KINDS[kind]
        case origin if origin is Literal:
            return " or ".join(json.dumps(each) for each in inner)
        case origin if origin is Annotated:
            return _type(inner[0])
        case origin if origin is tuple:
            return f"list of {_type(inner[0])}"
        case origin if origin is dict:
            return f"table of {_type(inner[1])}"
        case _:
            return " or ".join(map(_type, inner))


def _default(field: FieldInfo) -> str:
    value: Any = field.default
    if field.is_required() or value is None:
        return ""
    dimension = dimension_of(field)
    if dimension and dimension.name:
        written = math.degrees(value) if AfterValidator(math.radians) in field.metadata else value
        return f"{written:g} {next(iter(UNITS[dimension.name]))}"
    return json.dumps(value)


def _name(field: FieldInfo) -> str:
    """Default of a field that takes a name as well as a section; empty for any other."""
    return next((mark.name for mark in marks_of(field) if isinstance(mark, Generated)), "")


def _rule(field: FieldInfo) -> str:
    """Bounds in the base unit, as ``> 0, <= 0.5``."""
    signs = {Gt: (">", "gt"), Ge: (">=", "ge"), Lt: ("<", "lt"), Le: ("<=", "le")}
    marks = [(mark, *signs[type(mark)]) for mark in marks_of(field) if type(mark) in signs]
    return ", ".join(f"{sign} {getattr(mark, name):g}" for mark, sign, name in marks)
