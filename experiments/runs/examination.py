"""An examination of the machine: its parts, what works, and what a run would use."""

from __future__ import annotations

import atexit
import os
import platform
import re
import shutil
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import warp as wp

from dem_warp import (
    MECHANISMS,
    SCENES,
    Case,
    ClumpShape,
    GrainPopulation,
    Interaction,
    LiftedCylinder,
    Material,
    Numerics,
    simulate,
)
from dem_warp.cores import cores
from dem_warp.device import resolve_device
from experiments.calibrate.screening_stage import DESIGNS
from experiments.cases import ENGINES, Resources, open_workers
from experiments.cases.forecast.speed import UNKNOWN, noted_speed, source_of
from experiments.cases.workers.opening import EXTRA, missing_libraries
from experiments.cases.workers.resources import PROCESS_BYTES
from experiments.cases.workers.submissions import submit_command
from experiments.discover.mechanism_files import FILES
from experiments.export import EXPORTERS
from experiments.io.own_packages import OWN
from experiments.io.plug_ins import PlugIn, described, plug_ins, skipped_for
from experiments.io.program_version import ROOT, program_version
from experiments.runs.choices import BENCH, PAPER
from experiments.studyfile import load_study
from imaging.drawing.opengl import opengl_works

GPU_WORLDS = 32
"""Worlds on a GPU of the batch that measures its speed: as many as in a stage of most campaigns."""

USUAL = {False: (2e6, 5e7), True: (2e8, 2e10)}
"""Normal speeds of a worker on a core and on a GPU [sphere-steps/s]: 2 and 10 million on busy and quiet cores
of servers, 7,000 million on an H200 with the paper's heaps."""

REGISTRIES: dict[str, Mapping[str, Any]] = {
    "laws": MECHANISMS, "scenes": SCENES, "mechanisms": FILES, "designs": DESIGNS, "engines": ENGINES,
    "exporters": EXPORTERS,
}  # fmt: skip
"""Registries that plug-ins add to, by the kind of an entry."""

DEVICES, NVIDIA, MEMORY = Path("/sys/bus/pci/devices"), "0x10de", Path("/proc/meminfo")
"""Linux's list of devices, NVIDIA's number in it, and Linux's account of the memory."""


@dataclass(frozen=True)
class Finding:
    """Result of one check."""

    name: str
    good: bool
    text: str
    needed: bool = False
    """True if no case can be simulated without it."""
    cure: str = ""
    """Advice where it is not good."""

    def to_dict(self) -> dict[str, Any]:
        """Everything as JSON-able data."""
        return asdict(self)


def examine(resources: Resources, cache: Finding) -> list[Finding]:
    """Check everything that simulates or draws, and try both on a small heap; see `kernel_cache`."""
    versions = f"dem-warp {program_version()}, Warp {wp.__version__}, Python {platform.python_version()}"
    used, scale = f"{resources}, {resources.count} at once", "paper" if resources.on_gpu else "bench"
    return [
        Finding("versions", True, versions),
        Finding("packages", True, f"{', '.join(OWN)}: all of dem-warp, in {ROOT}"),
        *_tried("plug-in", lambda: [*map(_plug_in, plug_ins())]),
        *_tried("GPU", _gpus),
        *_tried("cores", _cores),
        *_tried("memory", lambda: [_memory(resources)]),
        cache,
        *_tried("simulation", _simulation, needed=True),
        *_tried("OpenGL", lambda: [_opengl()]),
        *_tried("clusters", lambda: [_dask()]),
        *_tried("jobs", lambda: _submission(resources)),
        Finding("will be used", True, f"{used}; the paper's study at the scale {scale}"),
        *_tried("speed", lambda: [_speed(resources)]),
    ]


def kernel_cache() -> Finding:
    """Start Warp, and check that its kernel cache can be written; if not, a temporary one serves."""
    try:
        resolve_device(None)
        folder = Path(str(wp.config.kernel_cache_dir))
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            size = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file()) / 1e6
        return Finding("kernel cache", True, f"{folder}, {size:.0f} MB", needed=True)
    except OSError as error:
        wp.config.kernel_cache_dir = tempfile.mkdtemp(prefix="dem-warp-")
        atexit.register(shutil.rmtree, wp.config.kernel_cache_dir, ignore_errors=True)
        resolve_device(None)
        text = f"{error.filename}: {error.strerror or error}"
        cure = "Set WARP_CACHE_PATH to a folder that can be written."
        return Finding("kernel cache", False, text, needed=True, cure=cure)


def _plug_in(each: PlugIn) -> Finding:
    """Name the entries that their registry skips."""
    named = ((entry, *entry.split(": ")) for entry in each.entries)
    skipped = [f"skipped {one}, {skipped_for(one)}" for one, of, name in named if name not in REGISTRIES[of]]
    cure = f"Correct the entry (its warning has the rule), or uninstall {each.package}." if skipped else ""
    return Finding("plug-in", not skipped, "; ".join((str(each), *skipped)), cure=cure)


def _cores() -> list[Finding]:
    here, there = cores(), os.cpu_count() or 1
    limit = " (taskset, a container or a job allows no more)" if here < there else ""
    name = platform.processor() or platform.machine()
    return [Finding("cores", True, f"{here} of {there} for this process{limit}, {name}")]


