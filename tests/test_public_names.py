"""The public names: those that a package lists, each with one path, one docstring and a line in a list."""

import ast
import re
from collections.abc import Iterator
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
    """Return the names in a piece of source, and its attributes with a point and without."""
    nodes = list(ast.walk(tree))
    attributes = {n.attr for n in nodes if isinstance(n, ast.Attribute)}
    return {n.id for n in nodes if isinstance(n, ast.Name)} | attributes | {f".{each}" for each in attributes}


def parts_of(tree: ast.Module) -> Iterator[tuple[str, set[str]]]:
    """Yield each function and class of a file, and with a point each member, with the names that it needs."""
    for node in tree.body:
        if not isinstance(node, ast.FunctionDef | ast.ClassDef):
            continue
        inner = node.body if isinstance(node, ast.ClassDef) else []
        members = [n for n in inner if isinstance(n, ast.FunctionDef) and not n.name.startswith("__")]
        yield from ((f".{member.name}", identifiers(member)) for member in members)
        own = [n for n in ast.iter_child_nodes(node) if n not in members]
        yield node.name, {name for each in own for name in identifiers(each)}


def named_in(text: str) -> set[str]:
    """Return, with a point, the attributes and the texts of one word in a piece of source."""
    nodes = list(ast.walk(ast.parse(text)))
    words = {n.value for n in nodes if isinstance(n, ast.Constant) and isinstance(n.value, str)}
    return {f".{each}" for each in words | {n.attr for n in nodes if isinstance(n, ast.Attribute)}}


def test_commands_reach_every_public_name_of_the_statistics() -> None:
    """A command or a campaign imports it or names the member, or something that it imports needs it.

    The names are those of every module, exported or not. Tests and evidence do not count.
    """
    parts, homes = dict[tuple[Path, str], set[str]](), dict[str, list[Path]]()
    for path in (ROOT / "doe").rglob("*.py"):
        for name, needed in parts_of(ast.parse(path.read_text(encoding="utf-8"))):
            parts[path, name] = parts.get((path, name), set()) | needed
            homes.setdefault(name, []).append(path)

    def meant(names: set[str], by: Path | None = None) -> set[tuple[Path, str]]:
        """Return what names mean in a module: its own parts, else those of others."""
        return {(p, name) for name in names for p in ([by] if (by, name) in parts else homes.get(name, []))}

    product = [p for p in (ROOT / "experiments").rglob("*.py") if "evidence" not in p.parts]
    texts = [p.read_text(encoding="utf-8") for p in product]
    sources = [ast.parse(text) for text in texts if re.search(r"import doe|from doe|plots\.", text)]
    imports = [n for tree in sources for n in ast.walk(tree) if isinstance(n, ast.ImportFrom | ast.Import)]
    todo = {a.name for n in imports for a in n.names if getattr(n, "module", "doe").split(".")[0] == "doe"}
    for tree in sources:
        chains = [n for n in ast.walk(tree) if isinstance(n, ast.Attribute) and isinstance(n.value, ast.Name)]
        todo |= {n.attr for n in chains if isinstance(n.value, ast.Name) and n.value.id in ("doe", "plots")}
    todo |= {name for text in texts for name in named_in(text)}
    reached, new = set[tuple[Path, str]](), meant(todo)
    while new := new - reached:
        reached |= new
        new = {part for path, name in new for part in meant(parts[path, name], path)}
    assert sorted(f"{path.stem} {name}" for path, name in parts.keys() - reached) == []
