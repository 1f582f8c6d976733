"""The study of a folder of results: ``study.json``, and its differences from another study."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from experiments.io.errors import StoreError
from experiments.io.files import read_file, write_text
from experiments.io.plug_ins import plug_in_versions
from experiments.studyfile.places import KeyPath, dotted
from experiments.studyfile.study import Study

MANIFEST = "study.json"
"""File that says which study the folder belongs to."""

PLUG_INS = "plug-ins"
"""Key of the versions of the plug-ins that were installed; they do not make it another study."""

LARGEST = 10_000_000
"""Bytes of the largest file of this kind that is read."""


def write_manifest(folder: Path, study: Study) -> None:
    """Write the file with the study of the folder, and the installed plug-ins."""
    added = {PLUG_INS: plug_in_versions()} if plug_in_versions() else {}
    write_text(folder / MANIFEST, json.dumps(study.identity | added, indent=1, allow_nan=False))


def differences(old: object, new: object, path: KeyPath = ()) -> Iterator[str]:
    """Yield each key whose value differs, in the form ``key: old -> new``."""
    if isinstance(old, Mapping) and isinstance(new, Mapping):
        for key in [*old, *(key for key in new if key not in old)]:
            yield from differences(old.get(key), new.get(key), (*path, key))
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        for index, (before, after) in enumerate(zip(old, new, strict=True)):
            yield from differences(before, after, (*path, index))
    elif old != new:
        yield f"{dotted(path)}: {_shown(old)} -> {_shown(new)}"


def _shown(value: object) -> str:
    return "not given" if value is None else json.dumps(value)


def read_manifest(folder: Path) -> dict[str, Any]:
    """Read the study that `write_manifest` wrote, without plug-ins; StoreError where it cannot be read."""
    path = folder / MANIFEST
    try:
        manifest: dict[str, Any] = json.loads(read_file(path, LARGEST))
        manifest.pop(PLUG_INS, None)
        return manifest
    except (OSError, ValueError, RecursionError, AttributeError, TypeError):
        hint = "Only a folder with the file that a run has written can be resumed."
        raise StoreError(str(path), "cannot be read", hint=hint) from None
