"""``[scene.NAME]``: the physical test, one of the library's, each a table of its own."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Self

from pydantic import model_validator

from dem_warp import SCENES, Material
from dem_warp.scenes.scene import Observable
from dem_warp.scenes.walled_scene import WalledScene
from experiments.studyfile.generated import EngineSection, LibrarySection, library_section


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
        return self.kind.observables

    def scene(self, wall: Material) -> WalledScene:
        """Build the engine's scene, its walls of a material."""
        [section] = self.given.values()
        return section.build(wall_material=wall)


def scene_section() -> type[SceneSection]:
    """Generate the section of the scenes of the library, as it is now."""
    return library_section(SceneSection, TestSection, *SCENES.items())
