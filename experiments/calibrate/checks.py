"""Settings against the study's factors: what is wrong is said before anything is simulated."""

from __future__ import annotations

from collections.abc import Mapping

from experiments.calibrate.values import UNLIMITED, reach_limits
from experiments.io.errors import InputError, StudyError
from experiments.studyfile import Study


def check_calibration(study: Study) -> None:
    """Check that a study can be calibrated: it has factors, and the campaign's decisions fit them.

    Raises
    ------
    InputError
        When it has none, or one does not fit.
    """
    if not study.factors:
        raise StudyError(str(study.file), "a calibration needs at least one [[factor]]", "none")
    try:
        check_study(study)
    except InputError:
        raise
    except ValueError as error:
        raise StudyError(str(study.file), "the decisions must fit the factors", str(error)) from error


def check_study(study: Study) -> None:
    """Check the campaign's decisions against the factors.

    Raises
    ------
    ValueError
        With the rule, the value received and its key, when a setting names no factor, a fixed value leaves
        its limits, a step or half-range is not positive, or the screening design is too small.
    """
    settings, hard = study.campaign, {f.name: study.limits.get(f.name, UNLIMITED) for f in study.factors}
    for name in settings.selection.keep or ():
        _check_name(name, hard, "campaign.selection.keep")
    _check_values(settings.climb.start, reach_limits(study), "campaign.climb.start")
    _check_values(settings.surface.center, hard, "campaign.surface.center")
    _check_values(settings.optimum.point, hard, "campaign.optimum.point")
    positive = dict.fromkeys(hard, (0.0, float("inf")))
    steps = {"climb.step": settings.climb.step, "surface.half_range": settings.surface.half_range}
    for place, sizes in steps.items():
        _check_values(sizes, positive, f"campaign.{place}")
        for name, size in (sizes or {}).items():
            if not size > 0.0:
                raise ValueError(f"campaign.{place}.{name}: must be positive, got {size:g}")
    if study.target.twin is not None:
        _check_values(study.target.twin.truth, hard, "target.twin.truth")
    leading = study.target.leading
    if settings.verification.margin is not None and leading.unit != "deg":
        rule = f"is an angle, but {leading.name} leads: state margin_sds instead"
        raise ValueError(f"campaign.verification.margin: {rule}, got {settings.verification.margin:g}")
    # the designs load the libraries of statistics: what can be said without them is said before
    from experiments.calibrate.screening_stage import screening_design

    screening_design(study.factors, settings.screening)


def _check_name(name: str, known: Mapping[str, object], place: str) -> None:
    if name not in known:
        raise ValueError(f"{place}: must name a factor, one of {', '.join(known)}, got {name!r}")


def _check_values(
    values: Mapping[str, float] | None, limits: Mapping[str, tuple[float, float]], place: str
) -> None:
    for name, value in (values or {}).items():
        _check_name(name, limits, place)
        low, high = limits[name]
        if not low <= value <= high:
            raise ValueError(f"{place}.{name}: must lie within {low:g} and {high:g}, got {value:g}")
