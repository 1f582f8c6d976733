"""A study file to start from."""

from __future__ import annotations

import re
from pathlib import Path

from experiments.io.errors import InputError
from experiments.io.files import is_device_name, require_new_file, write_text

TEMPLATE = Path(__file__).parents[1] / "studies" / "template.toml"

USUAL_TEST = "lifted-cylinder"
"""Test of the template; the others are comments in it, each with an observable and a value."""

_TEST = re.compile(
    r'^# \[scene\.(?P<name>[\w-]+)\]  # (?P<observable>\w+) = (?P<mean>"[^"]+") \+- (?P<sd>"[^"]+")'
    r"(?:.* modulus_scale = (?P<scale>[\d.]+))?.*\n"
    r"(?P<keys>(?:^# \w+ = .*\n)+)",
    re.MULTILINE,
)
_OWN = re.compile(rf"^\[scene\.{USUAL_TEST}\]\n(?:.+\n)+\n^# Other tests.*\n(?:^# .*\n)+\n", re.MULTILINE)
_TARGET = re.compile(r"^mean = .*\nsd = .*\n", re.MULTILINE)


def write_template(name: str, folder: Path | None = None, test: str = USUAL_TEST) -> Path:
    """Write a commented study file ``NAME.toml`` of a test for a grain, in a folder or in the current one."""
    path, text = new_study_path(name, folder), TEMPLATE.read_text(encoding="utf-8")
    if test != USUAL_TEST:
        text = _of_test(text, test)
    write_text(path, text.replace("{name}", path.stem).replace("{file}", path.name))
    return path


def _of_test(text: str, test: str) -> str:
    """Put another test in the place of the template's; InputError for an unknown one."""
    tests = {found["name"]: found for found in _TEST.finditer(text)}
    if test not in tests:
        raise InputError("--test", f"must be one of {', '.join((USUAL_TEST, *tests))}", test)
    found = tests[test]
    keys = found["keys"].replace("# ", "", 1).replace("\n# ", "\n")
    target = f'observable = "{found["observable"]}"\nmean = {found["mean"]}\nsd = {found["sd"]}\n'
    text = _OWN.sub(lambda _: f"[scene.{test}]\n{keys}\n", text)
    if found["scale"]:
        text = re.sub(r"(?m)^modulus_scale = \S+", f"modulus_scale = {found['scale']}", text)
    example = keys.splitlines()[0]
    text = re.sub(rf"scene\.{USUAL_TEST}\.\w+ = .*", lambda _: f"scene.{test}.{example}", text)
    return _TARGET.sub(lambda _: target, text, count=1)


def new_study_path(name: str, folder: Path | None = None) -> Path:
    """Return the path of a new study file; InputError where the name cannot be one or the file exists."""
    name = name.removesuffix(".toml")
    if not name or not all(character.isalnum() or character in " _-" for character in name):
        raise InputError("NAME", "must have letters, digits, spaces, - and _ only", name)
    if is_device_name(name) or name != name.strip():
        problem = "must not be a device of Windows (con, nul, com1, ...), nor begin or end with a space"
        raise InputError("NAME", problem, repr(name))
    path = (folder or Path()) / f"{name}.toml"
    require_new_file(path, "a new study")
    return path
