"""Fillings of drums as stated and as reached, for balls of several sizes, level and inclined.

    python -m experiments.evidence.performance.fillings --device cpu --out out/fillings

Each drum is filled and hardly turned. The record is in README.md beside this file.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import pandas as pd
import typer

from dem_warp import Case, ClumpShape, Drum, GrainPopulation, Interaction, Material, Numerics, simulate
from experiments.commands.console import clear_errors
from experiments.commands.options import OneDevice
from experiments.evidence.performance.result_pages import write_results
from experiments.io.files import require_folder
from experiments.measurement.filling import filling_reached

DIAMETER, LENGTH = 0.084, 0.02
"""Of the drum [m]."""
ACROSS = (10, 20)
"""Grains across the drum."""
LEVEL, INCLINED = (0.2, 0.35, 0.4, 0.5, 0.6, 0.7, 0.8), (0.35, 0.4, 0.5, 0.6)
"""Stated fillings, and those of a drum whose axis is inclined by 45 degrees."""

BALL = Material(density=1400.0, shear_modulus=10e6, poisson_ratio=0.3)
SURFACES = {
    "smooth": Interaction(restitution=0.4, static_friction=0.4, rolling_friction=0.05),
    "rough": Interaction(restitution=0.4, static_friction=0.8, rolling_friction=0.3),
}
SOFTENED = 20.0


def drum_case(surface: str, across: int, inclination: float, filling: float) -> Case:
    """A drum with so many balls of a surface across it; inclination in degrees."""
    scene = Drum(
        diameter=DIAMETER,
        length=LENGTH,
        wall_material=BALL,
        rotation_rate=0.25,
        filling=filling,
        start_up=0.0,
        revolutions=0.01,
        rest_speed=0.02,
        inclination=math.radians(inclination),
    )
    return Case(
        scene=scene,
        grains=GrainPopulation(ClumpShape.sphere(DIAMETER / across / 2), BALL),
        grain_grain=SURFACES[surface],
        grain_wall=SURFACES[surface],
        numerics=Numerics(modulus_scale=SOFTENED),
        seed=1,
    )


def fill(device: str | None) -> pd.DataFrame:
    """Fill all drums; a row each."""
    asked = [
        (surface, across, inclination, filling)
        for surface in SURFACES
        for across in ACROSS
        for inclination, fillings in ((0.0, LEVEL), (45.0, INCLINED))
        for filling in fillings
    ]
    cases = [drum_case(*drum) for drum in asked]
    rows = []
    for drum, case, result in zip(asked, cases, simulate(cases, device), strict=True):
        surface, across, inclination, filling = drum
        reached = filling_reached(case.scene, result.observables)
        rows.append(
            {
                "grains": surface,
                "across": across,
                "inclination [deg]": inclination,
                "stated": filling,
                "reached": reached,
                "count": result.observables.get("grain_count"),
                "solid fraction": result.observables.get("solid_fraction"),
                "status": result.status,
            }
        )
    return pd.DataFrame(rows)


def main(
    out: Annotated[Path, typer.Option(help="Folder of the table.")] = Path("out/fillings"),
    device: OneDevice = "cpu",
) -> None:
    """Fill drums, and say what was reached."""
    with clear_errors():
        require_folder(out)
        told = "Filling of a drum as stated and as reached: the part of its volume below the bed's surface."
        print(write_results(out, "fillings", [("fillings", told, fill(device))]))


if __name__ == "__main__":
    typer.run(main)
