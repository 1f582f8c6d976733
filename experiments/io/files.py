"""Writing files so that a reader never sees half of one."""

from __future__ import annotations

import errno
import os
import re
import shutil
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path

from experiments.io.errors import InputError

LOCK, JOURNAL = ".lock", ".live"
"""File that a run locks while it works in a folder, and folder of its journal: neither is a result."""

DEVICES = {"con", "prn", "aux", "nul", *(f"{kind}{n}" for kind in ("com", "lpt") for n in range(1, 10))}
"""Names that Windows keeps for devices, whatever their ending."""

_TEMPORARY = re.compile(r"\..+\.\d+(\.\w+)?")
"""Names that `replacing` gives."""


def is_device_name(name: str) -> bool:
    """Return whether a file of this name is a device on Windows."""
    return name.partition(".")[0].rstrip(" ").casefold() in DEVICES


def _temporary(path: Path) -> Path:
    return path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Name a temporary file in the same folder, and rename it when the block ends without an error.

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
        # the error of a full disk names no file
        error.filename = str(path) if error.filename is None else error.filename
        raise
    finally:
        temporary.unlink(missing_ok=True)


def require_new_file(path: Path, what: str) -> None:
    """Refuse a file that exists or cannot be made; ``what`` names its kind. The attempt leaves nothing."""
    # pathlib raises where a name is too long for the system
    if os.path.lexists(path):
        raise InputError(str(path), "the file exists", hint=f"{what.capitalize()} never overwrites a file.")
    _require_place(path, path)


def require_folder(path: Path) -> None:
    """Refuse a folder that cannot be made or written to; the attempt leaves nothing."""
    _require_place(path / "trial", path)


def _require_place(file: Path, shown: Path) -> None:
    """Make the temporary file of `replacing` and the folders that it needs, and remove them."""
    made = [folder for folder in file.parents if not os.path.lexists(folder)]
    temporary = _temporary(file)
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        temporary.touch()
        temporary.unlink()
    except OSError as error:
        if error.errno in (errno.ENOSPC, errno.EDQUOT):
            raise
        reason = (error.strerror or str(error)).lower()
        raise InputError(str(shown), f"cannot be written: {reason}") from error
    finally:
        # the innermost first; another run may be writing there
        for folder in made:
            with suppress(OSError):
                folder.rmdir()


def remove_leftovers(folder: Path) -> None:
    """Remove the temporary files of a killed run from a folder, which no other run may use."""
    for path in folder.rglob(".*"):
        if has_temporary_name(path) and path.is_file() and not path.is_symlink():
            path.unlink()


def has_temporary_name(path: Path) -> bool:
    """Return whether a file has a temporary name that `replacing` gives."""
    return _TEMPORARY.fullmatch(path.name) is not None


def check_file(path: Path, largest: int) -> None:
    """Refuse, before it is opened, a file that is not a regular one or has more bytes than the largest."""
    facts = path.stat()
    if not stat.S_ISREG(facts.st_mode):
        raise InputError(str(path), "must be a regular file, not a pipe, a device or a folder")
    if facts.st_size > largest:
        raise InputError(str(path), f"must have at most {largest:,} bytes", f"{facts.st_size:,}")


def read_file(path: Path, largest: int) -> bytes:
    """Read a file; errors as in `check_file`."""
    check_file(path, largest)
    with path.open("rb") as file:
        return file.read(largest)


def check_lines(path: Path, most: int, hint: str) -> None:
    """Refuse a text of more lines than `most`; no part of it is kept."""
    with path.open("rb") as file:
        lines = sum(part.count(b"\n") for part in iter(partial(file.read, 1 << 20), b""))
    if lines > most:
        raise InputError(str(path), f"must have at most {most:,} lines", f"{lines:,}", hint)


def existing(path: Path) -> Path:
    """Return the path of a file that must exist, or raise `InputError`."""
    if not path.is_file():
        raise InputError(str(path), "no such file")
    return path


def copy_file(source: Path, target: Path) -> None:
    """Copy an `existing` file, whole or not at all."""
    with replacing(target) as temporary:
        shutil.copyfile(existing(source), temporary)


def write_text(path: Path, text: str) -> None:
    """Write a text file in UTF-8, whole or not at all; its bytes are the same on every system.

    A file name that the system's encoding could not read, e.g. under ``LC_ALL=C``, is written as it was read.
    """
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8", errors="surrogateescape", newline="\n")
