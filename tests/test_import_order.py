"""Order of the modules: an import leads down, never back up or around."""

import ast
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]

# Rooms of `experiments`, whole folders and files at its root, from the bottom up: a room imports itself and
# rooms before it. Nothing imports the evidence.
ROOMS = (
    "io", "grains", "export", "testing", "studyfile", "measurement", "cases", "calibrate", "bridge",
    "discover", "report", "journal", "runs", "api", "live", "commands", "cli", "studies", "evidence",
)  # fmt: skip

# Folders of `doe`, and of `doe.discrepancy` in the order of use.
DOE = (
    "errors", "arguments", "numerics", "design", "samples", "response", "screen", "curves", "plots",
    "discrepancy",
)  # fmt: skip
STEPS = ("problem", "emulation", "fitting", "contest", "verdict", "analysis")


def modules(package: str) -> dict[str, Path]:
    paths = sorted((ROOT / package).rglob("*.py"))
    assert paths, f"no Python files under {package}"
    names = (".".join(path.relative_to(ROOT).with_suffix("").parts) for path in paths)
    return {name.removesuffix(".__init__"): path for name, path in zip(names, paths, strict=True)}


@cache
def imports(path: Path) -> list[ast.AST]:
    nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    return [node for node in nodes if isinstance(node, ast.Import | ast.ImportFrom)]


def imported(path: Path, known: dict[str, Path]) -> Iterator[str]:
    """Name the modules that a file imports from its own package, inside functions and for types too."""
    for node in imports(path):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in known)
        elif isinstance(node, ast.ImportFrom) and node.module in known:
            inner = (f"{node.module}.{alias.name}" for alias in node.names)
            yield from (name if name in known else node.module for name in inner)


def room(module: str, package: str) -> str:
    """Room of a module: the folder or the file directly in the package."""
    return module.removeprefix(package + ".").partition(".")[0]


def circle(graph: dict[str, set[str]]) -> list[str]:
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return error.args[1]
    return []


def test_a_circle_is_found() -> None:
    assert circle({"a": {"b"}, "b": {"c"}, "c": {"a"}}) != []


@pytest.mark.parametrize("package", ["dem_warp", "doe", "imaging", "experiments"])
def test_no_module_imports_itself_around_others(package: str) -> None:
    known = modules(package)
    assert circle({name: set(imported(path, known)) for name, path in known.items()}) == []


@pytest.mark.parametrize(
    ("package", "order"), [("experiments", ROOMS), ("doe", DOE), ("doe.discrepancy", STEPS)]
)
def test_the_rooms_of_a_package_stand_on_one_another(package: str, order: tuple[str, ...]) -> None:
    known = modules(package.partition(".")[0])
    rooms = {name: room(name, package) for name in known if name.startswith(package + ".")}
    assert set(rooms.values()) == set(order)
    upward = [
        f"{name} -> {other}"
        for name in rooms
        for other in imported(known[name], known)
        if other in rooms and order.index(rooms[other]) > order.index(rooms[name])
    ]
    assert upward == []
