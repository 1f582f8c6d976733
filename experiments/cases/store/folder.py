"""The folder of a run: which study made it, whether a run may go on in it, one run at a time."""

from __future__ import annotations

import logging
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from filelock import FileLock, Timeout

from experiments.cases.engines.engines import engine_of
from experiments.cases.store.outputs import changed_outputs
from experiments.cases.store.store import Store
from experiments.io.errors import StoreError
from experiments.io.files import remove_leftovers
from experiments.studyfile import Study
from experiments.studyfile.manifest import MANIFEST, describe, differences, read_manifest, write_manifest

CASES = "cases"
"""Folder of the stored cases."""

LOCK = ".lock"
"""File that a run holds while it works in a folder; it stays beside results, and is none."""

JOURNAL = ".live"
"""Folder of what a run tells while it works; it stays, and is no result."""

_log = logging.getLogger(__name__)


@contextmanager
def locked(folder: Path, resume: bool = False) -> Iterator[None]:
    """Keep every other run out of a folder, which is made when it is missing and no run is to go on in it.

    Raises
    ------
    StoreError
        When another run is at work in it, or it is in use and not to be resumed, or there is nothing to
        resume. Nothing is written then.
    """
    _require_usable(folder, resume)
    lock, made = FileLock(folder / LOCK, timeout=0), not os.path.lexists(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock.acquire()
    except Timeout:
        raise StoreError(
            str(folder), "expected one run at a time works in a folder", "another at work"
        ) from None
    except OSError as error:
        rule = "a folder of results must be one that can be made and written to"
        raise StoreError(str(folder), rule, error.strerror or "none") from error
    try:
        # another run may have come and gone since
        _require_usable(folder, resume)
        if resume:
            remove_leftovers(folder)
        yield
    finally:
        if made and not is_used(folder):
            _take_away(folder)
        lock.release()


def _take_away(folder: Path) -> None:
    """Remove a folder that holds a lock alone, so that a run that was refused leaves nothing."""
    # another system may keep a file that is open, and another run may write into the folder just now
    with suppress(OSError):
        shutil.rmtree(folder / JOURNAL, ignore_errors=True)
        (folder / LOCK).unlink()
        folder.rmdir()


def open_folder(folder: Path, study: Study, resume: bool = False) -> tuple[Store, list[str]]:
    """Make a run's folder, or go on in an existing one.

    What an earlier run of another study left there, its ``study.json`` with it, stays until `publishing`
    replaces all of it but what is stored by key.

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
        When the folder is in use and not to be resumed, or is no run's. Nothing is written then.
    StudyError
        When the study's engine cannot be used.
    """
    engine = engine_of(study)
    _require_usable(folder, resume)
    changes: list[str] = []
    if resume:
        changes = list(differences(read_manifest(folder), describe(study)))
        for name in changed_outputs(folder):
            _require_file(folder / name, "an output")
            said = "%s is not as the earlier run wrote it: what this run makes is written anew"
            _log.warning(said, folder / name)
    else:
        write_manifest(folder, study)
    return Store(folder / CASES, engine), changes


def is_used(folder: Path) -> bool:
    """Tell that a folder, or a file of that name, holds something."""
    # pathlib raises where a name is too long for the system
    if not os.path.isdir(folder):
        return os.path.lexists(folder)
    return any(path.name not in (LOCK, JOURNAL) for path in folder.iterdir())


def require_unused(folder: Path, advice: str = "") -> None:
    """Refuse a folder that holds something, so that nothing is overwritten.

    Raises
    ------
    StoreError
        When the folder is not new or empty.
    """
    if is_used(folder):
        raise StoreError(str(folder), f"the output folder must be new or empty{advice}", _kind(folder))


def _require_usable(folder: Path, resume: bool) -> None:
    if not resume:
        require_unused(folder, "; --resume goes on in it")
    elif not is_used(folder):
        rule = "a folder to resume must be that of an earlier run: without --resume, a new one is made"
        raise StoreError(str(folder), rule, "none" if not folder.exists() else "an empty one")
    elif not folder.is_dir():
        raise StoreError(str(folder), f"a folder to resume must hold a {MANIFEST}", _kind(folder))
    else:
        _require_no_links(folder)
        _require_stored_cases(folder)
        read_manifest(folder)


def _kind(folder: Path) -> str:
    """Say what stands in the place of a new folder."""
    if os.path.isdir(folder):
        return "a used one"
    return "a file" if os.path.exists(folder) else "a link that leads nowhere"


def _require_no_links(folder: Path) -> None:
    """Refuse links in a folder, which may come from anyone: what is written there must stay there."""
    for place, folders, files in os.walk(folder):
        for name in (*folders, *files):
            if (path := Path(place, name)).is_symlink():
                raise StoreError(str(path), "a folder to resume must hold no links", "a link")


def _require_stored_cases(folder: Path) -> None:
    """Refuse what a case could not be saved over, before it is simulated."""
    if os.path.lexists(cases := folder / CASES) and not cases.is_dir():
        raise StoreError(str(cases), "must be the folder of the stored cases: move it away", "a file")
    for place in (folder, cases):
        for path in place.glob("*.npz"):
            _require_file(path, "a stored case" if place == cases else "a bank")


def _require_file(path: Path, what: str) -> None:
    if os.path.lexists(path) and not path.is_file():
        found = "a folder" if path.is_dir() else "a pipe or a device"
        raise StoreError(str(path), f"must be the file of {what}: move it away", found)
