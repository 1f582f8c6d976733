"""All scenes by name; a new one needs its file and a line here."""

from dem_warp.registry import Registry, require_kind
from dem_warp.scenes.compression import Compression
from dem_warp.scenes.draw_down import DrawDown
from dem_warp.scenes.drop import Drop
from dem_warp.scenes.drum import Drum
from dem_warp.scenes.hopper import Hopper
from dem_warp.scenes.incline import Incline
from dem_warp.scenes.ledge import Ledge
from dem_warp.scenes.lifted_cylinder import LiftedCylinder
from dem_warp.scenes.penetration import Penetration
from dem_warp.scenes.poured_heap import PouredHeap
from dem_warp.scenes.roll import Roll
from dem_warp.scenes.shear import Shear
from dem_warp.scenes.tilting_box import TiltingBox
from dem_warp.scenes.walled_scene import WalledScene

_ALL: tuple[type[WalledScene], ...] = (
    LiftedCylinder,
    Hopper,
    Drum,
    DrawDown,
    PouredHeap,
    Ledge,
    TiltingBox,
    Compression,
    Shear,
    Penetration,
    Drop,
    Incline,
    Roll,
)

SCENES = Registry(
    "dem_warp.scenes",
    {scene.name: scene for scene in _ALL},
    lambda name, kind, known: require_kind(WalledScene, name, kind),
)
"""Scenes by the name of their section in study files, including those of plugins."""
