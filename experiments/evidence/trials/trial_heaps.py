"""The heaps of a trial: its cases, and its measurements as a user would write them down."""

import csv
import lzma
import tarfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from doe.discrepancy import Outcomes, Point
from experiments.evidence.trials.trial_camera import Camera, stated_scales
from experiments.evidence.trials.trials_folder import Folder
from experiments.evidence.trials.truth import Label, read_sealed
from experiments.io.errors import InputError
from experiments.io.files import replacing
from experiments.measurement.instrument_error import CALIBRATION, NONE
from experiments.studyfile.observables import BY_NAME

CLOGGED = "clogged"
"""Word of the reason that a tube held its grains, and of its row in a file of measured heaps."""

LARGEST = 1_000_000
"""Bytes of the largest file of measured heaps in an archive."""


def cases_of(label: Label, conditions: Sequence[str], replicates: int) -> list[Point]:
    """Cases of a trial: replicates of each condition, each with a seed of its own."""
    tested = [condition for condition in conditions for _ in range(replicates)]
    seeds = np.random.SeedSequence(label.seed).generate_state(len(tested)) >> 1
    return [
        Point(label.theta, label.sizes, condition, int(seed))
        for condition, seed in zip(tested, seeds, strict=True)
    ]


def write_heaps(
    path: Path,
    label: Label,
    points: Sequence[Point],
    outcomes: Outcomes,
    observables: Sequence[str],
    calibrated: bool = True,
) -> None:
    """Photograph and measure the heaps of a trial, and write them as a file of measured heaps.

    The outcomes have a column for each of the observables, by their names.
    A tube that held its grains is written down as clogged; a case that failed in another way leaves no row,
    as a test that went wrong in a laboratory. The label's seed draws the camera. The file says how well
    its scale is known, and that nothing else is off in all conditions alike; or, of what is not `calibrated`,
    nothing of it, as most files do.
    """
    rng = np.random.default_rng([label.seed, 1])
    values = Camera.drawn(rng).read(outcomes.values, observables, rng)
    replicates: dict[str, int] = {}
    with replacing(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("condition", "replicate", "observable", "value", "unit"))
        if calibrated:
            # its roll, and what else it errs by, are what the rules' `systematic` stands for
            writer.writerow((CALIBRATION, NONE, "", "", ""))
            for name, known in stated_scales(observables).items():
                writer.writerow((CALIBRATION, "scale", name, known.scale, ""))
        for point, row, reason in zip(points, values, outcomes.reasons, strict=True):
            replicate = replicates[point.condition] = replicates.get(point.condition, 0) + 1
            if not reason:
                for name, value in zip(observables, row, strict=True):
                    unit = "" if BY_NAME[name].unit == "1" else BY_NAME[name].unit
                    writer.writerow((point.condition, replicate, name, f"{value:.8g}", unit))
            elif CLOGGED in reason:
                writer.writerow((point.condition, replicate, CLOGGED, "", ""))


def pack_heaps(folder: Folder, archive: Path) -> Path:
    """Pack the measured heaps of a folder's trials; the same heaps give the same bytes."""
    with replacing(archive) as temporary, tarfile.open(temporary, "w:xz", preset=9) as packed:
        for trial in read_sealed(folder.sealed):
            if (path := folder.measured(trial.trial)).is_file():
                entry = tarfile.TarInfo(path.name)  # without date and owner
                entry.size = path.stat().st_size
                with path.open("rb") as file:
                    packed.addfile(entry, file)
    return archive


def unpack_heaps(archive: Path, folder: Folder) -> int:
    """Unpack the measured heaps of the sealed trials of a folder, and count them."""
    known = {folder.measured(trial.trial).name: trial.trial for trial in read_sealed(folder.sealed)}
    count = 0
    try:
        with tarfile.open(archive, "r:xz") as packed:
            for entry in packed:
                content = packed.extractfile(entry) if entry.size <= LARGEST else None
                if entry.name not in known or content is None:
                    rule = f"must hold only heaps of sealed trials, each of at most {LARGEST:,} bytes"
                    raise InputError(str(archive), rule, entry.name)
                with replacing(folder.measured(known[entry.name])) as temporary:
                    temporary.write_bytes(content.read())
                count += 1
    except (OSError, EOFError, tarfile.TarError, lzma.LZMAError) as error:
        raise InputError(str(archive), "must be an archive of measured heaps", str(error)) from None
    return count
