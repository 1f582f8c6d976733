"""``[scene.NAME]``: the physical test, one of the library's, each a table of its own."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, ClassVar, Self

from pydantic import model_validator

from dem_warp import SCENES, Material
from dem_warp.scenes.poured_heap import FLOW
from dem_warp.scenes.scene import Observable
from dem_warp.scenes.walled_scene import WalledScene
from experiments.io.texts import nearest_name
from experiments.studyfile.generated import EngineSection, LibrarySection, library_section

_STRENGTHS = ("friction_angle", "cohesion", "steady_angle", "consolidation", "unconfined", "flow_ratio")
_OF_FUNNEL = (*FLOW, "fill_height", "solid_fraction")

ABSENT: tuple[tuple[str, Callable[[Any], bool], str, tuple[str, ...]], ...] = (
    ("compression", lambda own: not own.taps, "taps", ("tapped_density", "hausner_ratio")),
    ("drop", lambda own: not own.plate_angle, "an inclined plate", ("tangential_ratio",)),
    ("poured-heap", lambda own: own.mass_rate, "no mass_rate", _OF_FUNNEL),
    ("shear", lambda own: own.base == "smooth", "a rough base", _STRENGTHS),
    ("shear", lambda own: own.base == "rough", "a smooth base", ("wall_friction_angle",)),
)
"""Observables that a test lacks as it is set: its name, when, what they need, beginnings of their names."""


class TestSection(EngineSection):
    """``[scene.NAME]``: parameters of a test."""

    # No rule of a scene is about the material of its walls.
    trial_arguments: ClassVar[Mapping[str, Any]] = {"wall_material": Material(7800.0, 70e9, 0.3)}


class SceneSection(LibrarySection):
    """``[scene]``: the physical test, one of the library's."""

    @model_validator(mode="after")
    def _is_one(self) -> Self:
        if len(self.given) != 1:
            known = ", ".join(f"[scene.{field.alias}]" for field in type(self).model_fields.values())
            raise ValueError(f"must be one of {known}, got {len(self.given)} of them")
        return self

    @property
    def kind(self) -> type[WalledScene]:
        """Class of the engine's scene."""
        [section] = self.given.values()
        return section.engine

    @property
    def leaves_a_heap(self) -> bool:
        """The test ends in a heap, whose repose angle can be measured."""
        return self.kind.leaves_a_heap

    @property
    def observables(self) -> Mapping[str, Observable]:
        """Observables that the test has as it is set."""
        absent = tuple(self._absent)
        return {name: one for name, one in self.kind.observables.items() if not name.startswith(absent)}

    @property
    def _absent(self) -> dict[str, str]:
        [(kind, own)] = self.given.items()
        found = ((names, need) for scene, when, need, names in ABSENT if scene == kind and when(own))
        return {name: need for names, need in found for name in names}

    def unknown(self, name: str, known: Mapping[str, Any]) -> str:
        """Say what the test needs to measure an observable, or which known one is meant."""
        needs = [f"it needs {need}" for absent, need in self._absent.items() if name.startswith(absent)]
        return f"must be what the scene measures, {(needs or [nearest_name(name, list(known))])[0]}"

    def scene(self, wall: Material) -> WalledScene:
        """Build the engine's scene, its walls of a material."""
        [section] = self.given.values()
        return section.build(wall_material=wall)


def scene_section() -> type[SceneSection]:
    """Generate the section of the scenes of the library, as it is now."""
    return library_section(SceneSection, TestSection, *SCENES.items())
