"""Responses from measured profiles, with the covariance of their repeats."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from doe import ProfileSample, scatter_of_views
from doe.curves.profile_sample import LEAST_PROFILES
from doe.errors import RuleError
from experiments.io.errors import InputError
from experiments.io.units import Quantity
from experiments.measurement.profile_files import Profiles, read_profiles
from experiments.measurement.value_limits import limits_of_test
from experiments.studyfile import Study
from experiments.studyfile.campaign import TARGET_SCENE
from experiments.studyfile.observables import (
    CURVE_PROFILE,
    FORCE_PROFILE,
    OUTLINE_PROFILE,
    PROFILES,
    SHEAR_PROFILE,
)
from experiments.studyfile.target_section import ResponseSection, TargetSection

OWN = ("note", "twin")
"""Keys of ``[target]`` that ``[[response]]`` lacks."""


def with_profiles(study: Study, pictured: Profiles | None = None) -> Study:
    """Replace profiles by responses: independent directions of measured ones, or a twin's heights.

    `pictured` has those of the pictures that the target names. A campaign combines them to one profile again
    (`experiments.calibrate.directions`).
    """
    target, file = study.target_section, study.file
    sections = {f"{file}: response[{n}]": each for n, each in enumerate(study.response_sections, 1)}
    sections = ({f"{file}: target": target} if target else {}) | sections
    named = {section.observable for section in sections.values()} & set(PROFILES)
    if not named and all(section.profiles is None for section in sections.values()):
        return study
    first, *others = [
        made for place, section in sections.items() for made in _made(study, section, place, pictured)
    ]
    own = {key: getattr(target, key) for key in OWN if target and key in target.model_fields_set}
    given = {
        key: getattr(first, key) for key in ResponseSection.model_fields if key in first.model_fields_set
    }
    outline = study.measurement.model_copy(update={"outline": True}) if OUTLINE_PROFILE in named else None
    return study.with_responses(TargetSection(**given, **own), others, outline)


def counted_twice(study: Study) -> tuple[str, ...]:
    """Name slopes of a test with profiles: a slope that was read from these would count twice."""
    sections = [study.target_section, *study.response_sections]
    given = [section for section in sections if section is not None]
    shown = {section.scene for section in given if section.part_of}
    return tuple(
        f"{section.title} counts twice if it was read from the profiles of the same test"
        for section in given
        if section.scene in shown and not section.part_of and section.observable.endswith("angle")
    )


def _made(
    study: Study, section: ResponseSection, place: str, pictured: Profiles | None
) -> list[ResponseSection]:
    """Return the responses of a section: itself, or those of its profiles."""
    profile, twin = section.observable, study.target_section is not None and study.target_section.twin
    if profile not in PROFILES:
        if section.profiles is None:
            return [section]
        known = " or ".join(f'"{name}"' for name in PROFILES)
        raise InputError(place, f"profiles need the observable {known}", profile)
    shown = isinstance(section, TargetSection) and pictured is not None
    if section.profiles is None and not twin and not shown:
        raise InputError(place, f'"{profile}" needs profiles, a file of them, or a twin')
    name = section.scene
    shared: dict[str, Any] = {"scene": name} if "scene" in section.model_fields_set else {}
    shared["part_of"] = f"{profile}_{name}".replace("-", "_") if name != TARGET_SCENE else profile
    scene = study.case({}, 0, name).scene
    size = limits_of_test(study, name)
    if profile != size.profile:
        problem = (
            'must be the "surface" of a drum, the "outline" of a heap, the "stress_strain" of a compression, '
            'the "shear_points" of a shear test or the "force_depth" of a penetration'
        )
        raise InputError(place, problem, f"{profile} of {scene.name}")
    if twin:
        return [ResponseSection(**shared, observable=height) for height in PROFILES[profile]]
    path = study.file.parent / str(section.profiles)
    if shown and pictured:
        path, found = Path(f"{place}.pictures"), pictured
    else:
        found = read_profiles(path, study.measurement.fit, size)
    if len(found.names) < LEAST_PROFILES:
        problem = f"needs profiles of {LEAST_PROFILES} or more replicates"
        raise InputError(f"{path}: replicate", problem, f"{len(found.names)}: {', '.join(found.names)}")
    try:
        sample = ProfileSample.of(found.heights, scatter_of_views(found.views))
    except RuleError as error:
        raise InputError(str(path), f"profiles {error.problem}", error.value) from None
    modes = _modes(sample, found, profile, shared["part_of"])
    return [ResponseSection(**shared, **mode) for mode in modes]


def _modes(sample: ProfileSample, found: Profiles, profile: str, title: str) -> list[dict[str, Any]]:
    """Return the values of the sections of the independent directions of profiles."""
    names = [PROFILES[profile][station] for station in found.stations]
    unit = {CURVE_PROFILE: "", SHEAR_PROFILE: "Pa", FORCE_PROFILE: "N"}.get(profile, "m")
    return [
        {
            "observable": f"{title}_mode_{number}",
            "weights": dict(zip(names, map(float, mode.weights), strict=True)),
            "mean": Quantity(mode.target.mean, unit),
            "sd": Quantity(mode.target.sd, unit),
            "n": mode.target.n,
            "measurements": tuple((found.heights @ mode.weights).tolist()),
        }
        for number, mode in enumerate(sample.modes, 1)
    ]
