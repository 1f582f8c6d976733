"""Checks of the campaign's settings against the study's factors, before anything is simulated."""

from __future__ import annotations

from collections.abc import Mapping

from experiments.calibrate.values import UNLIMITED, reach_limits
from experiments.io.errors import StudyError
from experiments.studyfile import Study
from experiments.studyfile.campaign import scenes_of

Limits = Mapping[str, tuple[float, float]]


def check_calibration(study: Study) -> None:
    """Check that a study has factors and a target, and that the campaign's settings fit the factors.

    Raise StudyError when a setting names no factor, a fixed value leaves its limits, a step or half-range is
    not positive, the screening design is too small, or a case has too many grains.
    """
    reach = reach_limits(study)
    for scene in scenes_of(study.target.fitted):
        study.case({}, 0, scene)  # refuses too many grains, before the statistics load
    if not study.factors:
        raise StudyError(str(study.file), "needs at least one [[factor]] to be calibrated")
    settings, file = study.campaign, f"{study.file}: "
    hard: Limits = {factor.name: study.limits.get(factor.name, UNLIMITED) for factor in study.factors}
    for name in settings.selection.keep or ():
        _check_name(name, hard, f"{file}campaign.selection.keep")
    _check_values(settings.climb.start, reach, f"{file}campaign.climb.start")
    _check_values(settings.surface.center, hard, f"{file}campaign.surface.center")
    _check_values(settings.optimum.point, hard, f"{file}campaign.optimum.point")
    _check_positive(settings.climb.step, hard, f"{file}campaign.climb.step")
    _check_positive(settings.surface.half_range, hard, f"{file}campaign.surface.half_range")
    if study.target.twin is not None:
        _check_values(study.target.twin.truth, hard, f"{file}target.twin.truth")
    leading, margin = study.target.leading, settings.verification.margin
    if margin is not None and leading.unit != "deg":
        problem = f"must be omitted, as {leading.name} leads, which is not an angle"
        raise StudyError(f"{file}campaign.verification.margin", problem, margin, "Set margin_sds.")
    # imported here, as designs load the libraries of statistics
    from experiments.calibrate.screening_stage import screening_design

    try:
        screening_design(study.factors, settings.screening)
    except ValueError as error:
        raise StudyError(f"{file}campaign.screening", str(error)) from error


def _check_name(name: str, known: Limits, place: str) -> None:
    if name not in known:
        raise StudyError(place, f"must name a factor, one of {', '.join(known)}", name)


def _check_values(values: Mapping[str, float] | None, limits: Limits, place: str) -> None:
    for name, value in (values or {}).items():
        _check_name(name, limits, place)
        low, high = limits[name]
        if not low <= value <= high:
            raise StudyError(f"{place}.{name}", f"must be from {low:g} to {high:g}", f"{value:g}")


def _check_positive(values: Mapping[str, float] | None, known: Limits, place: str) -> None:
    for name, value in (values or {}).items():
        _check_name(name, known, place)
        if not value > 0.0:
            raise StudyError(f"{place}.{name}", "must be positive", f"{value:g}")
