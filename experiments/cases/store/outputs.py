"""The files that a run leaves in its folder: all of one study, and listed last with their hashes.

Reports, tables and cards are written as drafts, and moved to their places at the end of the run. A run that
is stopped leaves the earlier outputs as they were, and one that ends leaves no output of another study. The
stored cases and a search's table of outcomes are no outputs: their keys hold all that determines a result, so
that they serve any study, and stay.
"""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import Any

from dem_warp.provenance import engine_fingerprint
from experiments.io.errors import StoreError
from experiments.io.files import read_file, write_text
from experiments.studyfile import Study
from experiments.studyfile.manifest import LARGEST, write_manifest

LIST = "files.json"
"""File with the hash of every output, and with what all of them were made from."""

DRAFTS = ".drafts"
"""Folder of outputs that are being written."""


@contextmanager
def publishing(
    folder: Path, study: Study, lasting: Mapping[str, bool] | None = None, **made_from: object
) -> Iterator[Path]:
    """Yield a folder for drafts, which become the outputs of a run's folder when the block ends well.

    Parameters
    ----------
    folder
        Folder of the run.
    lasting
        Files that the runs of the folder share, by name: one that serves the study (True) stays and is
        listed, one that does not is removed.
    study, made_from
        Study of the outputs, and JSON-able data that determines them, too. Earlier outputs that were made
        from the same stay, if they are not overwritten; others are removed.
    """
    drafts = folder / DRAFTS
    shutil.rmtree(drafts, ignore_errors=True)
    drafts.mkdir(parents=True)
    try:
        write_manifest(drafts, study)
        made = {"study": study.sha256, "engine": engine_fingerprint(), **made_from}
        yield drafts
        _publish(drafts, folder, made, lasting or {})
    finally:
        shutil.rmtree(drafts, ignore_errors=True)


def is_listed(folder: Path, name: str) -> bool:
    """Return whether the list of a folder's outputs names a file."""
    return name in _read_list(folder)["files"]


def changed_outputs(folder: Path) -> list[str]:
    """Return the names of listed outputs that are missing or have changed."""
    files = _read_list(folder)["files"]
    return [name for name, known in files.items() if known and sha256_of(folder / name) != known]


def sha256_of(path: Path) -> str | None:
    """Return the SHA-256 of a file; None if it is missing."""
    if not path.is_file():
        return None
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _publish(drafts: Path, folder: Path, made_from: dict[str, Any], lasting: Mapping[str, bool]) -> None:
    """Move drafts to their places, after every file was listed."""
    earlier = _read_list(folder)
    old, drawn = earlier["files"], sorted(path for path in drafts.rglob("*") if path.is_file())
    new = {path.relative_to(drafts).as_posix(): sha256_of(path) for path in drawn}
    _write_list(folder, {}, dict.fromkeys([*old, *lasting, *new]))
    kept = {}
    for name, known in (old | dict.fromkeys(lasting)).items():
        if name in new:
            continue
        if lasting.get(name, earlier["made_from"] == made_from):
            kept[name] = sha256_of(folder / name) if name in lasting else known
        else:
            _place(folder, name).unlink(missing_ok=True)
    for name in new:
        place = _place(folder, name)
        place.parent.mkdir(parents=True, exist_ok=True)
        (drafts / name).replace(place)
    for below in sorted({_place(folder, name).parent for name in old} - {folder}, reverse=True):
        if below.is_dir() and not any(below.iterdir()):
            below.rmdir()
    _write_list(folder, made_from, kept | new)


def _write_list(folder: Path, made_from: Mapping[str, Any], files: Mapping[str, str | None]) -> None:
    listed = {"made_from": made_from, "files": dict(sorted(files.items()))}
    write_text(folder / LIST, json.dumps(listed, indent=1, allow_nan=False) + "\n")


def _read_list(folder: Path) -> dict[str, Any]:
    path = folder / LIST
    if not path.exists():
        return {"made_from": {}, "files": {}}
    try:
        listed = json.loads(read_file(path, LARGEST))
        files, made_from = dict(listed["files"]), dict(listed["made_from"])
        if all(known is None or isinstance(known, str) for known in files.values()):
            for name in files:
                _place(folder, name)
            return {"made_from": made_from, "files": files}
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        pass
    hint = "Move it away, with the outputs that it should name."
    raise StoreError(str(path), "must be the list of files that a run wrote", "another file", hint)


def _place(folder: Path, name: str) -> Path:
    """Return the place of an output; raise ValueError if it is outside the folder."""
    parts = PurePosixPath(name).parts
    if not parts or ".." in parts or PurePosixPath(name).is_absolute():
        raise ValueError(f"name must be in the run's folder, got {name!r}")
    return folder.joinpath(*parts)
