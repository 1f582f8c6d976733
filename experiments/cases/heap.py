"""One case: simulated, measured, and written as spheres, as a picture of its heap, and as its numbers."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from dem_warp import CaseResult, Progress, simulate
from dem_warp.batch import Onlooker
from experiments.cases.engines import simulator_of
from experiments.files import replacing, write_text
from experiments.measurement.observables import observables_of
from experiments.measurement.states import Observed, observe
from experiments.studyfile import Study
from experiments.studyfile.campaign import TARGET_SCENE
from imaging import HeapAngle, overlay, save_picture, snapshot


@dataclass(frozen=True)
class Heap:
    """A simulated case and the repose angle of its heap, if the test leaves one."""

    study: Study
    """Study that it was made from."""
    settings: dict[str, float]
    """Value of every factor in its natural unit."""
    seed: int
    """Seed of everything random in it."""
    result: CaseResult
    """Result of the case."""
    observed: Observed
    """Measurements of it."""
    scene: str = TARGET_SCENE
    """Name of its scene."""

    @property
    def angle(self) -> HeapAngle | None:
        """Its angle; None when the case failed, there is no measurable heap, or the test leaves none."""
        return self.observed.angle

    @property
    def reason(self) -> str:
        """Reason that the case or the measurement failed; empty when neither did."""
        return self.observed.reason

    @property
    def units(self) -> dict[str, str]:
        """Unit of every observable that it gave."""
        scene = self.study.scenes[self.scene]
        known = observables_of(scene.observables, scene.leaves_a_heap)
        return {name: known[name].unit for name in self.observed.observables if name in known}

    def to_dict(self) -> dict[str, Any]:
        """Everything but the grains as JSON-able data: angles in degrees, observables in SI."""
        angle = self.angle
        return {
            "study": self.study.name,
            "scale": self.study.scale,
            "scene": self.scene,
            "settings": self.settings,
            "units": {factor.name: factor.unit for factor in self.study.factors},
            "seed": self.seed,
            "status": self.result.status,
            "reason": self.reason,
            "fit": self.study.measurement.fit,
            "angle": {"mean": angle.mean, "se": angle.se} if angle else None,
            "views": [
                {"azimuth": math.degrees(azimuth), "left": view.left, "right": view.right}
                for azimuth, view in (zip(angle.azimuths, angle.views, strict=True) if angle else ())
            ],
            "observables": self.observed.observables,
            "observable_units": self.units,
            "provenance": self.result.provenance,
        }


def simulate_heap(
    study: Study,
    settings: Mapping[str, float],
    seed: int,
    device: str | None = None,
    progress: Callable[[Progress], None] | None = None,
    scene: str = TARGET_SCENE,
    onlooker: Onlooker | None = None,
) -> Heap:
    """Simulate one case with the study's engine, and measure its heap.

    Settings, seed and scene are those of `Study.case`; an onlooker is that of `dem_warp.simulate`.

    Raises
    ------
    StudyError
        When there is no such factor or scene, or a value leaves what is physical.
    """
    run, case = simulator_of(study), study.case(settings, seed, scene)
    run = partial(simulate, onlooker=onlooker) if run is simulate else run
    [result] = run([case], device=device, workers=1, on_progress=progress)
    values = {factor.name: settings.get(factor.name, factor.center) for factor in study.factors}
    observed = observe(study.measurement, result, study.scenes[scene].leaves_a_heap)
    return Heap(study, values, seed, result, observed, scene)


def heap_picture(study: Study, result: CaseResult, angle: HeapAngle | None, view: int = 0) -> np.ndarray:
    """Draw a heap, with the flanks that were fitted in one of its views; without an angle, without flanks.

    Returns
    -------
    numpy.ndarray
        Picture (rows, columns, 3), blue-green-red.
    """
    picture = snapshot(
        result.sphere_centers,
        result.sphere_radii,
        azimuth=angle.azimuths[view] if angle else 0.0,
        pixels=study.measurement.pixels,
        grains=result.sphere_grain,
    )
    return overlay(picture, angle.views[view]) if angle else picture.image


def write_heap(heap: Heap, folder: Path) -> None:
    """Write ``heap.vtp``, ``snapshot.png`` and ``angle.json`` into a folder, made when it is missing.

    Where no grain is left, as may be in a hopper, there is nothing to draw.
    """
    if len(heap.result.positions):
        with replacing(folder / "heap.vtp") as temporary:
            write_spheres(temporary, heap.result)
        with replacing(folder / "snapshot.png") as temporary:
            save_picture(temporary, heap_picture(heap.study, heap.result, heap.angle))
    write_text(folder / "angle.json", json.dumps(heap.to_dict(), indent=1, allow_nan=False) + "\n")


def write_spheres(path: Path, result: CaseResult) -> None:
    """Write a heap's spheres as points [m] with ``radius`` [m], ``grain`` and ``shape``, for ParaView."""
    # PyVista is slow to import and absent on some machines that only calibrate.
    import pyvista

    points = pyvista.PolyData(result.sphere_centers)
    points["radius"] = result.sphere_radii
    points["grain"] = result.sphere_grain
    points["shape"] = result.shapes[result.sphere_grain]
    points.save(path)
