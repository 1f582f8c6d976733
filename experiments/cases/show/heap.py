"""One case: simulated, measured, and written as spheres, as a picture of its heap, and as numbers."""

from __future__ import annotations

import json
import math
import shutil
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from dem_warp import Case, CaseResult, Film, simulate_frames
from dem_warp.result import OnProgress
from experiments.cases.engines.engine import NO_ANSWER
from experiments.cases.engines.engines import engine_of
from experiments.cases.show.frames import write_frames
from experiments.cases.show.movie import NO_MOVIE, write_movie
from experiments.cases.show.polydata import poly, save
from experiments.cases.store.store import Store
from experiments.cases.workers.own import THIS_MACHINE, OwnWorkers
from experiments.cases.workers.workers import Workers
from experiments.io.errors import InputError
from experiments.io.files import replacing, write_text
from experiments.io.program_version import with_version
from experiments.measurement.case_observables import Observed, observe, with_bulk_density
from experiments.measurement.filling import filling_reached
from experiments.studyfile import Study
from experiments.studyfile.campaign import TARGET_SCENE
from experiments.studyfile.observables import observables_of
from imaging import HeapAngle, PictureError, Snapshot, overlay, save_picture, snapshot


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
    film: Film | None = None
    """Frames of its course, if they were asked for and it could begin."""

    def __str__(self) -> str:
        return str(self.angle) if self.angle else f"{self.result.status}: {self.reason or 'no heap'}"

    @property
    def angle(self) -> HeapAngle | None:
        """Its angle; None if the case failed or left no measurable heap."""
        return self.observed.angle

    @property
    def reason(self) -> str:
        """Reason that the case or the measurement failed; empty if both succeeded."""
        return self.observed.reason

    @property
    def filling(self) -> float | None:
        """Part of the drum that its bed took; None for another test, or an unfilled drum."""
        scene = self.study.case(self.settings, self.seed, self.scene).scene
        return filling_reached(scene, self.result.observables)

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
            "filling": self.filling,
            "provenance": {**with_version(self.result.provenance), "study": self.study.sha256},
        }


def simulate_heap(
    study: Study,
    settings: Mapping[str, float],
    seed: int,
    workers: Workers = THIS_MACHINE,
    progress: OnProgress | None = None,
    scene: str = TARGET_SCENE,
    frames: int | None = None,
    store: Store | None = None,
) -> Heap:
    """Simulate one case with the study's engine, and measure its heap.

    Settings, seed and scene are those of `Study.case`. With a number of `frames` its course is kept, and the
    result is the same to the bit. A `store` keeps checkpoints and the result, which is not simulated again.

    Raises
    ------
    StudyError
        When there is no such factor or scene, or a value leaves what is physical.
    InputError
        When frames are wanted and the engine is not dem-warp's own.
    """
    case, film = study.case(settings, seed, scene), None
    if frames is None:
        result = _result(study, case, workers, progress, store)
    else:
        result, film = simulate_frames(case, frames, filmed_by(workers).name, progress)
    values = {factor.name: settings.get(factor.name, factor.center) for factor in study.factors}
    observed = observe(study.measurement, result, study.scenes[scene].leaves_a_heap)
    observed = replace(observed, observables=with_bulk_density(observed.observables, case))
    return Heap(study, values, seed, result, observed, scene, film)


def _result(
    study: Study, case: Case, workers: Workers, progress: OnProgress | None, store: Store | None
) -> CaseResult:
    if store is None:
        [result] = workers.simulate([case], engine_of(study), on_progress=progress)
        return result
    key = store.key(case)
    if store.has(key):
        return store.load(key)
    [result] = workers.simulate([case], store.engine, None, progress, store.unfinished)
    if result.status != NO_ANSWER:
        store.save(key, result)
    shutil.rmtree(store.unfinished, ignore_errors=True)
    return result


def check_filmed(study: Study) -> None:
    """Raise InputError when another engine than dem-warp's simulates the study: it keeps no frames."""
    if engine_of(study) is not None:
        other = study.engine and (study.engine.name or study.engine.command)
        raise InputError("--frames", "must run on dem-warp's own engine", other)


def filmed_by(workers: Workers) -> OwnWorkers:
    """Return the workers, which must be this machine's to keep frames; raise InputError when they are not."""
    if not isinstance(workers, OwnWorkers):
        raise InputError("--frames", "must run on this machine", workers.machine)
    return workers


def heap_snapshot(study: Study, result: CaseResult, angle: HeapAngle | None, view: int = 0) -> Snapshot:
    """Draw a heap from the camera of one of the views of its angle."""
    return snapshot(
        result.sphere_centers,
        result.sphere_radii,
        azimuth=angle.azimuths[view] if angle else 0.0,
        pixels=study.measurement.pixels,
        grains=result.sphere_grain,
    )


def write_heap(heap: Heap, folder: Path, movie: str = "gif") -> None:
    """Write ``heap.vtp``, pictures and ``angle.json`` into a folder, made when it is missing.

    ``snapshot.png`` shows the fitted flanks; ``snapshot-clean.png`` is the same picture without them.
    Frames, if there are any, are written into the folder ``frames``, with a film of a kind of
    `experiments.cases.show.movie.MOVIES`. A test that leaves no grain, e.g. a hopper, has no
    picture; neither has a program's answer that cannot be drawn.
    """
    if len(heap.result.positions):
        with replacing(folder / "heap.vtp") as temporary:
            write_spheres(temporary, heap.result)
        with suppress(PictureError):  # the heap's reason says as much
            _write_pictures(heap, folder)
    if heap.film:
        write_frames(heap.film, folder / "frames")
        if movie != NO_MOVIE:
            write_movie(heap.film, folder / f"heap.{movie}")
    write_text(folder / "angle.json", json.dumps(heap.to_dict(), indent=1, allow_nan=False) + "\n")


def _write_pictures(heap: Heap, folder: Path) -> None:
    clean = heap_snapshot(heap.study, heap.result, heap.angle)
    annotated = overlay(clean, heap.angle.views[0]) if heap.angle else clean.image
    for name, picture in (("snapshot-clean.png", clean.image), ("snapshot.png", annotated)):
        with replacing(folder / name) as temporary:
            save_picture(temporary, picture)


def write_spheres(path: Path, result: CaseResult) -> None:
    """Write a heap's spheres as points [m] with ``radius`` [m], ``grain`` and ``shape``."""
    grains = result.sphere_grain
    arrays = {"radius": result.sphere_radii, "grain": grains, "shape": result.shapes[grains]}
    save(poly(result.sphere_centers, arrays), path)
