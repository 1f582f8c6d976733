"""The public names: those that a package lists, each with one path, one docstring and a line in a list."""

import ast
import re
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("dem_warp", "doe", "imaging", "experiments.api", "experiments.cases", "experiments.studyfile")
LISTED = (Path(__file__).with_name("public_names.txt")).read_text(encoding="utf-8").split()


def public(package: str) -> list[str]:
    return [f"{package}.{name}" for name in import_module(package).__all__]


def test_the_public_names_are_those_listed() -> None:
    """A name that is added or goes stands in the list too: the promise to users changes knowingly."""
    assert sorted(name for package in PACKAGES for name in public(package)) == LISTED


def test_a_public_name_has_one_path() -> None:
    """Outside its package nobody takes it from a module inside."""
    names = {package: {name.removeprefix(f"{package}.") for name in public(package)} for package in PACKAGES}
    around = []
    for path in (p for top in ("doe", "imaging", "experiments") for p in sorted((ROOT / top).rglob("*.py"))):
        module = ".".join(path.relative_to(ROOT).with_suffix("").parts)
        text = path.read_text(encoding="utf-8")
        for node in (
            ast.walk(ast.parse(text)) if any(f"from {package}." in text for package in PACKAGES) else ()
        ):
            if isinstance(node, ast.ImportFrom) and node.module and "." in node.module:
                inside = [p for p in PACKAGES if node.module.startswith(f"{p}.") and not module.startswith(p)]
                taken = {alias.name for alias in node.names} & {n for p in inside for n in names[p]}
                around += [f"{module}: {node.module}.{name}" for name in sorted(taken)]
    assert around == []


@pytest.mark.parametrize("name", LISTED)
def test_a_public_name_is_documented(name: str) -> None:
    package, _, short = name.rpartition(".")
    thing = getattr(import_module(package), short)
    if callable(thing):
        written = thing.__doc__ or ""
        assert written.strip()
        assert not written.startswith(f"{short}("), "the docstring that dataclass makes up"


def identifiers(tree: ast.AST) -> set[str]:
    """Return the names and attributes in a piece of source."""
    nodes = list(ast.walk(tree))
    return {n.id for n in nodes if isinstance(n, ast.Name)} | {
        n.attr for n in nodes if isinstance(n, ast.Attribute)
    }


def test_commands_reach_every_public_name_of_the_statistics() -> None:
    """A command or a campaign imports it, or something that it imports needs it."""
    parts: dict[str, set[str]] = {}
    for path in (ROOT / "doe").rglob("*.py"):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.FunctionDef | ast.ClassDef):
                parts[node.name] = parts.get(node.name, set()) | identifiers(node)
    product = [p for p in (ROOT / "experiments").rglob("*.py") if "evidence" not in p.parts]
    texts = [p.read_text(encoding="utf-8") for p in product]
    sources = [ast.parse(text) for text in texts if re.search(r"import doe|from doe|plots\.", text)]
    imports = [n for tree in sources for n in ast.walk(tree) if isinstance(n, ast.ImportFrom | ast.Import)]
    todo = {a.name for n in imports for a in n.names if getattr(n, "module", "doe").split(".")[0] == "doe"}
    for tree in sources:
        chains = [n for n in ast.walk(tree) if isinstance(n, ast.Attribute) and isinstance(n.value, ast.Name)]
        todo |= {n.attr for n in chains if isinstance(n.value, ast.Name) and n.value.id in ("doe", "plots")}
    reached: set[str] = set()
    while todo := (todo - reached) & parts.keys():
        reached |= todo
        todo = {name for part in todo for name in parts[part]}
    for package in ("doe", "doe.plots"):
        named = import_module(package)
        public = {name for name in named.__all__ if callable(getattr(named, name))}
        assert public - reached == set()
