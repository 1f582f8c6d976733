"""The devices of a wave: one, or several GPUs side by side."""

from __future__ import annotations

from dem_warp.device import resolve_device


def resolve_devices(names: str | None) -> list[str]:
    """Names of the devices to run on: as asked, several GPUs as ``"cuda:0,cuda:1"``, or the engine's choice.

    Raises
    ------
    ValueError
        If one is not there or is named twice, or the CPU stands beside a GPU.
    """
    asked = [None] if names is None else [name.strip() for name in names.split(",")]
    found = [resolve_device(name) for name in asked]
    if len(set(found)) < len(found):
        raise ValueError(f"device: must name each device once, got {names!r}")
    if len(found) > 1 and "cpu" in found:
        raise ValueError(f"device: must be the CPU alone or GPUs only, got {names!r}")
    return found
