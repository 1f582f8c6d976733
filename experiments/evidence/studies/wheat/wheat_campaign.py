"""Campaign of the study: all cases of all tests at once; it needs neither pandas nor OpenCV."""

from pathlib import Path

from experiments.evidence.studies.batch import simulate_missing
from experiments.evidence.studies.wheat.wheat_plan import POINTS, planned_cases, study_at
from experiments.io.errors import InputError


def run_study(scale: str, folder: Path, device: str | None = None, workers: int | None = None) -> None:
    """Simulate what a folder lacks of the study at a scale; `page` measures it."""
    if scale not in POINTS:
        raise InputError("--scale", f"must be one of {', '.join(POINTS)}", scale)
    study = study_at(scale)
    simulate_missing(study, planned_cases(study, scale), folder, device, workers)
