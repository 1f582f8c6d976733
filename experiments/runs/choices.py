"""Choices where nothing is named: the device, the scale of the study, the folder of results."""

from __future__ import annotations

from pathlib import Path

from dem_warp.device import resolve_device
from experiments.discover.devices import resolve_devices
from experiments.errors import InputError
from experiments.studyfile import Study, StudyError, load_study, study_scales


def chosen_device(device: str | None, several: bool = False) -> str:
    """Name of the device to run on, or of several between commas: as asked, or the GPU if there is one.

    Raises
    ------
    InputError
        When one is not there or is named twice, or the CPU stands beside a GPU.
    """
    try:
        return ",".join(resolve_devices(device)) if several else resolve_device(device)
    except ValueError as error:
        raise InputError(str(error), device, "--device") from None


def chosen_study(study: Study | str | Path | None, scale: str | None, device: str) -> Study:
    """Load a study at the scale asked for, or at the one for the device: paper on a GPU, bench on a CPU.

    A study that is loaded stays as it is.

    Raises
    ------
    StudyError
        When the study breaks a rule, has no such scale, or is loaded at another.
    """
    if isinstance(study, Study):
        if scale not in (None, study.scale):
            raise StudyError(f"is loaded at the scale {study.scale!r}", scale, f"{study.file}: scale")
        return study
    path = None if study is None else Path(study)
    if scale is None:
        suited = "paper" if device.startswith("cuda") else "bench"
        scale = suited if suited in study_scales(path) else None
    return load_study(path, scale)


def default_folder(study: Study, what: str = "") -> Path:
    """Folder of results when none is named: ``out/NAME-SCALE``, NAME from the study file or its folder."""
    name = study.file.stem if study.file.stem != "study" else study.file.resolve().parent.name
    return Path("out") / "-".join(part for part in (name, study.scale, what) if part)
