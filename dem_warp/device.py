"""Choice of the device, and start of Warp."""

import os
import sys
import tempfile

import warp as wp

NO_DRIVER = "Could not find or load the NVIDIA CUDA driver"


def resolve_device(device: str | None) -> str:
    """Return the name of a device: "cpu", "cuda" or "cuda:N". Default: the GPU if there is one."""
    _start_warp()
    known = [str(d) for d in wp.get_devices()]
    if device is None:
        return "cuda:0" if wp.is_cuda_available() else "cpu"
    name = "cuda:0" if device == "cuda" else device
    if name not in known:
        has_gpu = any(name.startswith("cuda") for name in known)
        why = "" if has_gpu else " (no NVIDIA GPU with a CUDA driver was found)"
        raise ValueError(f"device: must be one of {', '.join(known)}{why}, got {device!r}")
    return name


def _start_warp() -> None:
    """Initialise Warp without its greeting and its warning about a missing GPU.

    Native code writes the warning, so the file descriptor is redirected; all other lines are passed on.
    """
    wp.config.log_level = max(wp.config.log_level, wp.LOG_WARNING)
    sys.stderr.flush()
    kept = os.dup(2)
    with tempfile.TemporaryFile() as aside:
        os.dup2(aside.fileno(), 2)
        try:
            wp.init()
        except OSError as error:
            rule = "Warp cannot write its kernel cache, set WARP_CACHE_PATH to another folder"
            raise OSError(error.errno, rule, error.filename) from error
        finally:
            os.dup2(kept, 2)
            os.close(kept)
        aside.seek(0)
        for line in aside.read().decode(errors="replace").splitlines():
            if NO_DRIVER not in line:
                print(line, file=sys.stderr)
