"""Cards and studies that are exported to another code."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from experiments.export import ExportedTest, Translation
from experiments.io.texts import enumeration
from experiments.studyfile import Study, load_card, load_study
from experiments.studyfile.campaign import TARGET_SCENE
from experiments.studyfile.card import is_card
from experiments.studyfile.solver_section import UNNAMED

SAID = {
    "solver": f"contact laws ([material.solver]; {UNNAMED!r} is taken)",
    "numerics": "modulus scale and time step ([fitted.numerics])",
    "measurement": "reading of a heap ([fitted.measurement])",
}
"""Sections of a card that change what its values mean."""


def study_of(path: Path | None, scale: str | None) -> Study:
    """Load a study at a scale, or the study of a material card's own test; None is the paper's buckwheat.

    Raises
    ------
    StudyError
        When the file cannot be read or breaks a rule, or a card is asked for a scale.
    """
    if path is not None and scale is None and is_card(path):
        return load_card(path)
    return load_study(path, scale)


def with_card_warnings(translation: Translation, study: Study, to: str) -> Translation:
    """Add a warning if a bridge has corrected the values for another code, or a card lacks sections."""
    warnings = list(translation.warnings)
    if study.solver.corrected_for not in (None, to):
        engine = study.solver.corrected_for
        warnings.append(f"the card was corrected for {engine} by a bridge: its values hold there alone")
    if is_card(study.file) and (missing := [SAID[name] for name in SAID if name not in study.document]):
        warnings.append(f"the card lacks its {enumeration(missing)}: defaults are taken, perhaps not its own")
    return replace(translation, warnings=tuple(warnings))


def exported_test(
    study: Study, values: Mapping[str, float], seed: int, scene: str = TARGET_SCENE
) -> ExportedTest:
    """Build one case of a study for export; a factor without a value is at its middle.

    Raises
    ------
    StudyError
        When there is no such factor or scene, or a value leaves what is physical.
    """
    settings = {
        factor.name: f"{values.get(factor.name, factor.center):.6g} {factor.unit}".rstrip()
        for factor in study.factors
    }
    measurement, at = study.measurement, f", scale {study.scale}" if study.scale else ""
    return ExportedTest(
        name=study.name,
        case=study.case(values, seed, scene),
        source=f"{study.file.name}{at}",
        settings=settings,
        estimator=f"{measurement.fit!r} fit, mean of {measurement.azimuths} views",
    )
