"""Archives of NumPy: arrays of centres and radii, or one table x y z r."""

from __future__ import annotations

import zlib
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from experiments.grains.spheres.sphere_file import LARGEST, TYPES, Columns, Format, SphereFile, spheres_of
from experiments.io.errors import InputError

CENTERS, RADII = ("centers", "centres", "position", "positions", "xyz"), ("radius", "radii", "r")
"""Names of arrays."""


def _read(path: Path) -> SphereFile:
    try:
        loaded = np.load(path)  # objects are refused: they could run code
        named = getattr(loaded, "files", None)
        if named is not None and (size := sum(each.file_size for each in loaded.zip.infolist())) > LARGEST:
            raise ValueError(f"it unpacks to {size:,} bytes, more than {LARGEST:,}")
        arrays = {"": loaded} if named is None else {name.lower(): loaded[name] for name in named}
    except (OSError, ValueError, EOFError, NotImplementedError, BadZipFile, zlib.error) as error:
        raise InputError(str(path), f"NumPy cannot read the file: {error}") from None
    centers, radii = (next((arrays[n] for n in names if n in arrays), None) for names in (CENTERS, RADII))
    if centers is not None and radii is not None and len(centers) == len(radii):
        table = np.column_stack([centers, radii])
    else:
        table = arrays.get("", np.empty(0))
    if table.ndim != 2 or table.shape[1] != 4 or table.dtype.kind not in "fiu":
        shapes = ", ".join(f"{name} {array.shape}".strip() for name, array in arrays.items())
        problem = f"needs arrays {CENTERS[0]} (n, 3) and {RADII[0]} (n), or one table (n, 4)"
        raise InputError(str(path), problem, shapes)
    types = next((arrays[name] for name in TYPES if name in arrays), None)
    if types is not None and np.shape(types) != table.shape[:1]:
        raise InputError(str(path), "needs a type for each sphere", f"{np.shape(types)} for {len(table)}")
    columns, kinds = Columns(0, 1, 2, 3, type=None if types is None else 4), () if types is None else types
    cells = enumerate(table.astype(np.float64).astype(object))
    rows = ((n, [*map(str, row), *map(str, kinds[n : n + 1])]) for n, row in cells)
    return spheres_of("NumPy file", rows, columns, path, kind="row")


NUMPY = Format(
    "NumPy file (npz, npy)",
    lambda head: head.startswith("\x93NUMPY") or (head.startswith("PK\x03\x04") and ".npy" in head[:200]),
    _read,
)
