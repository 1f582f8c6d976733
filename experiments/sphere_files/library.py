"""Formats of files of spheres, in the order in which a file is tried."""

from __future__ import annotations

from experiments.sphere_files.dump import DUMP
from experiments.sphere_files.plain import PLAIN
from experiments.sphere_files.sphere_file import Format
from experiments.sphere_files.table import TABLE
from experiments.sphere_files.vtk import VTK
from experiments.sphere_files.xml_table import XML
from experiments.sphere_files.yade import YADE_TEMPLATE, YADE_TEXT

FORMATS: tuple[Format, ...] = (DUMP, VTK, YADE_TEXT, YADE_TEMPLATE, XML, PLAIN, TABLE)
"""All formats; the first that recognises a file reads it."""
