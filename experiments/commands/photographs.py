"""Photographs of heaps to repose angles."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from experiments.errors import InputError
from experiments.files import replacing
from imaging import FitSettings, PictureError, measure_photograph, overlay, read_picture, save_picture


def measure_pictures(
    pictures: Sequence[Path], fit: str = "flank", overlay_folder: Path | None = None
) -> list[dict[str, Any]]:
    """Measure the repose angle of each picture, and draw the fitted flanks on copies, ``NAME-angle.png``.

    Returns
    -------
    list of dict
        For each picture: ``picture``, ``fit``, ``left``, ``right``, ``mean``, ``se`` [degrees; None where it
        could not be measured] and ``reason`` (empty where it could).

    Raises
    ------
    InputError
        When two overlays would have the same name.
    imaging.PictureError
        When there is no such fit.
    """
    FitSettings.of(fit)
    names = [f"{picture.stem}-angle.png" for picture in pictures]
    if overlay_folder and (twice := sorted({name for name in names if names.count(name) > 1})):
        raise InputError("pictures to be drawn on need different names", ", ".join(twice), "--overlay")
    rows = []
    for picture, name in zip(pictures, names, strict=True):
        angle, reason = None, ""
        try:
            angle = measure_photograph(picture, fit)
        except PictureError as error:
            reason = str(error)
        values = {each: getattr(angle, each, None) for each in ("left", "right", "mean", "se")}
        rows.append({"picture": str(picture), "fit": fit, **values, "reason": reason})
        if overlay_folder and angle:
            with replacing(overlay_folder / name) as temporary:
                save_picture(temporary, overlay(read_picture(picture), angle))
    return rows
