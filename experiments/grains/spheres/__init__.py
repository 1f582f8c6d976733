"""Reading of files of spheres of other codes, with clumps or heaps."""

from experiments.grains.spheres.clump_file import ClumpFile, length_unit, read_clump
from experiments.grains.spheres.reader import FORMATS, format_of, read_spheres, require_known, require_no_text
from experiments.grains.spheres.sphere_file import SphereFile

__all__ = [
    "FORMATS",
    "ClumpFile",
    "SphereFile",
    "format_of",
    "length_unit",
    "read_clump",
    "read_spheres",
    "require_known",
    "require_no_text",
]
