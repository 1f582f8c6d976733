"""Files of spheres of other codes: clumps and heaps in, whatever their format."""

from experiments.sphere_files.clump_file import ClumpFile, length_unit, read_clump
from experiments.sphere_files.library import FORMATS
from experiments.sphere_files.reader import format_of, read_spheres
from experiments.sphere_files.sphere_file import SphereFile

__all__ = ["FORMATS", "ClumpFile", "SphereFile", "format_of", "length_unit", "read_clump", "read_spheres"]
