"""Formats of files of spheres, in the order in which a file is tried."""

from __future__ import annotations

from experiments.grains.spheres.dump import DUMP
from experiments.grains.spheres.plain import PLAIN
from experiments.grains.spheres.sphere_file import Format
from experiments.grains.spheres.table import TABLE
from experiments.grains.spheres.vtk import VTK
from experiments.grains.spheres.xml_table import XML
from experiments.grains.spheres.yade import YADE_TEMPLATE, YADE_TEXT

FORMATS: tuple[Format, ...] = (DUMP, VTK, YADE_TEXT, YADE_TEMPLATE, XML, PLAIN, TABLE)
"""All formats; the first that recognises a file reads it."""
