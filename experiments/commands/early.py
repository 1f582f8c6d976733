"""Checks of what a command is given that need no library: a mistyped file is answered at once."""

from __future__ import annotations

from pathlib import Path

from experiments.errors import StudyError
from experiments.toml_files import read_toml


def check_study_file(path: Path | None, scale: str | None = None) -> None:
    """Refuse a study file that cannot be read, is no TOML, or has no such scale; its values wait.

    Raises
    ------
    StudyError
        With the place of the first fault.
    """
    if path is None:
        return
    scales = read_toml(path)[1].get("scale", {})
    if scale is not None and isinstance(scales, dict) and scale not in scales:
        known = ", ".join(scales) or "none"
        raise StudyError(f"the scale must be one that the study has, known: {known}", scale, str(path))
