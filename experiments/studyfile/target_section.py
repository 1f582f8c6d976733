"""``[target]`` and ``[[response]]`` sections: what the heaps, and the cases of further scenes, must match."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal

from pydantic import Field, model_validator

from doe import Sample
from experiments.io.errors import StudyError
from experiments.io.texts import nearest_name
from experiments.io.units import Quantity
from experiments.studyfile.campaign import MOST, TARGET_SCENE, FactorValues, Response, Target, Twin
from experiments.studyfile.observables import ANGLE, DIMENSIONS, PROFILES, Observable, observables_of
from experiments.studyfile.places import KeyPath, Places
from experiments.studyfile.scene_sections import SceneSection
from experiments.studyfile.schema import Angle, RawQuantity, Section
from imaging import View

MEASUREMENTS = ("mean", "sd", "n")
"""Keys about the physical test."""

SOURCES = ("pictures", "file", "profiles")
"""Keys of ``[target]`` that name where the measurements are taken from."""

PICTURE_OPTIONS = ("by", "keep_doubtful", "types", "view")
"""Keys of ``[target]`` that belong to its pictures."""

Grouping = Literal["picture", "folder"]
"""Pictures of one heap."""


class ViewSection(Section):
    """``[target.view]``: known facts of the photographs."""

    crop: tuple[int, int, int, int] | None = None
    """Left, top, right and bottom of the part to look at, in pixels."""
    plate: tuple[float, float, float, float] | None = None
    """Two points x1, y1, x2, y2 on the line where the heap meets its plate, in pixels."""
    heap: int | None = None
    """Number of the heap, counted from the left from 1, where there are several."""
    elevation: Angle | None = None
    """Angle at which the camera looks down on the plate; default: measured at the heap's foot."""
    distance: float | None = None
    """Distance of the camera from the heap, in widths of the heap; default: from the focal length."""

    circle: tuple[float, float, float] | None = None
    """Column, row and radius of a drum's inner edge, in pixels; default: found."""

    @property
    def view(self) -> View:
        return View(self.crop, self.plate, self.heap, self.elevation, self.distance, circle=self.circle)

    @model_validator(mode="after")
    def _is_possible(self) -> ViewSection:
        _ = self.view
        return self


class TwinSection(Section):
    """``[target.twin]``: the target is simulated with settings that the campaign does not see."""

    truth: FactorValues = Field(min_length=1)
    """Hidden factor values; the factors not named are at their middle."""
    replicates: int = Field(default=5, ge=2, le=MOST)
    """Cases of the target in every scene."""


class ResponseSection(Section):
    """``[[response]]``: a number to be matched, with the ``[target]`` or instead of it."""

    observable: str
    """Observable of the scene, e.g. ``"solid_fraction"``; ``"angle"`` of a scene that leaves a heap; with
    profiles ``"surface"`` of a drum, ``"outline"`` of a heap."""
    weights: dict[str, float] | None = Field(default=None, min_length=1)
    """Observables of one unit that the response is the weighted sum of; observable is then its name."""
    profiles: str | None = None
    """File of measured profiles, instead of numbers: their heights, with the covariance, are matched."""
    part_of: str = ""
    """Profile that it is a height or a direction of; written by the program."""
    measurements: tuple[float, ...] = ()
    """Single measurements of a direction of a profile, in SI; written by the program."""
    name: str | None = Field(default=None, pattern=r"^[A-Za-z_]\w*$")
    """Name in tables. Default: as the observable."""
    scene: str = TARGET_SCENE
    """Name of the ``[response-scene.NAME]`` or ``[condition.NAME]`` that measures it. Default: the study's
    own scene."""
    mean: RawQuantity | None = None
    """Mean of the measurements."""
    sd: RawQuantity | None = None
    """Standard deviation of one measurement."""
    n: int | None = Field(default=None, ge=2)
    """Number of measurements."""

    @property
    def title(self) -> str:
        return self.name or self.observable

    @property
    def table(self) -> dict[str, Any]:
        """Section as a study file writes it."""
        given = {
            name: getattr(self, name) for name in type(self).model_fields if name in self.model_fields_set
        }
        return {
            name: value.written if isinstance(value, Quantity) else value for name, value in given.items()
        }

    def response(self, unit: str, measured: bool, path: KeyPath, places: Places) -> Response:
        """Build the response of the campaign in its observable's unit; a twin is not ``measured``."""
        values = {name: self._value(name, unit, path, places) for name in ("mean", "sd")}
        sample = None
        if measured:
            if missing := [name for name in MEASUREMENTS if getattr(self, name) is None]:
                rule = f"needs mean, sd and n of what was measured; missing: {', '.join(missing)}"
                raise StudyError(places.of(path), rule, self.title)
            sample = Sample(values["mean"], values["sd"], int(self.n or 0))
        weights = tuple((self.weights or {}).items())
        return Response(
            self.title,
            self.observable,
            unit,
            self.scene,
            sample,
            weights=weights,
            part_of=self.part_of,
            measurements=self.measurements,
        )

    def _value(self, name: str, unit: str, path: KeyPath, places: Places) -> float:
        """Convert a measurement; NaN where it is missing."""
        quantity = getattr(self, name)
        if quantity is None:
            return float("nan")
        place = places.of((*path, name))
        try:
            value = quantity.to_base(DIMENSIONS[unit])
        except ValueError as error:
            raise StudyError(place, str(error), str(quantity)) from None
        if name == "sd" and not value > 0.0:
            raise StudyError(place, "must be positive", str(quantity))
        if name == "mean" and unit == "deg" and not 0.0 < value < 90.0:
            raise StudyError(place, "must be an angle between 0 and 90 deg", str(quantity))
        return float(value)


