"""Readers of whatever comes from outside, each with the files that are mutated for it.

A reader takes a file and returns what it holds, or raises an error of bad input. Where a file has checksums,
what is read from a mutated one must be what was written.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import cv2
import numpy as np

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
from dem_warp.batch import Batch
from dem_warp.checkpoint import Checkpoints
from dem_warp.scenes.scene import restore_state
from dem_warp.snapshot import put_snapshot, take_snapshot
from dem_warp.solids import read_mesh
from doe import DesignError
from doe.discrepancy import Bank, MechanismRange, SearchSpace, fitted, load_bank
from experiments.cases import Store
from experiments.cases.store.outcome_table import OutcomeTable
from experiments.grains.bench_readings import formula_of, read_columns
from experiments.grains.clumps.clump_maker import ClumpRequest, make_clump
from experiments.io.errors import InputError
from experiments.journal.previews import Previews, read_preview
from experiments.measurement.measured_file import read_measured
from experiments.measurement.profile_files import (
    read_drum_profiles,
    read_force_curves,
    read_heap_profiles,
    read_press_curves,
    read_shear_points,
)
from experiments.measurement.value_limits import ValueLimits
from experiments.studyfile import load_study
from imaging import PictureError, measure_photograph

CORPUS = Path(__file__).with_name("corpus")
"""Files that are mutated, of the readers of text and meshes; the others are made anew."""

BAD_INPUT: tuple[type[Exception], ...] = (InputError, PictureError, DesignError)
"""Errors that a command shows as a message."""


@dataclass(frozen=True)
class Reader:
    """One reader, ready to take files in a folder."""

    seeds: Mapping[str, bytes]
    """Files that are mutated, by name; the ending is kept."""
    read: Callable[[Path], Any]
    """Reads a file, or raises one of `refusals`."""
    refusals: tuple[type[Exception], ...] = BAD_INPUT
    """Errors by which it may refuse a file."""
    name: str = ""
    """Name that the file must have; left out: that of the seed."""
    checked: bool = False
    """A file has checksums: what is read is what was written, or a part of it."""
    facts: Mapping[str, Any] = field(default_factory=dict)
    """All that may be read, where there are checksums, by name."""


def _corpus(*names: str) -> dict[str, bytes]:
    return {name: (CORPUS / name).read_bytes() for name in names}


def study(folder: Path) -> Reader:
    """Study files, and a case of each."""

    def read(path: Path) -> object:
        loaded = load_study(path)
        return [loaded.case({}, 1, scene) for scene in loaded.scenes]

    (folder / "clump.txt").write_bytes((CORPUS / "clump.txt").read_bytes())
    return Reader(_corpus("study.toml", "bin.toml"), read)


def card(folder: Path) -> Reader:
    """Material cards, as a study takes them."""
    scene = '[scene.lifted-cylinder]\ndiameter = "28 mm"\nheight = "28 mm"\n'
    text = f'name = "Card"\nmaterial = "material.toml"\n{scene}'
    (folder / "study.toml").write_text(text, encoding="utf-8")
    (folder / "clump.txt").write_bytes((CORPUS / "clump.txt").read_bytes())
    return Reader(
        _corpus("material.toml"),
        lambda path: load_study(folder / "study.toml").case({}, 1),
        name="material.toml",
    )


def measured(folder: Path) -> Reader:
    """Measured heaps of a study."""
    (folder / "clump.txt").write_bytes((CORPUS / "clump.txt").read_bytes())
    (folder / "study.toml").write_bytes((CORPUS / "study.toml").read_bytes())
    (folder / "heap.png").write_bytes(_picture(".png"))
    study = load_study(folder / "study.toml")
    return Reader(
        _corpus("measured.csv", "numbers.csv", "quoted.csv"), lambda path: read_measured(path, study)
    )


def profiles(folder: Path) -> Reader:
    """Profiles of drums and of heaps, heaps with a picture, curves of a press and a tool, points of shear."""
    (folder / "heap.png").write_bytes(_picture(".png"))
    rows = [f"{n},{x} mm,{n - 0.3 * x:.1f} mm" for n in (1, 2, 3) for x in range(-18, 19, 6)]
    heap = [f"1,,{x} mm,{max(9 - 0.5 * abs(x), 0):.1f} mm,," for x in range(-20, 21, 4)]
    press = [f"{n},{0.01 * (x + n * x**2):.4f},{x**2} kPa" for n in (1, 2, 3) for x in (0, 1, 2, 3, 2, 0)]
    shear = [f"{n},{x} kPa,{0.6 * x + 0.1 * n} kPa" for n in (1, 2, 3) for x in (2, 4, 6, 9)]
    tool = [f"{n},{x} mm,{0.1 * n * x} N" for n in (1, 2, 3) for x in range(6)]
    texts = {
        "tool.csv": "\n".join(["replicate,depth,force", *tool]),
        "shear.csv": "\n".join(["replicate,normal,shear", *shear]),
        "press.csv": "\n".join(["replicate,strain,stress", *press]),
        "drum.csv": "\n".join(["replicate,x,z", *rows]),
        "heap.csv": "\n".join(["replicate,view,x,z,picture,pixel", *heap, "2,a,,,heap.png,0.2 mm"]),
    }

    def read(path: Path) -> object:
        if path.name.startswith("drum"):
            return read_drum_profiles(path, 0.03)
        if path.name.startswith("press"):
            return read_press_curves(path, 9e3)
        if path.name.startswith("tool"):
            return read_force_curves(path, 5e-3)
        if path.name.startswith("shear"):
            return read_shear_points(path, 9e3)
        return read_heap_profiles(path, "flank", ValueLimits(1e-4, 0.2, math.inf, 1e3))

    return Reader({name: text.encode() for name, text in texts.items()}, read)


def clump(folder: Path) -> Reader:
    """Files of spheres."""
    return Reader(_corpus("clump.txt"), lambda path: make_clump(ClumpRequest(str(path))))


def mesh(folder: Path) -> Reader:
    """Meshes in every format."""
    seeds = _corpus("ascii.stl", "binary.stl", "grain.obj", "ascii.ply", "binary.ply", "grain.off")
    return Reader(seeds, read_mesh, (ValueError, OSError))


def picture(folder: Path) -> Reader:
    """Pictures of heaps."""
    endings = (".png", ".jpg", ".bmp", ".tif", ".webp")
    return Reader(
        {f"heap{ending}": _picture(ending) for ending in endings},
        lambda path: measure_photograph(path, "flank"),
    )


def bank(folder: Path) -> Reader:
    """Banks of library waves."""
    rng = np.random.default_rng(1)
    space = SearchSpace(("E",), (0.2,), (0.6,), ("test",), (False,), (MechanismRange("tilt", 0.0, 0.1),))
    rows, mechanisms = 36, np.repeat([-1, 0], [24, 12])
    points = rng.uniform(-1, 1, (rows, 1))
    points[16:24] = 0.0  # repeats
    seen = np.column_stack([np.sin(6.0 * points[:, 0]), rng.normal(size=rows)])
    made = Bank(
        space,
        ("angle", "height"),
        points,
        mechanisms,
        np.where(mechanisms < 0, 0.0, rng.uniform(0, 1, rows)),
        np.zeros(rows, dtype=int),
        seen.astype(np.float32).astype(float),
        np.full(rows, ""),
        "study",
        {"engine": "e", "day": "2026-11-22"},
    )
    fitted(made).save(folder / "seed.npz")

    def read(path: Path) -> dict[str, Any]:
        found = load_bank(path)
        kriged = None if found.kriged is None else (found.kriged.runs, found.kriged.table())
        return {**vars(found), "kriged": kriged}

    content, whole = (folder / "seed.npz").read_bytes(), read(folder / "seed.npz")
    return Reader({"bank.npz": content}, read, checked=True, facts=whole)


def stored(folder: Path) -> Reader:
    """Prepare stored cases."""
    [result] = simulate([_case()], "cpu", 1)
    store = Store(folder / "cases")
    store.save("seed", result)
    content = store.path("seed").read_bytes()
    return Reader(
        {"seed.npz": content},
        lambda path: vars(Store(folder).load("seed")),
        checked=True,
        facts=vars(store.load("seed")),
    )


def checkpoint(folder: Path) -> Reader:
    """Checkpoints, put back into a world."""
    batch, checkpoints = Batch([_case()], "cpu"), Checkpoints(folder)
    for _ in range(3):
        batch.advance()
    case, state, snapshot = batch.cases[0], batch.controllers[0].state, take_snapshot(batch.solver, 0)
    checkpoints.save(case, batch.maker, state, snapshot)
    path = checkpoints.path(case)

    def read(path: Path) -> dict[str, Any]:
        found = checkpoints.load(case, batch.maker)
        if found is None:
            return {}
        values, taken = found
        put_snapshot(batch.solver, 0, taken)
        return {"state": asdict(restore_state(type(state), values)), **take_snapshot(batch.solver, 0)}

    refusals = (ValueError, TypeError, LookupError)
    facts = {"state": asdict(state), **snapshot}
    return Reader({path.name: path.read_bytes()}, read, refusals, path.name, True, facts)


def sqlite(folder: Path) -> Reader:
    """Tables of outcomes."""
    outcomes = {f"{n:064x}": (np.array([n, 0.5 * n]), "" if n % 3 else "no heap") for n in range(60)}
    OutcomeTable(folder / "seed.sqlite").save(outcomes)
    content = (folder / "seed.sqlite").read_bytes()
    keys = list(outcomes)
    facts = OutcomeTable(folder / "seed.sqlite").load(keys)
    return Reader(
        {"outcomes.sqlite": content}, lambda path: OutcomeTable(path).load(keys), checked=True, facts=facts
    )


def preview(folder: Path) -> Reader:
    """Previews of running cases."""
    [result] = simulate([_case()], "cpu", 1)
    Previews(folder / "previews").write("seed", result, {"phase": "lift", "fraction": 0.5})
    content = (folder / "previews" / "seed.npz").read_bytes()
    spheres, notes = read_preview(folder / "previews" / "seed.npz")

    def read(path: Path) -> dict[str, Any]:
        found, words = read_preview(path)
        return {"spheres": found, **words}

    facts = {"spheres": spheres, **notes}
    return Reader({"seed.npz": content}, read, (ValueError,), checked=True, facts=facts)


def readings(folder: Path) -> Reader:
    """Tables of readings of single grains."""
    seeds = {
        "rebound.csv": b"no.,fall [mm],height\n1,300,61.5 mm\n2,300,58 mm\n",
        "bounces.csv": b"first;second\n0,3 s;0,14\n310 ms;0.15\n",
    }

    def read(path: Path) -> object:
        columns = read_columns(path, "rebound")
        return formula_of("rebound", columns).of_readings(columns)

    return Reader(seeds, read, (ValueError,))


READERS: dict[str, Callable[[Path], Reader]] = {
    "study": study,
    "card": card,
    "csv": measured,
    "profiles": profiles,
    "readings": readings,
    "clump": clump,
    "mesh": mesh,
    "picture": picture,
    "bank": bank,
    "stored case": stored,
    "checkpoint": checkpoint,
    "sqlite": sqlite,
    "preview": preview,
}
"""Every reader by its name: made ready in a folder of its own."""


def accepted_change(reader: Reader, found: Any) -> str:
    """Name what was read from a mutated file with checksums and is not what was written; empty: nothing."""
    for name, value in found.items() if reader.checked else ():
        if name not in reader.facts or not _same(value, reader.facts[name]):
            return str(name)
    return ""


def _same(a: Any, b: Any) -> bool:
    if isinstance(a, tuple) and isinstance(b, tuple):
        return len(a) == len(b) and all(map(_same, a, b))
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return (a.shape, a.dtype) == (b.shape, b.dtype) and a.tobytes() == b.tobytes()
    return type(a) is type(b) and bool(a == b)


def _case() -> Case:
    """Three balls in a small tube."""
    grain, steel = Material(1000.0, 10e6, 0.25), Material(7800.0, 70e9, 0.3)
    tube = LiftedCylinder(diameter=0.02, height=0.01, wall_material=steel, rain_rate=1500.0, grain_count=3)
    contact = Interaction(0.3, 0.4, 0.05)
    grains = GrainPopulation(ClumpShape.sphere(2e-3), grain)
    return Case(tube, grains, contact, contact, 1, Numerics(modulus_scale=1000.0))


def _picture(ending: str) -> bytes:
    """Draw a heap before a plain wall."""
    image = np.full((120, 160, 3), 235, np.uint8)
    cv2.fillPoly(image, [np.array([[32, 100], [80, 60], [128, 100]], np.int32)], (60, 80, 120))
    return bytes(cv2.imencode(ending, image)[1])
