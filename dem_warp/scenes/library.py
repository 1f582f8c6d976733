"""All scenes by name; a new one needs its file and a line here."""

from dem_warp.registry import Registry, require_kind
from dem_warp.scenes.draw_down import DrawDown
from dem_warp.scenes.drum import Drum
from dem_warp.scenes.hopper import Hopper
from dem_warp.scenes.lifted_cylinder import LiftedCylinder
from dem_warp.scenes.poured_scene import PouredScene

_ALL: tuple[type[PouredScene], ...] = (LiftedCylinder, Hopper, Drum, DrawDown)

SCENES = Registry(
    "dem_warp.scenes",
    {scene.name: scene for scene in _ALL},
    lambda name, kind, known: require_kind(PouredScene, name, kind),
)
"""Scenes by the name of their section in study files, including those of plugins."""
