"""All formats of files of spheres."""

from __future__ import annotations

from experiments.grains.spheres.column_table import TABLE
from experiments.grains.spheres.lammps_dump import DUMP
from experiments.grains.spheres.plain_lines import PLAIN
from experiments.grains.spheres.sphere_file import Format
from experiments.grains.spheres.vtk_file import VTK
from experiments.grains.spheres.xml_table import XML
from experiments.grains.spheres.yade_file import YADE_TEMPLATE, YADE_TEXT

FORMATS: tuple[Format, ...] = (DUMP, VTK, YADE_TEXT, YADE_TEMPLATE, XML, PLAIN, TABLE)
"""Formats in order; the first that recognises a file reads it."""
