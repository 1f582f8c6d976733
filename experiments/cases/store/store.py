"""Results of cases: one folder, one file a case, keyed by everything that determines it."""

from __future__ import annotations

import json
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from dem_warp import Case, CaseResult
from dem_warp.reading import read_arrays
from experiments.cases.engines.engine import Engine
from experiments.cases.engines.key import case_key
from experiments.io.errors import StoreError
from experiments.io.files import replacing

FORMAT = 2
"""Version of the case files; an older one is not read."""

_RECORD = "record"


class Store:
    """Results of cases in a folder.

    The file of a case is written whole or not at all, and its checksums are verified when it is read. The
    folder is made when the first case is saved; without an engine, results are `dem_warp.simulate`'s.
    """

    def __init__(self, folder: str | Path, engine: Engine | None = None) -> None:
        self.folder, self.engine = Path(folder), engine

    def key(self, case: Case) -> str:
        """Return the key of a case: a hash of all that determines its stored result."""
        return case_key(case, self.engine, format=FORMAT)

    @property
    def unfinished(self) -> Path:
        """Folder of the checkpoints of cases that are being simulated."""
        return self.folder / "unfinished"

    def path(self, key: str) -> Path:
        """Return the file of a case."""
        return self.folder / f"{key}.npz"

    def __len__(self) -> int:
        """Count the stored cases."""
        return len(list(self.folder.glob("*.npz")))

    def has(self, key: str) -> bool:
        """Return whether the case is stored and whole."""
        return self.path(key).is_file() and self.damage(key) is None

    def damage(self, key: str) -> str | None:
        """Return the fault of a stored case; None if it is whole or missing."""
        if not self.path(key).exists():
            return None
        try:
            self.load(key)
        except StoreError as error:
            return str(error)
        return None

    def save(self, key: str, result: CaseResult) -> None:
        """Save the result of a case, replacing an earlier one."""
        arrays: dict[str, Any] = {}
        record: dict[str, Any] = {"key": key, "format": FORMAT}
        for field in fields(result):
            value = getattr(result, field.name)
            if isinstance(value, np.ndarray):
                arrays[field.name] = value
            else:
                record[field.name] = value
        text = json.dumps(record, allow_nan=False).encode()
        arrays[_RECORD] = np.frombuffer(text, dtype=np.uint8)
        with replacing(self.path(key)) as temporary:
            np.savez(temporary, **arrays)

    def load(self, key: str) -> CaseResult:
        """Load the result of a case.

        Raise StoreError when the case is not stored, or its file is damaged.
        """
        path = self.path(key)
        if not path.is_file():
            raise StoreError(
                str(path), "this stored case was removed", hint="Add --resume to simulate it again."
            )
        try:
            values: dict[str, Any] = read_arrays(path)
            values |= json.loads(values.pop(_RECORD).tobytes())
            found = (values.pop("key"), values.pop("format"))
            if found != (key, FORMAT):
                raise ValueError(f"it holds the case {found[0]} in format {found[1]}")
            result = CaseResult(**values)
            _check(result)
            return result
        except (ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
            raise StoreError(str(path), f"this stored case is damaged: {error}") from error


def _check(result: CaseResult) -> None:
    """Raise ValueError if the arrays of a result do not fit each other."""
    count, shapes = len(result.sizes), len(result.clumps)
    found = (result.positions.shape, result.orientations.shape, result.sizes.shape, result.shapes.shape)
    if found != ((count, 3), (count, 4), (count,), (count,)) or result.clumps.shape[2:] != (4,):
        raise ValueError(f"its arrays have the shapes {found}")
    if count and not 0 <= result.shapes.min() <= result.shapes.max() < shapes:
        raise ValueError(f"its grains have other shapes than its {shapes}")
    if not (isinstance(result.status, str) and isinstance(result.observables, dict)):
        raise ValueError("its status or its observables are invalid")
    places = (result.positions, result.orientations, result.sizes, result.clumps)
    if result.status == "finished" and not all(np.isfinite(values).all() for values in places):
        raise ValueError("some of its places and sizes are not finite")
