"""Heaps of the paper's 31 runs under ten bases of the study, each read by every estimator as it ends.

A base is the relative rolling law with one clump on one plate, at the study's scale. The paper leaves all of
them open as well as the part of the outline that its line is fitted to.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache, partial
from itertools import product
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pandas as pd

from dem_warp import CaseResult
from experiments.cases import OwnWorkers, Store
from experiments.cases.execute import build_cases
from experiments.cases.measuring import measuring_processes
from experiments.cases.workers.own import THIS_MACHINE
from experiments.evidence.studies.buckwheat.replay.runs import DESIGNS, planned_cases
from experiments.io.files import write_text
from experiments.studyfile import load_study
from experiments.studyfile.study import MeasurementSection
from imaging import PictureError, heap_outlines, silhouette

CLUMPS = {"printed": "clump.txt"} | {
    name: f"clumps/{name}-9.txt" for name in ("bulging", "keeled", "swelling", "flat")
}
PLATES: Mapping[str, dict[str, str]] = {"endless": {}, "round": {"plate_diameter": "100 mm"}}
BASES = {f"relative-{clump}-{plate}": (clump, plate) for clump, plate in product(CLUMPS, PLATES)}
"""Clump and plate by the name of the base, in the order that ends a tie."""

LAW = {"elastic_plastic_rolling": {"rolling_stiffness": 2.25, "rolling_damping": 0.3}}
"""Mechanism of the relative rolling law."""

PIXELS = "pixels"
ESTIMATORS = {
    "flank": "line through the whole flank",
    "trimmed": "line through 10 to 90 % of the height",
    "middle": "line through 20 to 80 % of the height",
    "lower": "line through the lower half",
    "upper": "line through the upper half",
    PIXELS: "line through the pixels of the outline",
}
"""Ways to read a heap, in words, in the order that ends a tie. All but the last are fits of `imaging`."""

OBSERVED = ("centre_height", "rolled_fraction", "wall_drag")
"""Observables of a heap that are kept next to its angles."""


def base_changes(name: str, modulus_scale: float | None = None) -> dict[str, Any]:
    """Return the changes of the study that make a base of it; a modulus scale of None is its own."""
    clump, plate = BASES[name]
    changes = {"grain": {"clump": CLUMPS[clump]}, "mechanism": LAW}
    changes["scene"] = {"lifted-cylinder": PLATES[plate]}
    return changes | ({} if modulus_scale is None else {"numerics": {"modulus_scale": modulus_scale}})


def simulate_base(
    name: str,
    folder: Path,
    replicates: int,
    scale: str = "printed",
    modulus_scale: float | None = None,
    workers: OwnWorkers = THIS_MACHINE,
) -> pd.DataFrame:
    """Simulate the heaps that neither the table of a base nor its folder has; read them, and write the table.

    Other processes may simulate other bases in the same folder. The table has a row a heap: stage, run,
    replicate, published [deg], seed, case_key, and what `read_heap` gives.
    """
    study = load_study(scale=scale, changes=base_changes(name, modulus_scale))
    plan, store, path = planned_cases(replicates, DESIGNS), Store(folder / name), base_table(folder, name)
    cases = {store.key(case): case for case in build_cases(study, plan)[0] if case}
    known = pd.read_csv(path, index_col="case_key") if path.is_file() else pd.DataFrame()
    new = [key for key in cases if key not in known.index]
    missing = [key for key in new if not store.has(key)]

    def keep(number: int, result: CaseResult) -> None:
        store.save(missing[number], result)

    workers.simulate([cases[key] for key in missing], None, keep, checkpoint=store.unfinished)
    if new:
        read = partial(read_heap, store, study.measurement)
        with measuring_processes(workers.helpers, read, len(new)) as pool:
            rows = pd.DataFrame(pool.map(read, new), index=new)
        labels = plan[["stage", "run", "replicate", "published", "seed"]].set_axis(list(cases))
        known = pd.concat([known.loc[known.index.isin(list(cases))], labels.loc[new].join(rows)])
        write_text(path, known.to_csv(index_label="case_key"))
    return known


def base_table(folder: Path, name: str) -> Path:
    """Return the file of a base's heaps."""
    return folder / f"{name}.csv"


def read_heap(store: Store, section: MeasurementSection, key: str) -> dict[str, Any]:
    """Read a stored heap: its angle by each estimator [deg], observables, and the reason of what it lacks."""
    result = store.load(key)
    found: dict[str, Any] = {name: result.observables.get(name) for name in OBSERVED}
    reasons = [result.reason] if result.reason else []
    if result.status == "finished":
        spheres, azimuths = (result.sphere_centers, result.sphere_radii), section.azimuths
        seen = cache(partial(heap_outlines, *spheres, azimuths, section.pixels))
        for name in ESTIMATORS:
            try:
                found[name] = pixels_angle(*spheres, section) if name == PIXELS else seen().angle(name).mean
            except (PictureError, ValueError, TypeError) as error:  # a side may be without pixels
                reasons.append(f"{name}: {error}")
    return {**dict.fromkeys(ESTIMATORS), **found, "reason": "; ".join(reasons)}


def pixels_angle(centers: np.ndarray, radii: np.ndarray, section: MeasurementSection) -> float:
    """Fit lines to the pixels of a heap's outline, seen from several sides; return the mean angle [deg].

    The paper's way, as far as it is described: a screenshot is made grey and is thresholded, a line is fitted
    to the outline, and its slope is counted in pixels. Every pixel of the largest outline above the plate
    counts, so that steep places count more than in a fit of one height a column, and no foot is left out.
    """
    slopes = []
    for azimuth in np.arange(section.azimuths) * np.pi / section.azimuths:
        drawn = silhouette(centers, radii, azimuth, section.pixels)
        heap = (drawn.image[: int(drawn.ground_row) + 1] < 128).astype(np.uint8)
        outlines, _ = cv2.findContours(heap, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        column, row = max(outlines, key=cv2.contourArea).reshape(-1, 2).T
        apex = column[row == row.min()].mean()
        for side in (column <= apex, column >= apex):
            used = side & (row < row.max())
            slopes.append(np.polyfit(column[used], row[used], 1)[0])
    return float(np.degrees(np.arctan(np.abs(slopes))).mean())
