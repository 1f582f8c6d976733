"""The folder of a run: which study made it, and whether a run may use it or continue in it."""

from __future__ import annotations

import logging
import os
from pathlib import Path

from experiments.cases.engines.engines import engine_of
from experiments.cases.store.outputs import changed_outputs
from experiments.cases.store.store import Store
from experiments.io.errors import StoreError
from experiments.io.files import JOURNAL, LOCK, has_temporary_name
from experiments.studyfile import Study
from experiments.studyfile.manifest import differences, read_manifest, write_manifest

CASES = "cases"
"""Folder of the stored cases."""

_log = logging.getLogger(__name__)


def open_folder(folder: Path, study: Study, resume: bool = False) -> tuple[Store, list[str]]:
    """Make a run's folder, or continue in an existing one.

    Outputs of an earlier run, ``study.json`` with them, stay until `publishing` replaces them.

    Returns
    -------
    store
        Store of the cases, with the study's engine.
    changes
        Differences from the study that the folder was made with, one line a key. Cases that a change does
        not affect are used again: each is stored under all that determines it.

    Raises
    ------
    StoreError
        When the folder is not empty and not to be resumed, or is not a run's. Nothing is written then.
    StudyError
        When the study's engine cannot be used.
    """
    engine = engine_of(study)
    require_usable(folder, resume)
    changes: list[str] = []
    if resume:
        changes = list(differences(read_manifest(folder), study.identity))
        for name in changed_outputs(folder):
            _require_file(folder / name, "an output")
            said = "%s has changed since the earlier run and will be overwritten"
            _log.warning(said, folder / name)
    else:
        write_manifest(folder, study)
    return Store(folder / CASES, engine), changes


def is_used(folder: Path) -> bool:
    """Return whether a folder, or a file of that name, holds anything of a run."""
    # pathlib raises where a name is too long for the system
    if not os.path.isdir(folder):
        return os.path.lexists(folder)
    return any(path.name not in (LOCK, JOURNAL) and not has_temporary_name(path) for path in folder.iterdir())


def require_unused(folder: Path, hint: str = "") -> None:
    """Refuse a folder that holds something, so that nothing is overwritten.

    Raise StoreError when the folder is not new or empty.
    """
    if os.path.isdir(folder):
        if is_used(folder):
            raise StoreError(str(folder), "the folder is not empty", hint=hint)
    elif os.path.lexists(folder):
        raise StoreError(str(folder), "must be a folder", _kind(folder))


def require_usable(folder: Path, resume: bool) -> None:
    """Refuse a used folder for a new run, and one that is not a run's for a run that continues.

    Raise StoreError with the problem.
    """
    if not resume:
        require_unused(folder, "Add --resume to continue that run.")
    elif not is_used(folder):
        problem = "the folder is empty" if folder.is_dir() else "no such folder"
        raise StoreError(str(folder), problem, hint="Leave out --resume to begin a new run.")
    elif not folder.is_dir():
        raise StoreError(str(folder), "must be a folder", _kind(folder))
    else:
        _require_no_links(folder)
        _require_stored_cases(folder)
        read_manifest(folder)


def _kind(place: Path) -> str:
    return "a file" if os.path.exists(place) else "a broken link"


def _require_no_links(folder: Path) -> None:
    """Refuse links in a folder, which may come from anyone: what is written there must stay there."""
    for place, folders, files in os.walk(folder):
        for name in (*folders, *files):
            if (path := Path(place, name)).is_symlink():
                raise StoreError(str(path), "a folder to resume must hold no links")


def _require_stored_cases(folder: Path) -> None:
    """Refuse what a case could not be saved over, before it is simulated."""
    if os.path.lexists(cases := folder / CASES) and not cases.is_dir():
        raise StoreError(str(cases), "must be the folder of the stored cases", "a file", "Move it away.")
    for place in (folder, cases):
        for path in place.glob("*.npz"):
            _require_file(path, "a stored case" if place == cases else "a bank")


def _require_file(path: Path, what: str) -> None:
    if os.path.lexists(path) and not path.is_file():
        found = "a folder" if path.is_dir() else "a pipe or a device"
        raise StoreError(str(path), f"must be the file of {what}", found, "Move it away.")
