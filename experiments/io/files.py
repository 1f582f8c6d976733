"""Writing files so that a reader never sees half of one."""

from __future__ import annotations

import errno
import os
import re
import shutil
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from experiments.io.errors import InputError

DEVICES = {"con", "prn", "aux", "nul", *(f"{kind}{n}" for kind in ("com", "lpt") for n in range(1, 10))}
"""Names that Windows keeps for devices, whatever their ending: a file of such a name cannot go there."""

_TEMPORARY = re.compile(r"\..+\.\d+(\.\w+)?")
"""Names that `replacing` gives."""


def is_device_name(name: str) -> bool:
    """Tell that a file of this name is a device on Windows."""
    return name.partition(".")[0].rstrip(" ").casefold() in DEVICES


def _temporary(path: Path) -> Path:
    return path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Name a temporary file beside a file, and rename it over the file when the block ends without an error.

    The temporary name has the same ending. The file's folder is made when it is missing, an older file is
    replaced, and after a crash the file itself is whole or absent.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = _temporary(path)
    try:
        yield temporary
        with temporary.open("rb+") as file:
            os.fsync(file.fileno())
        temporary.replace(path)
    except OSError as error:
        # that of a full disk names no file
        error.filename = str(path) if error.filename is None else error.filename
        raise
    finally:
        temporary.unlink(missing_ok=True)


def require_new_file(path: Path, what: str) -> None:
    """Refuse a file that exists, or that cannot be made; nothing stays of the attempt.

    Raises
    ------
    InputError
        When it is one of these; the rule says what it was to be, as ``a picture``.
    OSError
        When the disk is full.
    """
    # pathlib raises where a name is too long for the system
    if os.path.lexists(path):
        raise InputError(str(path), f"{what} never overwrites a file", "one that exists")
    _require_place(path, path)


def require_folder(path: Path) -> None:
    """Refuse a folder that cannot be made or written to; nothing stays of the attempt.

    Raises
    ------
    InputError
        When it is one of these.
    OSError
        When the disk is full.
    """
    _require_place(path / "trial", path)


def _require_place(file: Path, shown: Path) -> None:
    """Make the temporary file that `replacing` would, and the folders that it needs, and take them away."""
    made = [folder for folder in file.parents if not os.path.lexists(folder)]
    temporary = _temporary(file)
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        temporary.touch()
        temporary.unlink()
    except OSError as error:
        if error.errno in (errno.ENOSPC, errno.EDQUOT):
            raise
        rule = "must be a place that can be made and written to"
        raise InputError(str(shown), rule, error.strerror or "none") from error
    finally:
        # the innermost first; another run may write there just now
        for folder in made:
            with suppress(OSError):
                folder.rmdir()


def remove_leftovers(folder: Path) -> None:
    """Remove what a killed run had half written by `replacing` in a folder, which no other run may use."""
    for path in folder.rglob(".*"):
        if has_temporary_name(path) and path.is_file() and not path.is_symlink():
            path.unlink()


def has_temporary_name(path: Path) -> bool:
    """Tell that a file has a name that `replacing` gives while it is written."""
    return _TEMPORARY.fullmatch(path.name) is not None


def check_file(path: Path, largest: int) -> None:
    """Refuse a file, which may come from anyone, before it is opened.

    Raises
    ------
    OSError
        When there is none.
    InputError
        When it is no regular file, a pipe or a device for one, or has more bytes than the largest.
    """
    facts = path.stat()
    if not stat.S_ISREG(facts.st_mode):
        raise InputError(str(path), "must be a regular file", "a pipe, a device or a folder")
    if facts.st_size > largest:
        raise InputError(str(path), f"must have at most {largest:,} bytes", f"{facts.st_size:,}")


def read_file(path: Path, largest: int) -> bytes:
    """Read a file that `check_file` lets pass.

    Raises
    ------
    OSError
        When it cannot be read.
    InputError
        When it is none that is read.
    """
    check_file(path, largest)
    with path.open("rb") as file:
        return file.read(largest)


def existing(path: Path) -> Path:
    """Return the path of a file that must be there.

    Raises
    ------
    InputError
        When there is no such file.
    """
    if not path.is_file():
        raise InputError(str(path), "a folder to gather from must hold what it is named for", "no such file")
    return path


def copy_file(source: Path, target: Path) -> None:
    """Copy an `existing` file, whole or not at all."""
    with replacing(target) as temporary:
        shutil.copyfile(existing(source), temporary)


def write_text(path: Path, text: str) -> None:
    """Write a text file in UTF-8, whole or not at all; its bytes are the same on every system.

    A name of a file that the system's encoding could not read, as under ``LC_ALL=C``, goes out as it came in.
    """
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8", errors="surrogateescape", newline="\n")
