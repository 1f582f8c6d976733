"""Machine of a measurement, as pages name it."""

import platform
import time
from pathlib import Path

import warp as wp


def machine(device: str) -> str:
    """Name processor or GPU, version of Warp and day of a measurement that runs now."""
    target = wp.get_device(device)
    name = target.name if target.is_cuda else f"one core of {_processor()}"
    return f"{name}, Warp {wp.__version__}, {time.strftime('%Y-%m-%d')}"


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()  # Linux alone has it
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()
