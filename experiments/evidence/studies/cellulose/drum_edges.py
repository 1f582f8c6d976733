"""The upper edge of a bed in a drum, as a camera sees it through the clear end against a light.

The edge is finer than the stations of the scene: it is read at any place, look after look, from where the
spheres are. So simulated pictures are averaged over time as real ones are: at a height that the edge passes
in half of all looks the averaged picture is half dark.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dem_warp.reading import read_arrays
from experiments.io.files import replacing

if TYPE_CHECKING:
    from dem_warp.batch import Batch

TURN = "turn"
"""Phase of a drum in which it is measured."""

EVERY = 0.02
"""Least time between two looks, in the world's own time [s]."""

COUNTED = 0.6
"""Areas are compared inside this part of the drum's section: r2 < 0.6 R2."""

PIXEL = 1.0e-4
"""Side of the pixels that areas are counted in [m]."""


class Edges(NamedTuple):
    """Edges of one drum over time."""

    places: np.ndarray
    """[m], shape (places,)."""
    heights: np.ndarray
    """Above the axis [m], shape (looks, places)."""

    def level(self, dark: float) -> np.ndarray:
        """Heights at which the averaged picture is dark by a part [m], shape (places,)."""
        return np.asarray(np.quantile(self.heights, 1.0 - dark, axis=0))


def upper_edge(centers: np.ndarray, radii: np.ndarray, places: np.ndarray, radius: float) -> np.ndarray:
    """Height of the highest point of the spheres at each place; that of the shell below where none is [m].

    Parameters
    ----------
    centers : (n, 3) array
        Centres of the spheres from the drum's axis, which is along y [m].
    radii : (n,) array
    places : (k,) array
        Across the drum, in ascending order and evenly spaced [m].
    radius : float
        Of the drum [m].
    """
    wall = np.sqrt(np.maximum(radius**2 - places**2, 0.0))
    edge = -wall
    step = (places[-1] - places[0]) / (len(places) - 1)
    first = np.ceil((centers[:, 0] - radii - places[0]) / step).astype(int)
    for number in range(int(2 * radii.max(initial=0.0) / step) + 2):
        column = first + number
        seen = (column >= 0) & (column < len(places))
        half = radii[seen] ** 2 - (places[column[seen]] - centers[seen, 0]) ** 2
        inside = half > 0.0
        np.maximum.at(edge, column[seen][inside], centers[seen, 2][inside] + np.sqrt(half[inside]))
    return np.minimum(edge, wall)


def area_of_disagreement(places: np.ndarray, a: np.ndarray, b: np.ndarray, radius: float) -> float:
    """Area where one of two beds is and the other is not, inside r2 < 0.6 R2 [m2]."""
    reach = np.sqrt(COUNTED) * radius
    x = np.arange(-reach + PIXEL / 2, reach, PIXEL)
    half = np.sqrt(reach**2 - x**2)
    low, high = (np.clip(np.interp(x, places, edge), -half, half) for edge in (a, b))
    return float(np.abs(high - low).sum() * PIXEL)


@dataclass
class EdgeWatch:
    """Reads the edges of running drums; for `dem_warp.simulate(on_advance=)`. A file a case, by its name."""

    folder: Path
    places: np.ndarray
    """Across the drum, in ascending order and evenly spaced [m]."""

    def __call__(self, batch: Batch) -> None:
        """Look at each drum that is measured, when its controller does."""
        for world in batch.running:
            controller, step = batch.controllers[world], batch.steps[world]
            period = controller.period * max(1, round(EVERY / (controller.period * self._step(batch, world))))
            if batch.phase(world) == TURN and step % period == 0:
                self._look(batch, world, step)

    @staticmethod
    def _step(batch: Batch, world: int) -> float:
        return batch.setups[world].time_step

    def _look(self, batch: Batch, world: int, step: int) -> None:
        result, radius = batch.result(world), batch.cases[world].scene.diameter / 2
        centers = result.sphere_centers - np.array([0.0, 0.0, radius])
        edge = upper_edge(centers, result.sphere_radii, self.places, radius)
        path = edge_file(self.folder, batch.case_name(world))
        path.parent.mkdir(parents=True, exist_ok=True)
        earlier: Mapping[str, np.ndarray] = read_arrays(path) if path.is_file() else {}
        # a run that goes on from a checkpoint sees some looks again
        kept = earlier["steps"] < step if earlier else np.zeros(0, dtype=bool)
        steps = np.append(earlier["steps"][kept] if earlier else [], step).astype(np.int64)
        before = earlier["heights"][kept] if earlier else np.zeros((0, len(self.places)))
        with replacing(path) as temporary:
            np.savez(temporary, steps=steps, heights=np.vstack([before, edge]), places=self.places)


def edge_file(folder: Path, name: str) -> Path:
    """File of the edges of a case, by its name."""
    return folder / f"{name}.npz"


def read_edges(folder: Path, name: str) -> Edges:
    """Read the edges of a case."""
    path = edge_file(folder, name)
    if not path.is_file():
        raise FileNotFoundError(f"no edges of the case: {path}")
    found = read_arrays(path)
    return Edges(found["places"], found["heights"])
