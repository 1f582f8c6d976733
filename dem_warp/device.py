"""The device to run on."""

import os
import sys
import tempfile

import warp as wp

NO_DRIVER = "Could not find or load the NVIDIA CUDA driver"


def resolve_device(device: str | None) -> str:
    """Name of the device to run on: as asked, or the GPU if there is one.

    Parameters
    ----------
    device : str, optional
        "cpu", "cuda" or "cuda:N".

    Raises
    ------
    ValueError
        If the device is not there.
    """
    _start_warp()
    known = [str(d) for d in wp.get_devices()]
    if device is None:
        return "cuda:0" if wp.is_cuda_available() else "cpu"
    name = "cuda:0" if device == "cuda" else device
    if name not in known:
        raise ValueError(_absent(device, known))
    return name


def _absent(device: str, known: list[str]) -> str:
    """Say why a device is not there."""
    gpus = [name for name in known if name.startswith("cuda")]
    if device.startswith("cuda") and not gpus:
        return f"no NVIDIA GPU with a CUDA driver was found, so the device must be cpu, not {device}"
    return f"the device must be one of {', '.join(known)}, not {device}"


def _start_warp() -> None:
    """Initialise Warp without its greeting and without its warning that no GPU was found, which is no fault.

    The warning is written by native code, so the file descriptor is turned aside; anything else that comes is
    passed on.
    """
    wp.config.log_level = max(wp.config.log_level, wp.LOG_WARNING)
    sys.stderr.flush()
    kept = os.dup(2)
    with tempfile.TemporaryFile() as aside:
        os.dup2(aside.fileno(), 2)
        try:
            wp.init()
        finally:
            os.dup2(kept, 2)
            os.close(kept)
        aside.seek(0)
        for line in aside.read().decode(errors="replace").splitlines():
            if NO_DRIVER not in line:
                print(line, file=sys.stderr)
