"""Preparation of a run: the study is read once, then workers and folder are chosen."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from experiments.io.errors import InputError, StudyError
from experiments.runs.request import RunRequest

if TYPE_CHECKING:
    from experiments.cases import Resources
    from experiments.studyfile import Study
    from experiments.studyfile.cluster_section import ClusterSection
    from experiments.studyfile.target_section import TargetSection

BENCH, PAPER = "bench", "paper"
"""Scales of a study where none is named: without a GPU, and with one."""

Check = Callable[["Study"], "Study"]
"""Refuses a study that a command cannot run; returns the study to run."""


_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Prepared:
    """A run that can begin."""

    study: Study
    resources: Resources
    folder: Path
    request: RunRequest


def prepare(
    study: Study | str | Path | None, request: RunRequest, check: Check = lambda study: study, what: str = ""
) -> Prepared:
    """Read and check a study, and choose workers and folder; nothing is written.

    The study comes first, so that one that breaks a rule is refused before the simulator loads.

    Raise InputError with every fault of the study, or of the request.
    """
    early = _read_early(study, request, check)
    resources = chosen_resources(request.device, request.workers, request.scheduler, request.cluster)
    path = study if isinstance(study, str | Path) else None
    if early is None or study is path:
        early = _at_scale(path, early, request, PAPER if resources.on_gpu else BENCH, check)
    folder = Path(request.out) if request.out is not None else default_folder(early, what)
    return Prepared(early, resources_for(early.cluster, resources), folder, request)


def _read_early(study: Study | str | Path | None, request: RunRequest, check: Check) -> Study | None:
    """Read a study at the first scale where it is right; None for the study that ships, which is.

    Raise InputError when it breaks a rule at every scale that the device may choose, or lacks the scale.
    """
    if study is None and request.engine is None:
        return None
    if study is not None and not isinstance(study, str | Path):
        if request.scale not in (None, study.scale):
            raise StudyError(f"{study.file}: scale", f"is loaded at the scale {study.scale!r}", request.scale)
        return check(_with_engine(study, request.engine))
    faults = []
    for scale in dict.fromkeys(_scale(study, request.scale, suited) for suited in (BENCH, PAPER)):
        try:
            return _read(study, scale, request, check)
        except InputError as error:
            faults.append(error)
    raise faults[0]


def _at_scale(
    path: str | Path | None, early: Study | None, request: RunRequest, suited: str, check: Check
) -> Study:
    """Return the study that was read early, or read it at the scale for the device."""
    scale = _scale(path, request.scale, suited)
    return early if early is not None and early.scale == scale else _read(path, scale, request, check)


def _scale(path: str | Path | None, named: str | None, suited: str) -> str | None:
    """Return the scale that is named, or the one for the device if the study has it."""
    from experiments.io.toml_files import read_toml

    if path is None:
        return named or suited
    scales = read_toml(Path(path))[1].get("scale", {})
    if not isinstance(scales, dict):
        return None  # reading the study refuses it
    if named is not None and named not in scales:
        raise StudyError(str(path), f"has no such scale, known: {', '.join(scales) or 'none'}", named)
    return named or (suited if suited in scales else None)


def _read(path: str | Path | None, scale: str | None, request: RunRequest, check: Check) -> Study:
    from experiments.studyfile import load_study

    return check(_with_engine(load_study(path, scale), request.engine))


def _with_engine(study: Study, name: str | None) -> Study:
    """Return a study with the engine that is named, which can simulate its cases."""
    if name is None and study.engine is None and study.solver.corrected_for is None:
        return study
    from experiments.cases import engine_of, with_engine

    study = with_engine(study, name)
    engine_of(study)
    return study


def check_campaign(study: Study) -> Study:
    """Refuse a study that cannot be calibrated; pictures of its target are found, and measured later.

    Raise InputError with every fault and its place.
    """
    from experiments.measurement.measured_target import find_pictured
    from experiments.studyfile.campaign import TARGET_SCENE

    if not _names_pictures(study.target_section):
        return measured_study(study)
    find_pictured(study)
    study.case({}, 0, TARGET_SCENE)
    return study


def with_pictures(prepared: Prepared) -> Prepared:
    """Measure the pictures of a study's target, where it has some.

    Raise InputError when they cannot be used.
    """
    study = prepared.study
    pictured = _names_pictures(study.target_section)
    return replace(prepared, study=measured_study(study)) if pictured else prepared


def _names_pictures(target: TargetSection | None) -> bool:
    return target is not None and target.pictures is not None


def measured_study(study: Study) -> Study:
    """Take the target of a study from its measurements, and check that it can be calibrated.

    Raise InputError when its pictures or its file cannot be used, or its decisions do not fit its factors.
    """
    from experiments.calibrate.checks import check_calibration
    from experiments.measurement.measured_target import with_measurements

    study, notes = with_measurements(study)
    for note in notes:
        _log.warning("The measurements: %s", note)
    check_calibration(study)
    return study


def check_scene(study: Study, scene: str | None = None) -> Study:
    """Refuse a study whose scene cannot be built, e.g. for too many grains, whatever the settings are.

    Raise InputError with every fault and its place.
    """
    from experiments.studyfile.campaign import TARGET_SCENE

    varied = {path[0] for section in study.factor_sections for path in section.paths}
    if not varied & {"grain", "scene"}:  # else the settings decide
        study.case({}, 0, scene or TARGET_SCENE)
    return study


def chosen_resources(
    device: str | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    cluster: str | Path | None = None,
) -> Resources:
    """Return the workers that are asked for, as `RunRequest` has them; default: this machine's.

    Raise InputError when a device is missing or the file breaks a rule, or a scheduler and a file are both
    named.
    """
    from experiments.cases import Resources
    from experiments.studyfile.cluster_section import read_profile

    if scheduler is not None and cluster is not None:
        raise InputError("--scheduler", "cannot be combined with --cluster", f"{scheduler}; {cluster}")
    section = read_profile(Path(cluster)) if cluster is not None else None
    resources = Resources(device, workers, scheduler, section)
    _ = resources.count  # finds devices that are not there
    return resources


def resources_for(cluster: ClusterSection | None, resources: Resources) -> Resources:
    """Take the workers of a study's own ``[cluster]`` where no cluster is asked for.

    A device that is named means this machine.
    """
    if cluster is None or resources.is_cluster or resources.device is not None:
        return resources
    return replace(resources, cluster=cluster)


def default_folder(study: Study, what: str = "") -> Path:
    """Folder of results when none is named: ``out/NAME-SCALE``, NAME from the study file or its folder."""
    name = study.file.stem if study.file.stem != "study" else study.file.resolve().parent.name
    return Path("out") / "-".join(part for part in (name, study.scale, what) if part)
