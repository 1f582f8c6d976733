"""``[[candidate]]``: a test that could be done, with its errors and its laboratory time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, PlainValidator

from experiments.grains.bench_readings import METHODS
from experiments.io.errors import StudyError
from experiments.io.texts import nearest_name
from experiments.io.toml_files import read_toml
from experiments.io.units import Quantity
from experiments.studyfile.campaign import MOST, Response
from experiments.studyfile.factor_section import FactorSection
from experiments.studyfile.observables import DIMENSIONS, instrument_of, observables_of
from experiments.studyfile.places import Places
from experiments.studyfile.scene_sections import SceneSection
from experiments.studyfile.schema import Section, first_problem
from experiments.studyfile.setters import revised

SHARE = "%"
"""Unit of an error that is a share of the value."""


@dataclass(frozen=True)
class Error:
    """A standard deviation: a number in the response's unit, or a share of the value."""

    size: float
    is_share: bool = True

    def at(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the standard deviation at values, in the response's unit."""
        return self.size * (np.abs(values) if self.is_share else np.ones_like(values))


@dataclass(frozen=True)
class Candidate:
    """A test that could be done: one of a scene, or a direct reading of a factor; the other is empty."""

    name: str
    scene: str
    factor: str
    readings: tuple[Reading, ...]
    repeats: tuple[int, ...]
    minutes: tuple[float, float]
    """Laboratory time before the first repeat and of each [min]."""
    sizes: tuple[tuple[str, SceneSection], ...] = ()
    """Further sizes of the test, in words and as scenes."""
    assumed: tuple[str, ...] = ()
    """Values that the study does not state, with their sources."""


@dataclass(frozen=True)
class Reading:
    """One number that a candidate yields: scatter of a repeat, error of all repeats, error of the model."""

    response: Response
    sd: Error
    common: Error
    model_sd: Error


def read_errors(value: object) -> dict[str, Quantity]:
    """Read an error, or errors by observable; alone it has the name ``""``. ValueError where one is none."""
    named = value if isinstance(value, Mapping) else {"": value}
    errors = {str(name): Quantity.parse(each) for name, each in named.items()}
    if not errors or min(error.number for error in errors.values()) < 0.0:
        raise ValueError("must not be negative or empty")
    return errors


Errors = Annotated[dict[str, Quantity], PlainValidator(read_errors)]
"""Errors by observable, as written."""
Minutes = Annotated[float, Field(ge=0.0)]


class CandidateSection(Section):
    """``[[candidate]]``: a test that could be done; ``dem-warp plan`` chooses among them."""

    test: str
    """``"target"`` for the study's own scene, the name of a ``[response-scene.NAME]``, or a method of
    ``[[direct]]``, as incline."""
    parameter: str = ""
    """Factor, or its place, that a direct reading is of."""
    observables: tuple[str, ...] = Field(default=(), max_length=20)
    """Observables of the scene that would be measured."""
    repeats: tuple[Annotated[int, Field(ge=1, le=MOST)], ...] = Field((3, 5, 10), min_length=1, max_length=6)
    """Numbers of repeats to choose from."""
    minutes: tuple[Minutes, Minutes] | None = None
    """Laboratory time before the first repeat, and of each. Default: by the kind of test, assumed."""
    sd: Errors | None = None
    """Standard deviation of one repeat at the size of the scene, or a table by observable; ``"3 %"`` is a
    share of the value. Default: by the instrument, assumed."""
    common: Errors | None = None
    """Error that all repeats share. Default: by the instrument, assumed."""
    model_sd: Errors | None = None
    """Error of the model, larger than zero. Default: 2 % of the value, of a direct reading 5 %, assumed."""
    sizes: tuple[dict[str, Any], ...] = Field(default=(), max_length=6)
    """Further sizes of the scene: tables of the keys that differ, as ``[{ grain_count = 4000 }]``."""


def build_candidates(
    sections: Sequence[CandidateSection],
    factors: Sequence[FactorSection],
    scenes: Mapping[str, SceneSection],
    places: Places,
) -> tuple[Candidate, ...]:
    """Build the candidates of a study; StudyError where one has no test, number, unit or size that exists."""
    built: dict[str, Candidate] = {}
    for index, section in enumerate(sections):
        try:
            found = (
                _of_scene(section, scenes) if section.test in scenes else _of_factor(section, factors, scenes)
            )
            if found.name in built:
                raise ValueError(f"{found.name} is given twice; use repeats and sizes")
        except ValueError as error:
            raise StudyError(places.of(("candidate", index)), first_problem(error)) from None
        built[found.name] = found
    return tuple(built.values())


def _of_scene(section: CandidateSection, scenes: Mapping[str, SceneSection]) -> Candidate:
    test, scene, defaults = section.test, scenes[section.test], _defaults()["instrument"]
    known = observables_of(scene.observables, scene.leaves_a_heap)
    if section.parameter:
        raise ValueError("parameter belongs to a direct reading, not to a scene")
    readings, assumed = [], list[str]()
    for name in section.observables or ("",):
        if name not in known:
            raise ValueError(f"observables {scene.unknown(name, known)}")
        unit, instrument = known[name].unit, instrument_of(known[name])
        own = defaults.get(f"{instrument}-{unit}", defaults[instrument])
        response = Response(f"{test}_{name}", name, unit, test)
        to_number = partial(Quantity.to_base, dimension=DIMENSIONS[unit])
        readings.append(_reading(section, response, to_number, own, assumed))
    [(kind, _)] = scene.given.items()
    words = [", ".join(f"{key} {value}" for key, value in change.items()) for change in section.sizes]
    sized = [revised(scene, {kind: change}) for change in section.sizes]
    minutes = _minutes(section, kind, assumed)
    sizes = tuple(zip(words, sized, strict=True))
    return Candidate(test, test, "", tuple(readings), section.repeats, minutes, sizes, tuple(assumed))


def _of_factor(
    section: CandidateSection, factors: Sequence[FactorSection], scenes: Mapping[str, SceneSection]
) -> Candidate:
    test, parameter = section.test, section.parameter
    if test not in METHODS:
        near = nearest_name(test, [*scenes, *METHODS])
        raise ValueError(f"test must be a scene or a method, not {test}; {near}")
    if section.observables or section.sizes:
        raise ValueError(f"observables and sizes belong to a scene, not to {test}")
    known = {place: factor for factor in factors for place in (factor.name, *factor.parameter)}
    if parameter not in known:
        raise ValueError(f"parameter must be a factor or its place, {nearest_name(parameter, list(known))}")
    factor, wanted = known[parameter], METHODS[test][0].parameter
    if wanted and {path[-1] for path in factor.paths} != {wanted}:
        raise ValueError(f"{test} measures a {wanted}, not {parameter}")
    response = Response(f"{factor.name}_{test}".replace("-", "_"), factor.name, factor.unit or "1", "")
    assumed: list[str] = []
    reading = _reading(section, response, factor.natural, _defaults()["instrument"][test], assumed)
    name, minutes = f"{test} of {factor.name}", _minutes(section, "direct", assumed)
    return Candidate(name, "", factor.name, (reading,), section.repeats, minutes, (), tuple(assumed))


def _reading(
    section: CandidateSection,
    response: Response,
    to_number: Callable[[Quantity], float],
    own: Mapping[str, str],
    assumed: list[str],
) -> Reading:
    """Build a reading; what is assumed is added to the list."""
    model, errors = _defaults()["model"]["scene" if response.scene else "direct"], []
    said: dict[str, list[str]] = {}
    for key, defaults in {"sd": own, "common": own, "model_sd": model}.items():
        given: Mapping[str, Quantity] = getattr(section, key) or {}
        if not set(given) <= {"", *section.observables}:
            raise ValueError(f"{key} must name observables of the candidate, got {', '.join(given)}")
        error = given.get(response.observable, given.get(""))
        if error is None:
            error = Quantity.parse(defaults[key])
            said.setdefault(defaults["source"], []).append(f"{key} {defaults[key]}")
        share = error.unit == SHARE
        try:
            errors.append(Error(error.number / 100.0 if share else to_number(error), share))
        except ValueError as problem:
            raise ValueError(f"{key} {problem}, got {error}") from None
        if key != "common" and not errors[-1].size > 0.0:
            raise ValueError(f"{key} must be positive")
    assumed += [f"{response.name}: {', '.join(errors)} ({source})" for source, errors in said.items()]
    return Reading(response, *errors)


def _minutes(section: CandidateSection, kind: str, assumed: list[str]) -> tuple[float, float]:
    if section.minutes is None:
        known = _defaults()["minutes"]
        setup, each = known.get(kind, known["other"])
        assumed.append(f"{section.test}: minutes {setup}, and {each} each ({known['source']})")
        return float(setup), float(each)
    return section.minutes


@cache
def _defaults() -> dict[str, Any]:
    """Read the assumed errors and times."""
    return read_toml(Path(__file__).with_name("candidate_defaults.toml"))[1]
