"""Key of a case, the same on every machine: a hash of all that determines its result."""

from __future__ import annotations

import hashlib
import json
from typing import Any

import numpy as np

from dem_warp import Case
from dem_warp.provenance import engine_fingerprint
from experiments.cases.engines.engine import Engine

SHAPE_DIGITS = 12
"""Digits of the spheres of a shape, relative to its size, that make another case.

A clump's centre of mass is a sum whose last bits differ between processors, by some 1e-16 of its size.
"""


def case_key(case: Case, engine: Engine | None = None, **more: object) -> str:
    """Return the key of a case: a hash of all that determines its result, the engine's code included.

    Spheres of its shapes that agree to `SHAPE_DIGITS` count as the same. ``more`` is JSON-able data that
    determines what is kept under the key, too.
    """
    determined_by = {"case": described(case), **_made_by(case, engine), **more}
    text = json.dumps(determined_by, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def engine_identity(engine: Engine) -> Any:
    """Return an engine's ``identity``, or else its name."""
    return getattr(engine, "identity", None) or getattr(engine, "__qualname__", type(engine).__qualname__)


def _made_by(case: Case, engine: Engine | None) -> dict[str, Any]:
    """Describe the code that makes the result; an engine with an identity does not use dem-warp's solver."""
    if engine is None:
        return {"engine": engine_fingerprint(*case.kinds)}
    own = () if getattr(engine, "identity", None) else (*case.kinds, engine)
    return ({"engine": engine_fingerprint(*own)} if own else {}) | {"simulated by": engine_identity(engine)}


def described(case: Case) -> dict[str, Any]:
    """Describe all of a case that determines its result, as JSON-able data."""
    described = case.to_dict()
    shape = described["grains"]["shape"]
    for spheres in shape.get("shapes", [shape]):
        spheres |= _rounded(np.array(spheres["centers"]), np.array(spheres["radii"]))
    return described


def _rounded(centers: np.ndarray, radii: np.ndarray) -> dict[str, Any]:
    """Return spheres relative to their size, and the size."""
    size = float(np.max(np.linalg.norm(centers, axis=1) + radii))
    return {
        # adding 0 turns a negative zero into zero
        "centers": (np.round(centers / size, SHAPE_DIGITS) + 0.0).tolist(),
        "radii": np.round(radii / size, SHAPE_DIGITS).tolist(),
        "size": f"{size:.{SHAPE_DIGITS}g}",
    }
