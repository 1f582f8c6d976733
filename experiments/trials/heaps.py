"""The heaps of a trial: its cases, and its measurements as a user would write them down."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from doe.discrepancy import Outcomes, Point
from experiments.files import replacing
from experiments.measurement.calibration import CALIBRATION, NONE
from experiments.measurement.observables import OBSERVABLES
from experiments.trials.camera import Camera
from experiments.trials.truth import Label

CLOGGED = "clogged"
"""Word of the reason that a tube held its grains, and of its row in a file of measured heaps."""


def cases_of(label: Label, conditions: Sequence[str], replicates: int) -> list[Point]:
    """Cases of a trial: so many replicates of each condition, each with a seed of its own."""
    tested = [condition for condition in conditions for _ in range(replicates)]
    seeds = np.random.SeedSequence(label.seed).generate_state(len(tested)) >> 1
    return [
        Point(label.theta, label.sizes, condition, int(seed))
        for condition, seed in zip(tested, seeds, strict=True)
    ]


def write_heaps(
    path: Path, label: Label, points: Sequence[Point], outcomes: Outcomes, calibrated: bool = True
) -> None:
    """Photograph and measure the heaps of a trial, and write them as a file of measured heaps.

    A tube that held its grains is written down as clogged; a case that failed in another way leaves no row,
    as a test that went wrong in a laboratory. The label's seed draws the camera. The file says that nothing
    is off in all conditions alike, or, of what is not `calibrated`, nothing of it, as most files do.
    """
    rng = np.random.default_rng([label.seed, 1])
    values = Camera.drawn(rng).read(outcomes.values, rng)
    replicates: dict[str, int] = {}
    with replacing(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("condition", "replicate", "observable", "value", "unit"))
        if calibrated:
            # the cameras' errors are those that the rules' `systematic` stands for
            writer.writerow((CALIBRATION, NONE, "", "", ""))
        for point, row, reason in zip(points, values, outcomes.reasons, strict=True):
            replicate = replicates[point.condition] = replicates.get(point.condition, 0) + 1
            if not reason:
                for observable, value in zip(OBSERVABLES, row, strict=True):
                    unit = "" if observable.unit == "1" else observable.unit
                    writer.writerow((point.condition, replicate, observable.name, f"{value:.8g}", unit))
            elif CLOGGED in reason:
                writer.writerow((point.condition, replicate, CLOGGED, "", ""))
