"""Reading of untrusted files with limits on their size."""

import io
import stat
import zipfile
from pathlib import Path

import numpy as np

LARGEST_TEXT = 10_000_000
"""Largest text file that is read [bytes]."""


def read_text(path: str | Path, largest: int = LARGEST_TEXT) -> str:
    """Read a text file in UTF-8; raise ValueError if it is no regular file, too large, or not UTF-8."""
    file = Path(path)
    facts = file.stat()
    if not stat.S_ISREG(facts.st_mode):
        raise ValueError(f"{path}: must be a regular file")
    if facts.st_size > largest:
        raise ValueError(f"{path}: must have at most {largest} bytes, got {facts.st_size}")
    return file.read_text(encoding="utf-8")


def read_arrays(path: str | Path) -> dict[str, np.ndarray]:
    """Read the arrays of an uncompressed .npz file by name; raise ValueError if it is damaged.

    Without compression a small file needs little memory.
    """
    try:
        if not Path(path).is_file():
            raise ValueError("it is not a regular file")
        with zipfile.ZipFile(path) as archive:
            members = archive.infolist()
            if len(members) != _stated_count(path):
                raise ValueError("its number of arrays is wrong")
            if any(member.compress_type != zipfile.ZIP_STORED for member in members):
                raise ValueError("its arrays are compressed")
            return {member.filename.removesuffix(".npy"): _array(archive.read(member)) for member in members}
    except Exception as error:
        # the libraries raise errors of many kinds for a damaged file
        raise ValueError(f"not a valid archive of arrays: {error}") from error


def _stated_count(path: str | Path) -> int:
    """Return the number of members in the archive's end record, which zipfile ignores."""
    end = Path(path).read_bytes()[-22:]
    return int.from_bytes(end[10:12], "little") if end[:4] == b"PK\x05\x06" else -1


def _array(content: bytes) -> np.ndarray:
    """Return the array of a .npy file, after a check of its size."""
    file = io.BytesIO(content)
    version = np.lib.format.read_magic(file)
    header = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}
    shape, _, kind = header[version](file)
    if kind.hasobject or int(np.prod(shape, dtype=object)) * kind.itemsize != len(content) - file.tell():
        raise ValueError(f"an array of {kind} {shape} in {len(content)} bytes")
    file.seek(0)
    return np.asarray(np.lib.format.read_array(file, allow_pickle=False))
