"""The study with the missing mechanism added: a study file that the next calibration starts from."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from experiments.discover.discovery import Data, Discovery, Interval
from experiments.discover.library import Mechanism
from experiments.files import replacing, write_text
from experiments.report.discovery.terms import Terms
from experiments.study import Study
from experiments.study.card import shapes_of
from experiments.study.toml_files import toml_text

HEAD = """\
# Written by dem-warp discover: {name}, with {title} added as a factor that ranges over its 90 % interval.
# Run it with  dem-warp calibrate {file}

"""

ANGLE = "flank_angle"
"""Observable that a calibration takes as its target."""

DIGITS = 4
"""Significant digits of the ends of a range."""


def write_study_files(found: Discovery, study: Study, terms: Terms, folder: Path) -> list[Path]:
    """Write a study file for each model that the verdict leaves standing, and its clumps beside it.

    Parameters
    ----------
    found
        What the analysis found. A tie gives a file a mechanism, a pair one file.
    study
        The study that was analysed.
    terms
        The mechanisms by name.
    folder
        Where ``study-with-NAME.toml`` goes.

    Returns
    -------
    list of Path
        The files; none where nothing was named.
    """
    written = []
    for candidate in _standing(found):
        added = [(terms.mechanisms[name], size) for name, size in candidate]
        document = extended_document(study, added, found.data)
        for shape in shapes_of(document):
            source = study.file.parent / shape["clump"]
            shape["clump"] = source.name
            with replacing(folder / source.name) as temporary:
                shutil.copyfile(source, temporary)
        path = folder / f"study-with-{'-and-'.join(name for name, _ in candidate)}.toml"
        title = terms.titles(name for name, _ in candidate)
        head = HEAD.format(name=study.name, title=title, file=path.name)
        write_text(path, head + toml_text(document))
        written.append(path)
    return written


def extended_document(
    study: Study, added: Sequence[tuple[Mechanism, Interval]], data: Data
) -> dict[str, Any]:
    """Add mechanisms to a study's document, each as a factor that ranges over its interval.

    A study without a target takes the measured repose angle of its first training condition for one.

    Parameters
    ----------
    study
        The study that was analysed.
    added
        Mechanisms with their sizes.
    data
        What was measured.
    """
    document = study.document
    for mechanism, size in added:
        for place in mechanism.parameters:
            _drop(document, place.split("."))
        document.setdefault("factor", []).append(_factor(mechanism, size))
    if "target" not in document and (target := _target(data)):
        document["target"] = target
    return document


def _standing(found: Discovery) -> list[list[tuple[str, Interval]]]:
    """Models to write: the chosen one, or each of a tie."""
    if found.chosen is None or not found.named:
        return []
    chosen = found.chosen.mechanisms, found.chosen.sizes
    tied = [(c.mechanisms, c.sizes) for c in found.candidates if c.mechanisms in [(n,) for n in found.named]]
    models = [chosen] if set(chosen[0]) == set(found.named) else tied
    return [list(zip(*model, strict=True)) for model in models]


def _factor(mechanism: Mechanism, size: Interval) -> dict[str, Any]:
    low, high = max(size.low, mechanism.null), min(size.high, mechanism.maximum)
    if not low < high:
        low, high = mechanism.null, mechanism.maximum
    return {
        "name": mechanism.name,
        "label": mechanism.title,
        "parameter": list(mechanism.parameters),
        "low": _quantity(low, mechanism.unit),
        "high": _quantity(high, mechanism.unit),
    }


def _target(data: Data) -> dict[str, Any]:
    """The measured angle of the first training condition that has one, as a study's target."""
    if ANGLE not in data.observables:
        return {}
    column = data.observables.index(ANGLE)
    for row, held_out in enumerate(data.held_out):
        mean, se, count = (table[row, column] for table in (data.means, data.standard_errors, data.replicates))
        if not held_out and count >= 2 and np.isfinite(se) and se > 0.0:
            sd = float(se) * float(np.sqrt(count))
            return {"mean": _quantity(float(mean), "deg"), "sd": _quantity(sd, "deg"), "n": int(count)}
    return {}


def _quantity(value: float, unit: str) -> str | float:
    rounded = float(f"{value:.{DIGITS}g}")
    return rounded if unit in ("", "1") else f"{rounded} {unit}"


def _drop(document: dict[str, Any], path: Sequence[str]) -> None:
    *outer, last = path
    for key in outer:
        if not isinstance(document := document.get(key, {}), dict):
            return
    document.pop(last, None)
