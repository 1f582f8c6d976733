"""Hidden frictions looked for on slopes, and on surfaces of the same drums, which an emulator draws.

    python -m experiments.evidence.accuracy.outlines.drawn_outlines --out out/outlines-drawn

The emulator is of the simulated drums of the cellulose study's record at 15 revolutions a minute: 31 drums
of 29,000 spheres. A drum that it draws scatters as those do, and its surface is read with the error that the
study states. So many drums can be had that the gain is told from chance.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
import typer

from dem_warp.scenes.drum_surface import STATIONS
from doe import CurveEmulator, Design, Factor, central_composite
from experiments.commands.console import clear_errors
from experiments.evidence.accuracy.outlines.outlines_record import (
    CENTER_POINTS,
    REPLICATES,
    TRIED,
    Surfaces,
    aim_told,
    regions,
    strengths,
)
from experiments.evidence.performance.result_pages import write_results
from experiments.evidence.studies.cellulose.cellulose_campaign import CURVES
from experiments.evidence.studies.cellulose.cellulose_heaps import read_curves
from experiments.evidence.studies.cellulose.cellulose_plan import READING, coded, factors_of, places, study_at
from experiments.io.files import require_folder
from experiments.studyfile.observables import PROFILES, SURFACE_PROFILE

RECORD = Path(__file__).parents[2] / "studies" / "cellulose" / "record"
SPEED, DARK = 15, 0.5
"""Drums of the record: revolutions a minute, and darkness of the edge."""

OPEN = ("mu", "mu_r")
"""Frictions that are looked for; those of the wall's rolling and the filling are known."""

PART = 0.25
"""Part of the record's ranges, about their middle, that is explored. Over a half of them a surface of the
second degree is too simple: 28 % of the regions by surface, of 20 drums, then held the truth."""

HIDDEN = ((0.0, 0.0), (0.6, -0.5), (-0.5, 0.5), (-0.6, -0.3), (0.5, 0.6), (0.0, -0.6))
"""Coded hidden settings."""

COUNTS, SERIES = (20, 8), 10
"""Profiles that a laboratory measures, and laboratories that measure each hidden setting."""

ANGLE, HEIGHTS = "dynamic_angle", PROFILES[SURFACE_PROFILE]
STEEPNESS = np.abs(STATIONS) < 0.7
"""Stations that the slope is fitted to: the middle of the surface."""


class Drums:
    """A world of drums at given frictions."""

    def __init__(self, record: Path = RECORD) -> None:
        study = study_at("h200")
        table, curves = read_curves(record / CURVES)
        of_speed = (table["rpm"] == SPEED).to_numpy()
        x, self.radius = coded(study, table[of_speed]), study.case({}, 0, f"rpm{SPEED}").scene.diameter / 2
        self.emulator = CurveEmulator.of(x, curves[DARK][of_speed])
        known = factors_of(study)
        self._open = [[factor.name for factor in known].index(name) for name in OPEN]
        self._width = len(known)
        self.factors = tuple(
            Factor(f.name, f.center - PART * f.half_range, f.center + PART * f.half_range)
            for f in (known[place] for place in self._open)
        )

    def draw(self, points: pd.DataFrame, seed: int) -> pd.DataFrame:
        """Draw a drum for each row: heights of its surface [m], and its slope [deg]."""
        rng = np.random.default_rng(seed)
        x = np.zeros((len(points), self._width))
        for place, factor in zip(self._open, self.factors, strict=True):
            x[:, place] = PART * (points[factor.name] - factor.center) / factor.half_range
        scores, _ = self.emulator.scores(x)
        scores = scores + rng.normal(size=scores.shape) * np.sqrt(self.emulator.noises)
        curves = self.emulator.mean + scores @ self.emulator.components
        across = np.array(STATIONS) * self.radius
        heights = np.array([np.interp(across, places(), curve) for curve in curves])
        heights = 1e-3 * (heights + READING * rng.normal(size=heights.shape))
        slopes = [np.polyfit(across[STEEPNESS], row[STEEPNESS], 1)[0] for row in heights]
        found = pd.DataFrame(heights, columns=HEIGHTS, index=points.index)
        return points.assign(**found, **{ANGLE: np.degrees(-np.arctan(slopes)), "status": "finished"})