class TargetSection(ResponseSection):
    """``[target]``: the first number to be matched, the repose angle where nothing else is named.

    With a twin, the measured values are for reading only.
    """

    observable: str = ANGLE
    """Observable of the scene."""
    fit: str | None = None
    """Part of the flank that the measured angles were fitted to. Default: as ``[measurement]`` says."""
    pictures: str | None = None
    """Photographs of the heaps, instead of numbers: a folder, or a pattern as ``"photos/*.jpg"``. Of a
    rotating drum they give the observable ``"dynamic_angle"`` or the profile ``"surface"``."""
    by: Grouping = "picture"
    """Pictures of one heap: each picture is another heap, or each folder is one heap."""
    keep_doubtful: bool = False
    """True: doubtful pictures count."""
    types: tuple[int | str, ...] = ()
    """Types of the spheres that are grain, in files of spheres instead of photographs. Default: all."""
    view: ViewSection | None = None
    """Known facts of the photographs."""
    file: str | None = None
    """File of measured heaps, instead of numbers: all that it holds is to be matched, the observable first
    that is named here."""
    note: str = ""
    """Source of the measurements, in words."""
    twin: TwinSection | None = None
    """The target comes from cases simulated with settings that the campaign does not see."""

    def lacks_a_heap(self, scenes: Mapping[str, SceneSection]) -> bool:
        """Return whether it is by default the angle of a heap, and its test leaves no heap."""
        scene = scenes.get(self.scene)
        return "observable" not in self.model_fields_set and scene is not None and not scene.leaves_a_heap


def build_target(
    target: TargetSection | None,
    responses: Sequence[ResponseSection],
    scenes: Mapping[str, SceneSection],
    held_out: Collection[str],
    places: Places,
) -> Target | None:
    """Build the responses that a campaign must match, in scenes some of which are held out of any fit.

    None where nothing is to be matched, its measurements have not been taken yet, or it is the angle of a
    heap that the test does not leave: such a study simulates, and cannot be calibrated. Raise StudyError when
    two have one name, there is no such scene or observable, or a measurement is wrong.
    """
    if target and target.lacks_a_heap(scenes):
        return None
    sections: list[tuple[KeyPath, ResponseSection]] = [(("target",), target)] if target else []
    sections += [(("response", index), section) for index, section in enumerate(responses)]
    twin = target.twin if target else None
    waiting = _source(target, places) if target else None
    built: list[Response] = []
    for path, section in sections:
        _check_name(section, built, path, places)
        if section.profiles is not None or section.observable in PROFILES:
            waiting = waiting or "profiles"
            continue
        unit = _observable(section, scenes, path, places).unit
        measured = twin is None and not (waiting and section is target)
        response = section.response(unit, measured, path, places)
        built.append(replace(response, held_out=section.scene in held_out))
    if waiting or not built:
        return None
    if built[0].held_out:
        rule = "leads the climb, so it must not be measured under a held-out condition"
        raise StudyError(places.of((*sections[0][0], "scene")), rule, built[0].scene)
    return Target(tuple(built), Twin(twin.truth, twin.replicates) if twin else None)


def _source(target: TargetSection, places: Places) -> str | None:
    """Key that names where the measurements are to be taken from; None where the section gives them."""
    given = [name for name in SOURCES if getattr(target, name) is not None]
    options = [name for name in PICTURE_OPTIONS if name in target.model_fields_set]
    if options and target.pictures is None:
        raise StudyError(places.of(("target", options[0])), "is an option of pictures, which are missing")
    numbers = [name for name in MEASUREMENTS if getattr(target, name) is not None]
    if target.twin is not None:
        return None
    if given and (others := [*given[1:], *numbers]):
        rule = "must be pictures, a file, or mean, sd and n, and only one of these"
        raise StudyError(places.of(("target", given[0])), rule, f"{given[0]} and {', '.join(others)}")
    return given[0] if given else None


def _check_name(section: ResponseSection, others: Sequence[Response], path: KeyPath, places: Places) -> None:
    names = [other.name for other in others]
    if section.title in names:
        problem = "must have a name that no other response has"
        raise StudyError(places.of(path), problem, section.title, "Set name.")
    if (section.scene, section.observable) in [(other.scene, other.observable) for other in others]:
        rule = "another response matches this observable of the scene"
        raise StudyError(places.of((*path, "observable")), rule, section.observable)


def _observable(
    section: ResponseSection, scenes: Mapping[str, SceneSection], path: KeyPath, places: Places
) -> Observable:
    if section.scene not in scenes:
        known_scenes = nearest_name(section.scene, list(scenes))
        rule = f"must name a [response-scene.NAME] or a [condition.NAME], {known_scenes}"
        raise StudyError(places.of((*path, "scene")), rule, section.scene)
    scene = scenes[section.scene]
    known = observables_of(scene.observables, scene.leaves_a_heap)
    if section.weights is not None:
        return _combined(section.weights, known, path, places)
    if section.observable not in known:
        rule = scene.unknown(section.observable, known)
        raise StudyError(places.of((*path, "observable")), rule, section.observable)
    return known[section.observable]


def _combined(
    weights: Mapping[str, float], known: Mapping[str, Observable], path: KeyPath, places: Places
) -> Observable:
    """Find an observable that has the unit of all that are combined."""
    place = places.of((*path, "weights"))
    for name in weights:
        if name not in known:
            raise StudyError(
                place, f"must name what the scene measures, {nearest_name(name, list(known))}", name
            )
    found = [known[name] for name in weights]
    if len({each.unit for each in found}) > 1:
        units = ", ".join(f"{each.name} [{each.unit}]" for each in found)
        raise StudyError(place, "must name observables of one unit", units)
    return found[0]
