"""An examination of the machine: its parts, what works, and what a run would use."""

from __future__ import annotations

import os
import platform
import shutil
import tempfile
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import warp as wp

from dem_warp import (
    Case,
    ClumpShape,
    GrainPopulation,
    Interaction,
    LiftedCylinder,
    Material,
    Numerics,
    simulate,
)
from dem_warp.device import resolve_device
from experiments.cases import Resources, open_workers
from experiments.cases.forecast.speed import UNKNOWN, noted_speed, source_of
from experiments.cases.workers.opening import EXTRA, missing_libraries
from experiments.cases.workers.submissions import submit_command
from experiments.io.program_version import program_version
from experiments.runs.choices import BENCH, PAPER
from experiments.studyfile import load_study
from imaging.drawing.opengl import opengl_works

GPU_WORLDS = 32
"""Worlds on a GPU of the batch that measures its speed: as many as in a stage of most campaigns."""


@dataclass(frozen=True)
class Finding:
    """Result of one check."""

    name: str
    good: bool
    text: str
    needed: bool = False
    """True if no case can be simulated without it."""

    def to_dict(self) -> dict[str, Any]:
        """Everything as JSON-able data."""
        return asdict(self)


def examine(resources: Resources) -> list[Finding]:
    """Check everything that simulates or draws, and try both on a small heap."""
    resolve_device(None)
    versions = f"dem-warp {program_version()}, Warp {wp.__version__}, Python {platform.python_version()}"
    speed = noted_speed(resources.machine)
    return [
        Finding("versions", True, versions),
        *_gpus(),
        Finding("cores", True, f"{cores()} for this process, {_processor()}"),
        _memory(),
        _kernels(),
        _tried("simulation", _simulates, needed=True),
        _opengl(),
        _dask(),
        *_submission(resources),
        Finding("will be used", True, _used(resources)),
        Finding("speed", speed is not None, _speed_text(speed)),
    ]


def _used(resources: Resources) -> str:
    scale = "paper" if resources.on_gpu else "bench"
    return f"{resources}, {resources.count} at once; the paper's study at the scale {scale}"


def cores() -> int:
    """Count the cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _gpus() -> list[Finding]:
    gpus = wp.get_cuda_devices()
    if not gpus:
        return [Finding("GPU", False, "no NVIDIA GPU with a CUDA driver: cases run on the CPU")]
    driver = ".".join(map(str, wp.get_cuda_driver_version() or ("unknown",)))
    found = []
    for gpu in gpus:
        free, there = gpu.free_memory / 1e9, gpu.total_memory / 1e9
        text = f"{gpu.name}, {free:.3g} of {there:.3g} GB free, driver {driver}"
        found.append(Finding(str(gpu.alias), True, text))
    return found


def _processor() -> str:
    return platform.processor() or platform.machine()


def _memory() -> Finding:
    try:
        page = os.sysconf("SC_PAGE_SIZE")
        there, free = (page * os.sysconf(name) / 1e9 for name in ("SC_PHYS_PAGES", "SC_AVPHYS_PAGES"))
    except (AttributeError, ValueError, OSError):
        return Finding("memory", True, "unknown on this system")
    return Finding("memory", True, f"{there:.3g} GB, {free:.3g} GB of it unused")


def _kernels() -> Finding:
    """Check that the kernel cache is writable."""
    folder = Path(str(wp.config.kernel_cache_dir))
    size = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file()) / 1e6
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        return Finding("kernel cache", False, f"{folder}: {error.strerror or error}", needed=True)
    return Finding("kernel cache", True, f"{folder}, {size:.0f} MB", needed=True)


def _tried(name: str, what: Callable[[], str], needed: bool = False) -> Finding:
    """Try something; an error is the finding."""
    try:
        return Finding(name, True, what(), needed)
    except Exception as error:
        return Finding(name, False, f"{type(error).__name__}: {error}".splitlines()[0], needed)


def _simulates() -> str:
    [result] = simulate([_thirty_balls()], workers=1)
    if result.status != "finished":
        raise RuntimeError(f"a heap of 30 spheres {result.status}: {result.reason}")
    return f"a heap of 30 spheres on {result.provenance['device']} came to rest"


def _thirty_balls() -> Case[LiftedCylinder]:
    """Build the case of a heap that takes a tenth of a second."""
    steel, surfaces = Material(7800.0, 7.0e10, 0.3), Interaction(0.5, 0.4, 0.05)
    grains = GrainPopulation(ClumpShape.sphere(2.0e-3), Material(700.0, 1.0e7, 0.25))
    scene = LiftedCylinder(0.028, 0.028, steel, grain_count=30)
    return Case(scene, grains, surfaces, surfaces, seed=1, numerics=Numerics(modulus_scale=400.0))


def measure_speed(resources: Resources) -> None:
    """Simulate one batch of the paper's study on all workers; its speed is noted as of any batch."""
    study = load_study(scale=PAPER if resources.on_gpu else BENCH)
    with open_workers(resources) as workers:
        count = GPU_WORLDS * workers.count if workers.on_gpu else workers.count
        workers.simulate([study.case({}, seed) for seed in range(1, count + 1)])


def _opengl() -> Finding:
    if opengl_works():
        return Finding("OpenGL", True, "draws off screen")
    return Finding("OpenGL", False, "does not draw off screen: silhouettes are drawn without it, more slowly")


def _dask() -> Finding:
    if missing := missing_libraries():
        return Finding(
            "clusters", False, f"no {', '.join(missing)}: {EXTRA} adds workers on several GPUs or nodes"
        )
    import distributed

    return Finding("clusters", True, f"dask.distributed {distributed.__version__}")


def _submission(resources: Resources) -> list[Finding]:
    """Check that jobs can be submitted from here, if the workers are jobs."""
    if not resources.submits_jobs or resources.cluster is None or missing_libraries():
        return []
    command = submit_command(resources.cluster.kind)
    place = shutil.which(command)
    text = (
        place or f"no {command} on the PATH: jobs of {resources.cluster.kind} cannot be submitted from here"
    )
    return [Finding("jobs", place is not None, text, needed=True)]


def _speed_text(speed: tuple[float, tuple[int, ...]] | None) -> str:
    if speed is None:
        return f"{UNKNOWN}; --measure simulates one"
    return f"{speed[0] / 1.0e6:.3g} million sphere-steps/s a worker, {source_of(speed[1])}"
