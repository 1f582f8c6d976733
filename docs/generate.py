"""Pages made from the program itself: study file, commands, Python, observables, effects, large campaigns."""

from __future__ import annotations

import ast
import inspect
import re
import tomllib
from collections.abc import Iterable
from importlib import import_module
from itertools import groupby, pairwise
from pathlib import Path
from types import ModuleType
from typing import Any

import typer
from typer.main import get_command

from dem_warp import SCENES
from experiments.cli import app
from experiments.discover.mechanism_files import FILES
from experiments.studyfile.observables import OBSERVABLES, OUTLINE, READINGS
from experiments.studyfile.reference import Row, study_reference


def escaped(text: str) -> str:
    """Text that may stand in a cell; what is between backticks is shown as it is."""
    parts = text.replace("|", "\\|").replace("\n", " ").split("`")
    parts[::2] = [part.replace("<", "&lt;") for part in parts[::2]]
    return "`".join(parts)


def markdown_table(head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    """Write rows as a table."""
    lines = [head, tuple("---" for _ in head), *rows]
    return "\n".join(f"| {' | '.join(escaped(cell) or ' ' for cell in line)} |" for line in lines)


def study_page() -> str:
    """Every section and key of a study file."""
    parts = [
        "# The study file",
        "Every section and every key, as the program checks them, and what holds where a key is left out. "
        'Write a quantity with its unit, `"110 mm"`. A misspelt key is an error.',
    ]
    for section, found in groupby(study_reference(), lambda row: row.section):
        rows = list(found)
        about = " ".join(row.meaning for row in rows if not row.key)
        parts.append(f"## `{section}`" if section else "## At the top")
        parts += [about] if about else []
        keys = [
            (f"`{row.key}`", row.kind, _left_out(row), row.bounds, row.meaning) for row in rows if row.key
        ]
        if keys:
            parts.append(markdown_table(("key", "written as", "left out", "rule", "meaning"), keys))
    return "\n\n".join(parts)


def _left_out(row: Row) -> str:
    """Say what holds where a key is left out: its default, or an error."""
    return "*required*" if row.required else f"`{row.default}`" if row.default else ""


def commands_page() -> str:
    """Every command with its arguments and options."""
    codes = "0 done, 1 a run that failed, 2 bad input, 130 interrupted, 143 ended by a scheduler"
    parts = ["# The command line", f"Every command has `--help`. Exit codes: {codes}."]
    group = get_command(app)
    return "\n\n".join([*parts, *_commands(group, typer.Context(group, info_name="dem-warp"))])


def _commands(group: Any, context: typer.Context) -> list[str]:
    """Describe the commands of a group, and those of its groups."""
    parts = []
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        inner = typer.Context(command, info_name=name, parent=context)
        if hasattr(command, "list_commands"):
            parts += _commands(command, inner)
            continue
        # typer puts what is required into braces
        usage = re.sub("[{}]", "", command.get_usage(inner).removeprefix("Usage: "))
        parts += [f"## {inner.command_path}", command.help or "", f"`{usage}`"]
        records = [
            parameter.get_help_record(inner)
            for parameter in command.get_params(inner)
            if parameter.name != "help"
        ]
        rows = [(f"`{record[0].strip()}`", record[1]) for record in records if record]
        parts.append(markdown_table(("option", "meaning"), rows))
    return parts


def observables_page() -> str:
    """Numbers that a test yields."""
    rows = [
        (
            f"`{each.alias or each.name}`",
            each.title,
            each.unit,
            each.instrument.value if each.instrument else "",
            each.definition,
        )
        for each in (*OBSERVABLES, *READINGS, *OUTLINE)
    ]
    parts = [
        "# List of observables",
        "A study's target and responses name them, and so does a file of measured heaps.",
        "## Measured on a heap",
        markdown_table(("name", "meaning", "unit", "instrument", "definition"), rows),
    ]
    for name, scene in SCENES.items():
        rows = [(f"`{each}`", unit, meaning) for each, (unit, meaning) in scene.observables.items()]
        parts += [f"## Measured by `[scene.{name}]`", markdown_table(("name", "unit", "definition"), rows)]
    return "\n\n".join(parts)


def meaning_of(module: ModuleType, name: str) -> str:
    """Return what the line below a constant says, in the module that assigns it."""
    taken = (node for node in ast.walk(source_of(module)) if isinstance(node, ast.ImportFrom) and node.module)
    homes = [node.module for node in taken if name in {alias.name for alias in node.names}]
    body = source_of(import_module(homes[0]) if homes else module).body
    for node, after in pairwise(body):
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        if name in {getattr(target, "id", "") for target in targets} and isinstance(after, ast.Expr):
            return " ".join(ast.literal_eval(after.value).split())
    return ""


def source_of(module: ModuleType) -> ast.Module:
    """Parse a module's source."""
    return ast.parse(inspect.getsource(module))


def python_page(package: str, about: str) -> str:
    """Every public name of a package."""
    module = import_module(package)
    groups: dict[str, list[str]] = {"Functions": [], "Classes": [], "Constants": []}
    for name in (each for each in module.__all__ if not each.startswith("__")):
        thing = getattr(module, name)
        if inspect.isclass(thing):
            group, entry = "Classes", f".. autoclass:: {package}.{name}\n   :members:"
        elif inspect.isroutine(thing):
            group, entry = "Functions", f".. autofunction:: {package}.{name}"
        else:
            group, entry = "Constants", f".. py:data:: {package}.{name}\n\n   {meaning_of(module, name)}"
        groups[group].append(entry)
    parts = [f"# `{package}`", about]
    for group, entries in groups.items():
        if entries:
            parts.append(f"## {group}\n\n```{{eval-rst}}\n" + "\n\n".join(entries) + "\n```")
    return "\n\n".join(parts)


def effects_page() -> str:
    """Every effect that a search knows."""
    effects = {name: tomllib.loads(path.read_text(encoding="utf-8")) for name, path in sorted(FILES.items())}
    rows = [
        (f"`{name}`", effect["title"], effect["sentence"], effect["source"], effect["confirm"])
        for name, effect in effects.items()
    ]
    return "\n\n".join(
        [
            "# Effects that a search knows",
            "`dem-warp discover` tests each that the study can have. `[discover] mechanisms` names fewer, "
            "`[discover.maxima]` other largest sizes.",
            markdown_table(("name", "effect", "in words", "law and range", "what would confirm it"), rows),
        ]
    )


PACKAGES = {
    "experiments.api": "Whole runs: calibration, search and bridge. The command line calls these functions.",
    "experiments.studyfile": "Study files and material cards, read and checked.",
    "experiments.cases": "Cases: running, storing and measuring them; engines.",
    "dem_warp": "The simulator: cases in, heaps out. SI units, z up, the plate at 0.",
    "imaging": "Pictures and repose angles.",
    "doe": "Designs of experiments and their analysis. They know nothing of grains.",
}
"""Packages with public names, in the order of the reference."""


def write_pages(folder: Path) -> None:
    """Write the pages into a folder."""
    folder.mkdir(exist_ok=True)
    pages = {
        "study": study_page(),
        "commands": commands_page(),
        "observables": observables_page(),
        "effects": effects_page(),
    }
    pages |= {name.replace(".", "-"): python_page(name, about) for name, about in PACKAGES.items()}
    for name, text in pages.items():
        (folder / f"{name}.md").write_text(text + "\n", encoding="utf-8")
