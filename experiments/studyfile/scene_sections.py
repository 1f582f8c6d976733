"""``[scene.NAME]``: the physical test, one of several, each a table of its own."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping
from typing import Self

from pydantic import Field, model_validator

from dem_warp import DrawDown, Drum, Hopper, LiftedCylinder, Material
from dem_warp.scenes.poured_scene import PouredScene
from dem_warp.scenes.scene import Observable
from experiments.studyfile.schema import Angle, Frequency, Length, Number, Rate, Section, Speed, Time

_ANY_WALL = Material(density=7800.0, shear_modulus=70e9, poisson_ratio=0.3)
"""To try a scene with: none of its rules is about the material of its walls."""


class PouredSection(Section):
    """A test that begins with a rain of grains into a container."""

    rain_rate: Rate = Field(default=3000.0, gt=0.0)
    """Grains per second while filling."""
    rain_speed: Speed = Field(default=0.5, gt=0.0)
    """Speed of the raining grains."""
    grain_count: int | None = Field(default=None, ge=1)
    """Grains; left out: until the container is full."""
    rest_speed: Speed = Field(default=1.0e-3, gt=0.0)
    """The grains rest when they have been slower than this ..."""
    rest_time: Time = Field(default=0.05, gt=0.0)
    """... for this long."""
    air_drag: Rate = Field(default=0.0, ge=0.0)
    """Part of its velocity that still air takes from a free grain in a second."""

    @model_validator(mode="after")
    def _can_be(self) -> Self:
        self.scene(_ANY_WALL)
        return self

    @abstractmethod
    def scene(self, wall: Material) -> PouredScene:
        """Build the engine's scene, its walls of a material.

        Raises
        ------
        ValueError
            When it breaks a rule of the engine.
        """


class LiftedCylinderSection(PouredSection):
    """``[scene.lifted-cylinder]``: a tube full of grains is lifted off a plate."""

    diameter: Length = Field(gt=0.0)
    """Inner diameter of the tube."""
    height: Length = Field(gt=0.0)
    """Height of the tube."""
    lift_speed: Speed = Field(default=0.05, gt=0.0)
    """Speed of the tube."""
    duration: Time | None = Field(default=None, gt=0.0)
    """Ends the test after this simulated time, instead of at rest."""
    plate_diameter: Length | None = Field(default=None, gt=0.0)
    """Of a round plate, over whose rim grains fall and are lost; left out: the plate has no end."""
    tilt: Angle = Field(default=0.0, ge=0.0, lt=90.0)
    """Of plate and tube together, from the beginning on."""
    plate_friction: Number | None = Field(default=None, ge=0.0)
    """Static friction on a plate of known roughness; left out: the plate is as the tube."""
    plate_friction_excess: Number = Field(default=0.0, ge=0.0)
    """Static friction that the plate has beyond the tube's; nothing on a plate of known friction."""
    vibration_amplitude: Length = Field(default=0.0, ge=0.0)
    """Of the plate, along the axis of the tube, while the drive of the tube runs."""
    vibration_frequency: Frequency = Field(default=50.0, gt=0.0)
    """Of the plate."""
    vibration_hold: Time = Field(default=0.5, ge=0.0)
    """The drive runs from the start of the lift until this long after the tube has risen by its height."""

    def scene(self, wall: Material) -> LiftedCylinder:
        """Build the engine's scene."""
        settings = dict(self) | {"tilt": math.radians(self.tilt)}
        return LiftedCylinder(wall_material=wall, **settings)


class HopperSection(PouredSection):
    """``[scene.hopper]``: a round bin runs out through a hole in its flat floor."""

    diameter: Length = Field(gt=0.0)
    """Inner diameter of the bin."""
    fill_depth: Length = Field(gt=0.0)
    """Height that it is filled to."""
    outlet: Length = Field(gt=0.0)
    """Diameter of the hole."""

    def scene(self, wall: Material) -> Hopper:
        """Build the engine's scene."""
        return Hopper(wall_material=wall, **dict(self))


class DrumSection(PouredSection):
    """``[scene.drum]``: a part-filled drum turns about its horizontal axis."""

    diameter: Length = Field(gt=0.0)
    """Inner diameter of the drum."""
    length: Length = Field(gt=0.0)
    """Inner length of the drum."""
    rotation_rate: Rate = Field(gt=0.0)
    """Revolutions, as ``"20 1/min"``."""
    filling: Number = Field(default=0.35, gt=0.0, le=0.5)
    """Part of the drum's volume that the bed takes."""
    start_up: Number = Field(default=1.0, ge=0.0)
    """Revolutions before measuring."""
    revolutions: Number = Field(default=2.0, gt=0.0)
    """Revolutions while measuring."""

    def scene(self, wall: Material) -> Drum:
        """Build the engine's scene."""
        return Drum(wall_material=wall, **dict(self))


class DrawDownSection(PouredSection):
    """``[scene.draw-down]``: a box runs out through a slot in its floor into a box below."""

    width: Length = Field(gt=0.0)
    """Inner width of both boxes, across the slot."""
    depth: Length = Field(gt=0.0)
    """Inner depth of both boxes, along the slot."""
    fill_depth: Length = Field(gt=0.0)
    """Depth of the grains in the upper box."""
    slot: Length = Field(gt=0.0)
    """Width of the slot."""
    drop: Length = Field(gt=0.0)
    """From the floor of the upper box down to that of the lower."""

    def scene(self, wall: Material) -> DrawDown:
        """Build the engine's scene."""
        return DrawDown(wall_material=wall, **dict(self))


class SceneSection(Section):
    """``[scene]``: the physical test."""

    lifted_cylinder: LiftedCylinderSection | None = Field(default=None, alias="lifted-cylinder")
    """The lifted cylinder, which leaves a heap."""
    hopper: HopperSection | None = None
    """The flat-bottomed hopper."""
    drum: DrumSection | None = None
    """The rotating drum."""
    draw_down: DrawDownSection | None = Field(default=None, alias="draw-down")
    """The draw-down test."""

    @model_validator(mode="after")
    def _is_one(self) -> Self:
        given = [name for name, section in self._sections().items() if section]
        if len(given) != 1:
            known = ", ".join(f"[scene.{name}]" for name in self._sections())
            raise ValueError(f"must be one of {known}, not {len(given)} of them")
        return self

    def _sections(self) -> dict[str, PouredSection | None]:
        fields = type(self).model_fields.items()
        return {field.alias or name: getattr(self, name) for name, field in fields}

    @property
    def leaves_a_heap(self) -> bool:
        """Whether the test ends in a heap, whose repose angle can be measured."""
        return self.lifted_cylinder is not None

    @property
    def observables(self) -> Mapping[str, Observable]:
        """What the test measures."""
        return self.scene(_ANY_WALL).observables

    def scene(self, wall: Material) -> PouredScene:
        """Build the engine's scene, its walls of a material."""
        [section] = filter(None, self._sections().values())
        return section.scene(wall)
