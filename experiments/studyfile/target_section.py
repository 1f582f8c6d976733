"""``[target]`` and ``[[response]]`` sections: what the heaps, and the cases of further scenes, must match."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from pydantic import Field, model_validator

from dem_warp.scenes.scene import Observable
from experiments.errors import StudyError
from experiments.studyfile.campaign import (
    ANGLE,
    TARGET_SCENE,
    FactorValues,
    MeasuredResponse,
    MeasuredTarget,
    Response,
    TwinTarget,
)
from experiments.studyfile.places import Places
from experiments.studyfile.scene_sections import SceneSection
from experiments.studyfile.schema import Angle, RawQuantity, Section, nearest_name

MEASUREMENTS = ("mean", "sd", "n")
"""What a section tells of the physical test."""

DIMENSIONS = {"1": "", "deg": "angle", "m": "length", "s": "time", "kg": "mass", "kg/s": "mass flow"}
"""Dimension of an observable's unit, a key of ``units.UNITS``."""


class TwinSection(Section):
    """``[target.twin]``: the target is simulated with settings that the campaign does not see."""

    truth: FactorValues = Field(min_length=1)
    """Hidden factor values; the factors not named are at their middle."""
    replicates: int = Field(default=5, ge=2)
    """Cases of the target in every scene."""


class TargetSection(Section):
    """``[target]``: the repose angle to be matched; with a twin, the measured values are for reading only."""

    mean: Angle | None = Field(default=None, gt=0.0, lt=90.0)
    """Mean of the measurements."""
    sd: Angle | None = Field(default=None, gt=0.0)
    """Standard deviation of one measurement."""
    n: int | None = Field(default=None, ge=2)
    """Number of measurements."""
    twin: TwinSection | None = None
    """The target comes from cases simulated with settings that the campaign does not see."""

    @model_validator(mode="after")
    def _complete(self) -> TargetSection:
        missing = [name for name in MEASUREMENTS if getattr(self, name) is None]
        if self.twin is None and missing:
            raise ValueError(f"needs mean, sd and n of the measured angle; missing: {', '.join(missing)}")
        return self

    def target(self, responses: Sequence[Response]) -> MeasuredTarget | TwinTarget:
        """Build the target of the campaign."""
        if self.twin is not None:
            return TwinTarget(**dict(self.twin), responses=tuple(responses))
        measured = {name: getattr(self, name) for name in MEASUREMENTS}
        return MeasuredTarget.model_validate({**measured, "responses": responses})


class ResponseSection(Section):
    """``[[response]]``: one more number to be matched, beside the angle."""

    observable: str
    """What is measured: an observable of the scene, or ``"angle"`` of a further scene that leaves a heap."""
    name: str | None = Field(default=None, pattern=r"^[A-Za-z_]\w*$")
    """What it is called; left out: as the observable."""
    scene: str = TARGET_SCENE
    """Name of the ``[response-scene.NAME]`` that measures it; left out: the study's own scene."""
    mean: RawQuantity | None = None
    """Mean of the measurements."""
    sd: RawQuantity | None = None
    """Standard deviation of one measurement."""
    n: int | None = Field(default=None, ge=2)
    """Number of measurements."""

    @property
    def title(self) -> str:
        """Its name."""
        return self.name or self.observable

    def response(self, observable: Observable, measured: bool) -> Response:
        """Build the response of the campaign.

        Parameters
        ----------
        observable
            What the scene says of it.
        measured
            Whether it comes with its measurements; a twin study simulates them.

        Raises
        ------
        ValueError
            When a measurement is missing, or is no quantity of the observable's dimension.
        """
        facts = {
            "name": self.title,
            "observable": self.observable,
            "unit": observable.unit,
            "scene": self.scene,
        }
        dimension = DIMENSIONS[observable.unit]
        given = {name: getattr(self, name) for name in MEASUREMENTS}
        values = {
            name: value.to_base(dimension)
            for name, value in given.items()
            if name != "n" and value is not None
        }
        if "sd" in values and not values["sd"] > 0.0:
            raise ValueError(f"sd must be positive, not {self.sd}")
        if not measured:
            return Response.model_validate(facts)
        if missing := [name for name, value in given.items() if value is None]:
            raise ValueError(f"needs mean, sd and n of what was measured; missing: {', '.join(missing)}")
        return MeasuredResponse.model_validate(facts | values | {"n": self.n})


def build_responses(
    sections: Sequence[ResponseSection],
    scenes: Mapping[str, SceneSection],
    measured: bool,
    places: Places,
) -> tuple[Response, ...]:
    """Build the responses beside the angle.

    Parameters
    ----------
    sections
        As written, in order.
    scenes
        Scenes by name, the study's own as ``TARGET_SCENE``.
    measured
        Whether they come with their measurements; a twin study simulates them.
    places
        Where they stand.

    Raises
    ------
    StudyError
        When two have one name, there is no such scene or observable, or a measurement is wrong.
    """
    responses: list[Response] = []
    taken = {ANGLE}
    for index, section in enumerate(sections):
        path = ("response", index)
        if section.title in taken:
            rule = f"each response has a name of its own, other than {ANGLE!r}; set name"
            raise StudyError(rule, section.title, places.of(path))
        if section.scene not in scenes:
            rule = f"must name a [response-scene.NAME], {nearest_name(section.scene, list(scenes))}"
            raise StudyError(rule, section.scene, places.of((*path, "scene")))
        known = scenes[section.scene].measures
        if section.observable not in known:
            rule = f"must be what the scene measures, {nearest_name(section.observable, list(known))}"
            raise StudyError(rule, section.observable, places.of((*path, "observable")))
        if (section.scene, section.observable) == (TARGET_SCENE, ANGLE):
            rule = "the angle of the study's own scene is the [target], not a further response"
            raise StudyError(rule, section.observable, places.of((*path, "observable")))
        try:
            responses.append(section.response(known[section.observable], measured))
        except ValueError as error:
            raise StudyError(str(error), section.title, places.of(path)) from None
        taken.add(section.title)
    return tuple(responses)
