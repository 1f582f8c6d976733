"""A bank that others made: pictures of drums of known settings, read, and emulated at every setting."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from pathlib import Path

import cv2
import numpy as np
import pandas as pd

from doe.curves.curve_emulator import CurveEmulator
from experiments.evidence.studies.granudrum.candidates import Candidates
from imaging import DrumReading, PictureError, View, read_drum, read_picture

SPEEDS = (10, 30, 50)
"""Turns of the drum [1/min]."""
LEVELS = {
    "diameter [mm]": (1.1, 1.5),
    "restitution": (0.1, 0.5, 0.9, 0.99),
    "sliding friction": (0.15, 0.2, 0.3, 0.5, 0.8, 1.0),
    "rolling friction": (0.0, 0.01, 0.05, 0.1, 0.2, 0.4, 0.7),
    "cohesion [J/m3]": (0, 10_000, 20_000, 30_000, 40_000, 50_000, 70_000),
}
"""Settings of `parameters_granudrum_unique.txt`; the smallest of its three sizes has no pictures."""
COUNTS = np.array([len(levels) for levels in LEVELS.values()])
GRID = np.array([*product(*map(range, COUNTS))])
"""Levels of all settings, (2352, 5)."""
COHESION_NAME = "cohesion [J/m3]"
COHESION = list(LEVELS).index(COHESION_NAME)
"""Name and column of the cohesion."""
RADIUS, CIRCLE = 42.0, (99.5, 99.5, 99.5)
"""Radius of the drum [mm], and the drum in each simulated picture [pixels]; in the real one it is found."""
TURN = 40.0
"""Angle of the plane through the axis above which heights are taken [degrees]: few surfaces overhang it."""
PLACES = np.linspace(-0.8, 0.8, 9)
"""Places on that plane [radii]."""
HEIGHTS = [f"h{number}" for number in range(1, len(PLACES) + 1)]
READ = ["dynamic_angle", "filling", *HEIGHTS]
MEASURED = "gd_50rpm_experimental"
"""Picture of the real drum, at 50 turns a minute."""


def coded(levels: np.ndarray) -> np.ndarray:
    """Return levels as coded settings: each is the middle of its cell of the box from -1 to +1."""
    return np.asarray(2.0 * (levels + 0.5) / COUNTS - 1.0)


def heights(drum: DrumReading) -> np.ndarray:
    """Heights of a surface above the plane at `PLACES` [mm], those of the shell beyond the bed."""
    x, z = drum.surface.points().T
    cosine, sine = np.cos(np.radians(TURN)), np.sin(np.radians(TURN))
    along, up = x * cosine - z * sine, z * cosine + x * sine
    order, wall = np.argsort(along), np.sqrt(1.0 - PLACES**2)
    return RADIUS * np.clip(np.interp(PLACES, along[order], up[order]), -wall, wall)


def read_row(path: Path) -> dict[str, object]:
    """Read one picture: its speed and levels (-1: the real drum), what was read, and doubts."""
    cv2.setNumThreads(1)
    rpm = int(path.parent.name.removeprefix("gd_").removesuffix("rpm_images"))
    own = [-1] * 5 if path.stem == MEASURED else [int(level) for level in path.stem.split("_")[1:]]
    own[0] -= path.stem != MEASURED
    row = {"rpm": rpm, **dict(zip(LEVELS, own, strict=True)), "doubts": ""}
    view = None if path.stem == MEASURED else View(circle=CIRCLE)
    try:
        drum = read_drum(read_picture(path), view, path.name)
    except PictureError:
        return row | {"doubts": "refused"}
    if drum.filling is None or drum.surface.mirrored:
        return row | {"doubts": "turned round"}
    row |= {"doubts": " ".join(doubt.name for doubt in drum.doubts)}
    return row | dict(zip(READ, [drum.dynamic_angle, drum.filling, *heights(drum)], strict=True))


def read_pictures(folder: Path, kept: Path, workers: int) -> pd.DataFrame:
    """Read all pictures of the repository, or what was read of them before."""
    if not kept.is_file():
        paths = sorted(folder.glob("gd_*rpm_images/gd_*.jpg"))
        with ProcessPoolExecutor(workers) as pool:
            rows = list(pool.map(read_row, paths, chunksize=40))
        pd.DataFrame(rows).to_csv(kept, index=False, float_format="%.2f")
    return pd.read_csv(kept, keep_default_na=False, na_values={name: [""] for name in READ})


@dataclass(frozen=True, eq=False)
class DrumBank:
    """Surfaces of the settings that were read at every speed, some of them held out of the emulators."""

    levels: np.ndarray
    """Levels of each setting, (settings, 5)."""
    surfaces: Mapping[int, np.ndarray]
    """Heights [mm] by speed, (settings, places) each."""
    held_out: np.ndarray
    """True where the emulators have not seen it, (settings,)."""

    @classmethod
    def of(cls, table: pd.DataFrame, seed: int = 1) -> DrumBank:
        """Hold out a fifth of the settings."""
        known = table[(table[COHESION_NAME] >= 0) & table[HEIGHTS].notna().all(axis=1)]
        wide = known.pivot_table(HEIGHTS, list(LEVELS), "rpm").dropna()
        held_out = np.zeros(len(wide), dtype=bool)
        held_out[np.random.default_rng(seed).permutation(len(wide))[: len(wide) // 5]] = True
        surfaces = {rpm: wide.xs(rpm, axis=1, level="rpm")[HEIGHTS].to_numpy() for rpm in SPEEDS}
        return cls(np.array(wide.index.to_list()), surfaces, held_out)

    @cached_property
    def candidates(self) -> Candidates:
        """All settings, as emulators of the surfaces at each speed predict them."""
        x, known = coded(self.levels[~self.held_out]), ~self.held_out
        made = {
            str(rpm): CurveEmulator.of(x, rows[known], varying=True) for rpm, rows in self.surfaces.items()
        }
        return Candidates(made, coded(GRID))

    def surfaces_of(self, row: int, without: int = 0) -> dict[str, np.ndarray]:
        """Surfaces of one setting by speed; one speed may be left out."""
        return {str(rpm): rows[row] for rpm, rows in self.surfaces.items() if rpm != without}
