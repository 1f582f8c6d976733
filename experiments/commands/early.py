"""Checks of what a command is given, before the libraries that it works with are loaded."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from experiments.studyfile import Study

BY_DEVICE = ("bench", "paper")
"""Scales of which the device chooses one where none is named."""


def check_study_file(path: Path | None, scale: str | None = None, engine: str | None = None) -> None:
    """Refuse a study file that breaks a rule, or lacks the scale, or an engine that is none.

    Where the device chooses the scale, a study passes that is right at one of them; the command itself reads
    it again, at that scale.

    Raises
    ------
    InputError
        With every fault and its place.
    """
    _readable(path, scale, engine)


def check_calibration_file(path: Path | None, scale: str | None = None, engine: str | None = None) -> None:
    """Refuse besides a study that cannot be calibrated; pictures of its target are found, and not measured.

    Raises
    ------
    InputError
        With every fault and its place.
    """
    if (study := _readable(path, scale, engine)) is None:
        return
    from experiments.measurement.measured_target import find_pictured, with_measurements
    from experiments.studyfile.campaign import TARGET_SCENE, scenes_of

    pictured = find_pictured(study)
    measured = study if pictured else with_measurements(study)[0]
    for scene in (TARGET_SCENE,) if pictured else scenes_of(measured.target.fitted):
        study.case({}, 0, scene)  # refuses too many grains, before the simulator loads
    if not pictured:
        from experiments.calibrate.checks import check_calibration

        check_calibration(measured)


def check_heap_file(
    path: Path | None, scale: str | None = None, engine: str | None = None, scene: str | None = None
) -> None:
    """Refuse besides a study whose scene cannot be built, for too many grains, whatever the settings are.

    Raises
    ------
    InputError
        With every fault and its place.
    """
    if (study := _readable(path, scale, engine)) is None:
        return
    from experiments.studyfile.campaign import TARGET_SCENE

    varied = {path[0] for section in study.factor_sections for path in section.paths}
    if not varied & {"grain", "scene"}:  # else the settings decide
        study.case({}, 0, scene or TARGET_SCENE)


def _readable(path: Path | None, scale: str | None, engine: str | None) -> Study | None:
    """Read a study file; None where none is named and the study that ships is meant."""
    if path is None and engine is None:
        return None
    from experiments.io.errors import InputError, StudyError
    from experiments.io.toml_files import read_toml

    scales = read_toml(path)[1].get("scale", {}) if path is not None else {}
    if path is not None and scale is not None and isinstance(scales, dict) and scale not in scales:
        named = ", ".join(scales) or "none"
        raise StudyError(str(path), f"the scale must be one that the study has, known: {named}", scale)
    # now the sections of a study, which need pydantic and numpy
    from experiments.studyfile import load_study, study_scales

    known = study_scales(path)
    wanted = [scale] if scale else dict.fromkeys(one if one in known else None for one in BY_DEVICE)
    read, faults = [], []
    for each in wanted:
        try:
            read.append(load_study(path, each))
        except InputError as error:
            faults.append(error)
    if not read:
        raise faults[0]
    study = read[0]
    if engine is not None or study.engine is not None or study.solver.corrected_for is not None:
        from experiments.cases import engine_of, with_engine

        study = with_engine(study, engine)
        engine_of(study)
    return study
