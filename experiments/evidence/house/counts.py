"""Counts of lines, rooms, imports, data and like code, each with the limit that a test holds.

A room is a folder directly in a package, or a file there. An import between rooms is a pair of rooms.
A floor is the longest chain of imports below a room. Like code is a run of six statements that are equal
once names and values are erased, and that at most eight files share.
"""

from __future__ import annotations

import ast
import io
import subprocess
import tomllib
import zipfile
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cache
from graphlib import CycleError, TopologicalSorter
from itertools import combinations
from pathlib import Path

ROOT = Path(__file__).parents[3]
PACKAGES = ("dem_warp", "doe", "imaging", "experiments")
EVIDENCE = "experiments/evidence/"
MEGABYTE = 1e6

LIKE_STATEMENTS, LIKE_FILES = 6, 8
"""Statements of a run of like code, and files above which such a run is a common form."""
LOOSE = {"__init__", "__main__", "conftest"}
"""Base names that every folder may have."""


@dataclass(frozen=True)
class Count:
    """One row of the table."""

    what: str
    """Subject of the count."""
    value: float
    """Count in this checkout."""
    limit: float
    """Most that a test allows."""


@cache
def tracked() -> tuple[str, ...]:
    """Paths of all files that git tracks, relative to the repository, with ``/``."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True, text=True)
    return tuple(name for name in listed.stdout.split("\0") if name and (ROOT / name).is_file())


def python_files(*prefixes: str) -> list[str]:
    """Paths of tracked Python files below some folders."""
    return [name for name in tracked() if name.endswith(".py") and name.startswith(prefixes)]


@cache
def tree(name: str) -> ast.Module:
    """Syntax tree of a tracked file."""
    return ast.parse((ROOT / name).read_text(encoding="utf-8"), name)


def lines(names: Iterable[str]) -> int:
    """Count the lines of some files."""
    return sum((ROOT / name).read_text(encoding="utf-8").count("\n") for name in names)


def megabytes(names: Iterable[str]) -> float:
    """Size of some files [MB]."""
    return sum((ROOT / name).stat().st_size for name in names) / MEGABYTE


def room(module: str) -> str:
    """Room of a module, as ``experiments.cases``."""
    return ".".join(module.split(".")[:2])


def _modules(package: str) -> dict[str, str]:
    """Modules of a package with their files; the evidence is not part of it."""
    names = (name for name in python_files(package + "/") if not name.startswith(EVIDENCE))
    return {name.removesuffix(".py").removesuffix("/__init__").replace("/", "."): name for name in names}


def _imported(name: str, modules: dict[str, str]) -> Iterator[str]:
    for node in ast.walk(tree(name)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in modules)
        elif isinstance(node, ast.ImportFrom) and node.module in modules:
            inner = (f"{node.module}.{alias.name}" for alias in node.names)
            yield from (each if each in modules else node.module for each in inner)


def imports_between_rooms(package: str) -> set[tuple[str, str]]:
    """Pairs of rooms of a package of which the first imports the second."""
    modules = _modules(package)
    pairs = {
        (room(module), room(other)) for module, name in modules.items() for other in _imported(name, modules)
    }
    return {(above, below) for above, below in pairs if above != below and package not in (above, below)}


def circles_broken(pairs: set[tuple[str, str]]) -> tuple[dict[str, set[str]], int]:
    """Return the pairs without circles, and how many had to be left out for that."""
    below: dict[str, set[str]] = defaultdict(set)
    for above, under in pairs:
        below[above].add(under)
    upward = 0
    while True:
        try:
            TopologicalSorter(below).prepare()
            return below, upward
        except CycleError as error:
            first, second = error.args[1][:2]
            below[second].discard(first)
            upward += 1


def heights(pairs: set[tuple[str, str]]) -> dict[str, int]:
    """Floor of each room, counted from 1."""
    below, _ = circles_broken(pairs)
    height: dict[str, int] = {}
    for name in TopologicalSorter(below).static_order():
        height[name] = 1 + max((height[under] for under in below.get(name, ())), default=0)
    return height


def _shape(node: ast.AST) -> str:
    """Form of a statement without names, values and the statements inside it."""
    if isinstance(node, ast.Name | ast.Constant):
        return type(node).__name__
    parts = []
    for _, value in ast.iter_fields(node):
        inside = value if isinstance(value, list) else [value]
        parts.append(
            ",".join(_shape(n) for n in inside if isinstance(n, ast.AST) and not isinstance(n, ast.stmt))
        )
    return f"{type(node).__name__}({';'.join(parts)})"


def _statements(body: list[ast.stmt]) -> Iterator[tuple[str, int]]:
    """Shapes and lines of statements, those inside others after them; imports and docstrings are left out."""
    for node in body:
        if isinstance(node, ast.Import | ast.ImportFrom):
            continue
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            continue
        yield _shape(node), node.lineno
        for part in ("body", "orelse", "finalbody"):
            yield from _statements(getattr(node, part, []))
        for handler in getattr(node, "handlers", []):
            yield from _statements(handler.body)


def like_code() -> set[tuple[str, str]]:
    """Pairs of files that share a run of like code; a file that repeats itself is a pair with itself."""
    places: dict[tuple[str, ...], set[tuple[str, int]]] = defaultdict(set)
    for name in python_files(*(f"{package}/" for package in PACKAGES)):
        statements = list(_statements(tree(name).body))
        for index in range(len(statements) - LIKE_STATEMENTS + 1):
            run = statements[index : index + LIKE_STATEMENTS]
            places[tuple(shape for shape, _ in run)].add((name, run[0][1]))
    pairs = set()
    for found in places.values():
        if len({name for name, _ in found}) <= LIKE_FILES:
            for (name, line), (other, further) in combinations(sorted(found), 2):
                if name != other or further - line >= LIKE_STATEMENTS:
                    pairs.add((name, other))
    return pairs


def shared_base_names() -> list[str]:
    """List the base names that several Python files of the repository share."""
    counted = Counter(Path(name).stem for name in python_files(""))
    return sorted(name for name, count in counted.items() if count > 1 and name not in LOOSE)


def installed() -> list[str]:
    """Tracked files that pip installs, by the rules of pyproject.toml."""
    rules = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]
    chosen, left_out = (rules["packages"]["find"][key] for key in ("include", "exclude"))
    kinds = ["*.py", *rules["package-data"]["*"]]

    def is_chosen(name: str) -> bool:
        package = name.rpartition("/")[0].replace("/", ".")
        matches = [
            any(fnmatchcase(package, pattern) for pattern in patterns) for patterns in (chosen, left_out)
        ]
        return matches == [True, False] and any(Path(name).match(kind) for kind in kinds)

    return [name for name in tracked() if is_chosen(name)]


def wheel_megabytes() -> float:
    """Size of the wheel [MB], deflated as pip's."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in installed():
            archive.write(ROOT / name, name)
    return len(packed.getvalue()) / MEGABYTE


