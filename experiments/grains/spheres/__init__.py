"""Files of spheres of other codes: clumps and heaps in, whatever their format."""

from experiments.grains.spheres.clump_file import ClumpFile, length_unit, read_clump
from experiments.grains.spheres.library import FORMATS
from experiments.grains.spheres.reader import format_of, read_spheres
from experiments.grains.spheres.sphere_file import SphereFile

__all__ = ["FORMATS", "ClumpFile", "SphereFile", "format_of", "length_unit", "read_clump", "read_spheres"]
