"""The public names: those that a package lists, each with one path, one docstring and a line in a list."""

import ast
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
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
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
