"""A study file to start from."""

from __future__ import annotations

from pathlib import Path

from experiments.io.errors import InputError
from experiments.io.files import is_device_name, require_new_file, write_text

TEMPLATE = Path(__file__).parents[1] / "studies" / "template.toml"


def write_template(name: str, folder: Path | None = None) -> Path:
    """Write a commented study file ``NAME.toml`` for a grain, in a folder or in the current one."""
    path = new_study_path(name, folder)
    text = TEMPLATE.read_text(encoding="utf-8").replace("{name}", path.stem).replace("{file}", path.name)
    write_text(path, text)
    return path


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