def plan(design: Design, count: int) -> pd.DataFrame:
    """Lay out the drums of the design, then so many of each hidden setting."""
    rows = [
        {"stage": "design", "run": run, **point}
        for run, point in design.natural.iterrows()
        for _ in range(REPLICATES)
    ]
    for number, at in enumerate(HIDDEN, 1):
        point = {f.name: float(f.to_natural(x)) for f, x in zip(design.factors, at, strict=True)}
        rows += [{"stage": "hidden", "run": number, **point}] * count
    return pd.DataFrame(rows)


def compare(drums: Drums) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Regions of every laboratory by slope and by surface, and what moves in the first design."""
    design = central_composite(drums.factors, "face", CENTER_POINTS)
    tables, moved = [], pd.DataFrame()
    for count in COUNTS:
        for series in range(SERIES):
            cases = drums.draw(plan(design, count), 1_000 * count + series)
            found = Surfaces(design, cases, ANGLE, HEIGHTS)
            table = regions(found, cases, drums.factors).replace({"outline": "surface"})
            tables.append(table.assign(profiles=count, laboratory=series + 1))
            moved = strengths(found) if moved.empty else moved
    return pd.concat(tables, ignore_index=True), moved


def summary(table: pd.DataFrame) -> pd.DataFrame:
    """Means over the laboratories and settings, for each number of profiles."""
    rows = []
    for count, own in table.groupby("profiles", sort=False):
        surface, angle = own[own["by"] == "surface"], own[own["by"] == "angle"]
        by_setting = surface.groupby("hidden")["ratio"].mean()
        rows.append(
            {
                "profiles": count,
                "regions": len(surface),
                "ratio, mean": surface["ratio"].mean(),
                "ratio, least setting": by_setting.min(),
                "ratio, greatest setting": by_setting.max(),
                "angle holds the truth": angle["holds the truth"].mean(),
                "surface holds the truth": surface["holds the truth"].mean(),
            }
            | {
                f"{name} by {by}": rows_of[name].mean()
                for by, rows_of in (("angle", angle), ("surface", surface))
                for name in own
                if name.startswith("range of ")
            }
        )
    return pd.DataFrame(rows)


def write(folder: Path, table: pd.DataFrame, moved: pd.DataFrame) -> Path:
    """Write the page and its tables."""
    means = summary(table)
    said = (
        "# Surfaces and slopes of drawn drums\n\n"
        "    python -m experiments.evidence.accuracy.outlines.drawn_outlines --out OUT\n\n"
        "Hidden frictions are looked for on slopes of drums, and on their surfaces. An emulator of the "
        f"cellulose study's record at {SPEED} revolutions a minute draws the drums, over {PART:.0%} of its "
        f"ranges of {' and '.join(OPEN)}, about their middle. A drum scatters as those of the record do, and "
        f"each height is read with an error of {READING:g} mm. {SERIES} laboratories measure each of "
        f"{len(HIDDEN)} hidden settings, and each has a design of its own with {REPLICATES} drums a run.\n\n"
        f"{aim_told(means['ratio, mean'].min())} {TRIED}\n\n"
        "Ratio: of the region compatible with the surface to that with the slope. Range: part of the "
        "explored range of a factor that is compatible."
    )
    what = (
        "What moves in the first design: the change from the middle of a factor's range to an end, over the "
        "scatter of one drum."
    )
    moved = moved.replace("outline", "surface", regex=True)
    return write_results(folder, "drawn", [("drawn", said, means), ("drawn-strengths", what, moved)])


def main(out: Annotated[Path, typer.Option(help="Folder of the page and its tables.")]) -> None:
    """Compare surfaces and slopes of drawn drums."""
    with clear_errors():
        require_folder(out)
        print(write(out, *compare(Drums())))


if __name__ == "__main__":
    typer.run(main)
