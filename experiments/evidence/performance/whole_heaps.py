"""Whole heaps, first grain to rest: `python -m experiments.evidence.performance.whole_heaps out/heaps`.

Each code runs the test that `dem-warp export` writes for it, under its own laws, which dem-warp takes too.
"""

import math
import os
import subprocess
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pandas as pd
import typer

from dem_warp import (
    PRESETS,
    Case,
    CaseResult,
    ClumpShape,
    GrainPopulation,
    Interaction,
    LiftedCylinder,
    Material,
    Numerics,
    simulate,
)
from experiments.cases.engines.driver import Driver
from experiments.evidence.machine import machine
from experiments.evidence.performance.result_pages import write_results
from imaging import PictureError, heap_angle

CODES = ("liggghts", "lammps")
"""Codes that are run, by the names of their laws and of their exporters."""

SHAPES = {
    "balls": ClumpShape.sphere(2e-3),
    "rods of 3": ClumpShape.from_spheres(np.array([[0.0, 0.0, z] for z in (-2e-3, 0.0, 2e-3)]), [1.5e-3] * 3),
    "buckwheat of 9": ClumpShape.read(Path(__file__).parents[2] / "studies" / "buckwheat" / "clump.txt"),
}
"""Grains by name: 4 mm, 7 mm long, and the clump of the buckwheat study."""


@dataclass(frozen=True)
class Heap:
    """A heap that a code made."""

    seconds: float
    """Processor time, user and system [s]."""
    result: CaseResult

    @property
    def angle(self) -> float:
        """Repose angle over eight views [deg]; NaN where none can be measured."""
        try:
            return heap_angle(self.result.sphere_centers, self.result.sphere_radii).mean
        except PictureError:
            return math.nan


def case_of(
    code: str, shape: ClumpShape, grains: int, diameter: float, height: float, seed: int
) -> Case[Any]:
    """Lifted cylinder of soft grains under the laws of a code."""
    soft, steel = Material(1200.0, 10e6, 0.3), Material(7800.0, 70e9, 0.3)
    tube = LiftedCylinder(diameter, height, steel, grain_count=grains, rain_rate=3e3)
    return Case(
        scene=tube,
        grains=GrainPopulation(shape, soft, size_sd=0.05),
        grain_grain=Interaction(0.3, 0.5, 0.05),
        grain_wall=Interaction(0.4, 0.4, 0.05),
        seed=seed,
        numerics=Numerics(modulus_scale=20.0),
        laws=PRESETS[code],
    )


def here(case: Case[Any]) -> Heap:
    """Simulate the heap in this process, its kernels compiled before."""
    started = time.process_time()
    [result] = simulate([case], "cpu", 1)
    return Heap(time.process_time() - started, result)


def there(code: str, case: Case[Any]) -> Heap:
    """Simulate the heap by another code on one thread."""
    driver = Driver(code, approximate=True)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        words = driver.write(case, folder)
        before = os.times()
        one_thread = os.environ | {"OMP_NUM_THREADS": "1"}
        done = subprocess.run(words, cwd=folder, env=one_thread, capture_output=True, text=True, check=False)
        after = os.times()
        if done.returncode != 0:
            raise RuntimeError(f"{code} stopped: {done.stdout[-2000:]}{done.stderr[-2000:]}")
        seconds = after.children_user + after.children_system - before.children_user - before.children_system
        return Heap(seconds, driver.read(case, folder))


def compare(code: str, name: str, size: tuple[int, float, float], rounds: int) -> list[dict[str, Any]]:
    """Make the same heaps here and there in turn; one row a heap."""
    shape, rows = SHAPES[name], []
    here(case_of(code, shape, 2, size[1], size[2], 0))
    for seed in range(1, rounds + 1):
        case = case_of(code, shape, *size, seed)
        for where, heap in (("dem-warp", here(case)), (code, there(code, case))):
            row = {
                "laws": code,
                "grains": name,
                "seed": seed,
                "code": where,
                "CPU s": round(heap.seconds, 2),
                "status": heap.result.status,
                "spheres": len(heap.result.sphere_radii),
                "angle deg": round(heap.angle, 2),
            }
            rows.append(row)
            print(row, flush=True)
    return rows


def main(
    out: Annotated[Path, typer.Argument(help="Folder of the results.")],
    grains: Annotated[int, typer.Option(min=10, help="Grains of a heap.")] = 800,
    diameter: Annotated[float, typer.Option(help="Diameter of the tube [mm].")] = 40.0,
    height: Annotated[float, typer.Option(help="Height of the tube [mm].")] = 60.0,
    rounds: Annotated[int, typer.Option(min=1, help="Heaps of each kind, here and there in turn.")] = 3,
    code: Annotated[list[str] | None, typer.Option(help="Only this code; may be given again.")] = None,
) -> None:
    """Time whole heaps here and in other codes, on one core each; write heaps.md, heaps.csv, ratios.csv."""
    rows: list[dict[str, Any]] = []
    for each in code or CODES:
        for name in SHAPES:
            rows += compare(each, name, (grains, 1e-3 * diameter, 1e-3 * height), rounds)
    table = pd.DataFrame(rows)
    times = table.pivot_table(
        index=["laws", "grains", "seed"], columns=table["code"] == "dem-warp", values="CPU s"
    )
    ratio = (times[False] / times[True]).groupby(level=["laws", "grains"]).agg(["median", "min", "max"])
    head = (
        f"On {machine('cpu')}, shared with other work. Processor time from the first grain to "
        f"rest, {grains} grains from the same seed here and in the code that `dem-warp export` writes them "
        "for, in turn."
    )
    ratios = ratio.reset_index().rename(columns={"laws": "code", "median": "times as fast"})
    write_results(out, "heaps", [("ratios", head, ratios), ("heaps", "Each heap:", table)])


if __name__ == "__main__":
    typer.run(main)