def hard_dependencies() -> list[str]:
    """List the requirements of every installation."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return list(project["dependencies"])


def counts() -> list[Count]:
    """All rows that files alone decide."""
    product = [name for name in python_files("experiments/") if not name.startswith(EVIDENCE)]
    rooms = {name.split("/")[1] for name in product if name.count("/") > 1}
    own, statistics, pictures = (imports_between_rooms(name) for name in ("experiments", "doe", "imaging"))
    data = [name for name in tracked() if not name.endswith((".py", ".pyi"))]
    return [
        Count("experiments without evidence, lines", lines(product), 35_036),
        Count("experiments, folders without evidence", len(rooms), 15),
        Count("experiments, floors", max(heights(own).values()), 10),
        Count("experiments, imports between rooms", len(own), 65),
        Count("experiments, imports upwards", circles_broken(own)[1], 0),
        Count("evidence, lines", lines(python_files(EVIDENCE)), 18_000),
        Count("imaging, floors", max(heights(pictures).values()), 8),
        Count("imaging, imports between rooms", len(pictures), 50),
        Count(
            "doe and imaging, imports upwards",
            sum(circles_broken(pairs)[1] for pairs in (statistics, pictures)),
            0,
        ),
        Count("installed, lines", lines(name for name in installed() if name.endswith(".py")), 68_958),
        Count("wheel [MB]", wheel_megabytes(), 1.5),
        Count("tests, lines", lines(python_files("tests/")), 40_200),
        Count("tracked data [MB]", megabytes(data), 16.0),
        Count("hard dependencies", len(hard_dependencies()), 18),
        Count("pairs of files with like code", len(like_code()), 150),
        Count("base names used more than once", len(shared_base_names()), 40),
    ]
