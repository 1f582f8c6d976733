"""Observables of a study that a mirror turns over."""

from __future__ import annotations

from experiments.studyfile import Study


def odd_observables(study: Study) -> tuple[str, ...]:
    """Name the observables that count along x, where nothing in a study tells right from left.

    A tilt of the plate does, wherever the study has one: under a condition, or as a factor.
    """
    ends = [{}, *({factor.name: end} for factor in study.factors for end in (factor.low, factor.high))]
    under = [study.under(condition.name) for condition in study.conditions]
    cases = [each.case(_open(each, settings), seed=0) for each in under for settings in ends]
    if any(getattr(case.scene, "tilt", 0.0) for case in cases):
        return ()
    return tuple(each.name for each in study.measurable if each.directed)


def _open(study: Study, settings: dict[str, float]) -> dict[str, float]:
    """Keep the settings of factors that a condition leaves open."""
    names = {factor.name for factor in study.factors}
    return {name: value for name, value in settings.items() if name in names}
