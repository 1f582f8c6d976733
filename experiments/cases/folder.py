"""The folder of a campaign: which study made it, and whether a run may go on in it."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from experiments.cases.engines import engine_of
from experiments.cases.store import Store
from experiments.errors import StoreError
from experiments.files import write_text
from experiments.studyfile import Study
from experiments.studyfile.places import KeyPath, dotted

MANIFEST = "study.json"
"""File that says which study the folder belongs to."""

CASES = "cases"
"""Folder of the stored cases."""


def open_folder(folder: Path, study: Study, resume: bool = False) -> tuple[Store, list[str]]:
    """Make a campaign's folder, or go on in an existing one.

    Returns
    -------
    store
        Store of the cases, which has the study's engine.
    changes
        Differences from the study that the folder was made with, one line a key. Cases that a change does
        not touch are used again: each is stored under all that determines it.

    Raises
    ------
    StoreError
        When the folder is in use and not to be resumed, or is no campaign's. Nothing is written then.
    StudyError
        When the study's engine cannot be used.
    """
    engine = engine_of(study)
    manifest = folder / MANIFEST
    described = describe(study)
    changes: list[str] = []
    if not resume:
        require_unused(folder, "; --resume goes on in it")
    elif is_used(folder):
        changes = list(differences(_read_manifest(manifest), described))
    write_text(manifest, json.dumps(described, indent=1, allow_nan=False))
    return Store(folder / CASES, engine), changes


def is_used(folder: Path) -> bool:
    """Tell that a folder, or a file of that name, holds something."""
    return folder.exists() and (not folder.is_dir() or any(folder.iterdir()))


def require_unused(folder: Path, advice: str = "") -> None:
    """Refuse a folder that holds something, so that nothing is overwritten.

    Raises
    ------
    StoreError
        When the folder is not new or empty.
    """
    if is_used(folder):
        raise StoreError(f"the output folder must be new or empty{advice}", "a used one", str(folder))


def describe(study: Study) -> dict[str, Any]:
    """Everything that a study says, its clumps included, as JSON-able data."""
    digests = [hashlib.sha256(clump.read_bytes()).hexdigest() for clump in study.grain.clump_files]
    return {"study": study.document, "scale": study.scale, "clump_sha256": digests}


def differences(old: object, new: object, path: KeyPath = ()) -> Iterator[str]:
    """Name every key whose value differs, as ``key: old -> new``."""
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


def _read_manifest(path: Path) -> dict[str, Any]:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        rule = f"a folder to resume must hold the {MANIFEST} of the run that made it"
        raise StoreError(rule, "none that can be read", str(path)) from None