def _gpus() -> list[Finding]:
    gpus = wp.get_cuda_devices()
    least = min(wp.get_cuda_supported_archs(), default=0)
    if not gpus:
        return [_no_gpu(least)]
    driver = ".".join(map(str, wp.get_cuda_driver_version() or ("unknown",)))
    found = []
    for gpu in gpus:
        free, there = gpu.free_memory / 1e9, gpu.total_memory / 1e9
        memory = f"{free:.3g} of {there:.3g} GB free"
        text = f"{gpu.name}, {memory}, compute capability {gpu.arch / 10:.1f}, driver of CUDA {driver}"
        old = gpu.arch < least
        cure = f"Warp {wp.__version__} needs {least / 10:.1f} or later. Use --device cpu." if old else ""
        found.append(Finding(str(gpu.alias), not old, text, cure=cure))
    return found


def _no_gpu(least: int) -> Finding:
    """Say why Warp has no GPU, and what it needs."""
    on_cpu = "cases run on the CPU"
    if not (toolkit := wp.get_cuda_toolkit_version()):
        return Finding("GPU", False, f"this Warp was built without CUDA: {on_cpu}")
    needs = (
        f"Warp {wp.__version__} needs a driver of CUDA {toolkit[0]}.0 or later,"
        f" and a card of compute capability {least / 10:.1f} or later."
    )
    if driver := wp.get_cuda_driver_version():
        version = ".".join(map(str, driver))
        if driver < (toolkit[0], 0):
            text, cure = f"the driver of CUDA {version} is too old", f"Update NVIDIA's driver. {needs}"
        elif (visible := os.environ.get("CUDA_VISIBLE_DEVICES")) is not None:
            text, cure = f"CUDA_VISIBLE_DEVICES={visible} hides every GPU", "Unset it."
        else:
            text, cure = f"the driver of CUDA {version} finds no GPU", "See what nvidia-smi prints."
    elif "microsoft" in platform.release().lower():
        text = "no NVIDIA driver in WSL"
        cure = f"Install NVIDIA's driver in Windows, not in Linux, then run wsl --update. {needs}"
    elif _has_nvidia_card():
        text, cure = "an NVIDIA card without a driver that works", f"Install NVIDIA's driver. {needs}"
    else:
        text, cure = "no NVIDIA GPU", f"None is needed. {needs}"
    return Finding("GPU", False, f"{text}: {on_cpu}", cure=cure)


def _has_nvidia_card() -> bool:
    """Look for a display controller of NVIDIA on Linux's list of devices."""
    made_by_nvidia = (one for one in DEVICES.glob("*") if _text_of(one / "vendor").strip() == NVIDIA)
    return any(_text_of(device / "class").startswith("0x03") for device in made_by_nvidia)


def _memory(resources: Resources) -> Finding:
    try:
        page = os.sysconf("SC_PAGE_SIZE")
        there, free = (page * os.sysconf(name) for name in ("SC_PHYS_PAGES", "SC_AVPHYS_PAGES"))
    except (AttributeError, ValueError, OSError):
        return Finding("memory", True, "unknown on this system")
    if available := re.search(r"MemAvailable:\s+(\d+) kB", _text_of(MEMORY)):
        free = 1024 * int(available[1])  # with what the system's cache would give back
    needed = PROCESS_BYTES * (resources.count + 1)
    text = f"{there / 1e9:.3g} GB, {free / 1e9:.3g} GB available; {resources} needs {needed / 1e9:.2g} GB"
    cure = "Close other programs, or lower --workers."
    return Finding("memory", free >= needed, text, cure="" if free >= needed else cure)


def _text_of(path: Path) -> str:
    return path.read_text(encoding="ascii") if path.is_file() else ""


def _tried(name: str, check: Callable[[], list[Finding]], needed: bool = False) -> list[Finding]:
    """Check something; an error is the finding."""
    try:
        return check()
    except Exception as error:
        return [Finding(name, False, described(error).splitlines()[0], needed)]


def _simulation() -> list[Finding]:
    cure = "" if resolve_device(None) == "cpu" else "Use --device cpu, or update the driver."
    try:
        [result] = simulate([_thirty_balls()], workers=1)
    except Exception as error:
        text = described(error).splitlines()[0]
        return [Finding("simulation", False, text, needed=True, cure=cure)]
    text = f"a heap of 30 spheres on {result.provenance['device']} "
    good = result.status == "finished"
    end = "came to rest" if good else f"{result.status}: {result.reason}"
    return [Finding("simulation", good, f"{text}{end}", needed=True, cure="" if good else cure)]


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
    text = "does not draw off screen: silhouettes are drawn without it, more slowly"
    return Finding("OpenGL", False, text, cure="On Debian or Ubuntu install libgl1 and libegl1.")


def _dask() -> Finding:
    if missing := missing_libraries():
        text = f"no {', '.join(missing)}: needed for workers on several GPUs or nodes only"
        return Finding("clusters", False, text, cure=f"{EXTRA} adds them.")
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


def _speed(resources: Resources) -> Finding:
    """Compare the noted speed of a worker with what is normal."""
    if not (speed := noted_speed(resources.machine)):
        return Finding("speed", False, UNKNOWN, cure="--measure simulates one.")
    low, high = USUAL[resources.on_gpu]
    text = f"{speed[0] / 1e6:.3g} million sphere-steps/s a worker, {source_of(speed[1])}"
    normal = f"normal: {low / 1e6:g} to {high / 1e6:,.0f}"
    good = low <= speed[0] <= high
    cure = "Other programs may share the cores: close them, then --measure."
    return Finding("speed", good, f"{text}; {normal}", cure="" if good else cure)
