"""In what order modules stand: an import leads down, never back up or around."""

import ast
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]

# Of `experiments`, from the bottom up: a room imports itself and what is named before it. The registry of
# observables knows no study, so that a study file can name them. Trials are run by a
# person, as benchmarks are, though they lie beside what they try.
ROOMS = (
    "errors", "files", "measurement.observables", "studyfile", "discover.measured", "measurement", "cases",
    "calibrate", "studies", "discover", "report", "commands", "cli", "benchmarks", "trials",
)  # fmt: skip


def modules(package: str) -> dict[str, Path]:
    paths = sorted((ROOT / package).rglob("*.py"))
    assert paths, f"no Python files under {package}"
    names = (".".join(path.relative_to(ROOT).with_suffix("").parts) for path in paths)
    return {name.removesuffix(".__init__"): path for name, path in zip(names, paths, strict=True)}


def imported(path: Path, known: dict[str, Path]) -> Iterator[str]:
    """Name the modules that a file imports from its own package, inside functions and for types too."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in known)
        elif isinstance(node, ast.ImportFrom) and node.module in known:
            inner = (f"{node.module}.{alias.name}" for alias in node.names)
            yield from (name if name in known else node.module for name in inner)


def room(module: str) -> str:
    """Room of a module: the longest name of a room that its own begins with."""
    inside = module.partition(".")[2] + "."
    return max((name for name in ROOMS if inside.startswith(name + ".")), key=len, default=inside)


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


def test_the_rooms_of_experiments_stand_on_one_another() -> None:
    known = modules("experiments")
    rooms = {name: room(name) for name in known if "." in name}
    assert set(rooms.values()) == set(ROOMS)
    upward = [
        f"{name} -> {other}"
        for name in rooms
        for other in imported(known[name], known)
        if ROOMS.index(rooms[other]) > ROOMS.index(rooms[name])
    ]
    assert upward == []
