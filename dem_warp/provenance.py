"""Where results come from: the engine's own code, libraries, device and precision."""

import functools
import hashlib
import importlib.metadata
from pathlib import Path
from typing import Any

import numpy as np
import warp as wp


@functools.cache
def engine_fingerprint() -> str:
    """Hash of the engine's sources and of the version of Warp that compiles them."""
    digest = hashlib.sha256(importlib.metadata.version("warp-lang").encode())
    root = Path(__file__).parent
    for path in sorted(root.rglob("*.py")):
        digest.update(f"\n{path.relative_to(root).as_posix()}\n".encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()


def provenance(device: Any, precision: str) -> dict[str, Any]:
    """Versions, device and precision that make a result, by name."""
    return {
        "warp": wp.__version__,
        "numpy": np.__version__,
        "device": device.name if device.is_cuda else "CPU",
        "precision": precision,
    }
