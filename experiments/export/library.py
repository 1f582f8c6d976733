"""Codes that contacts can be translated for: one file and one line here each."""

from __future__ import annotations

from experiments.export.contact import Exporter
from experiments.export.lammps import LAMMPS
from experiments.export.liggghts import LIGGGHTS
from experiments.export.yade import YADE

EXPORTERS: dict[str, Exporter] = {"lammps": LAMMPS, "liggghts": LIGGGHTS, "yade": YADE}
