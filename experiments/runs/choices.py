"""Choices where nothing is named: the workers, the scale of the study, the folder of results."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from experiments.cases import Resources
from experiments.io.errors import InputError
from experiments.studyfile import Study, StudyError, load_study, study_scales
from experiments.studyfile.cluster_section import read_profile


def chosen_resources(
    device: str | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    cluster: str | Path | None = None,
) -> Resources:
    """Workers that are asked for; what is not named is this machine's.

    Parameters
    ----------
    device
        ``"cpu"``, ``"cuda"``, ``"cuda:1"``, or several GPUs between commas.
    workers
        Processes on the CPU, GPUs, or workers of a cluster.
    scheduler
        Address of a Dask scheduler.
    cluster
        File with a ``[cluster]``.

    Raises
    ------
    InputError
        When a device is not there or the file breaks a rule, or a scheduler and a file are both named.
    """
    if scheduler is not None and cluster is not None:
        raise InputError(
            "--scheduler",
            "expected workers are those of a scheduler or of a profile",
            f"{scheduler}; {cluster}",
        )
    section = read_profile(Path(cluster)) if cluster is not None else None
    resources = Resources(device, workers, scheduler, section)
    _ = resources.count  # finds devices that are not there
    return resources


def resources_for(study: Study, resources: Resources) -> Resources:
    """Take the workers of a study's own ``[cluster]`` where none of a cluster are asked for.

    A device that is named means this machine.
    """
    if study.cluster is None or resources.is_cluster or resources.device is not None:
        return resources
    return replace(resources, cluster=study.cluster)


def chosen_study(study: Study | str | Path | None, scale: str | None, resources: Resources) -> Study:
    """Load a study at the scale asked for, or at the one for the workers: paper on GPUs, bench on CPUs.

    A study that is loaded stays as it is.

    Raises
    ------
    StudyError
        When the study breaks a rule, has no such scale, or is loaded at another.
    """
    if isinstance(study, Study):
        if scale not in (None, study.scale):
            raise StudyError(f"{study.file}: scale", f"is loaded at the scale {study.scale!r}", scale)
        return study
    path = None if study is None else Path(study)
    if scale is None:
        suited = "paper" if resources.on_gpu else "bench"
        scale = suited if suited in study_scales(path) else None
    return load_study(path, scale)


def default_folder(study: Study, what: str = "") -> Path:
    """Folder of results when none is named: ``out/NAME-SCALE``, NAME from the study file or its folder."""
    name = study.file.stem if study.file.stem != "study" else study.file.resolve().parent.name
    return Path("out") / "-".join(part for part in (name, study.scale, what) if part)
