"""Registry of exporters: each code has one line here."""

from __future__ import annotations

from dem_warp.registry import Registry
from experiments.export.deme_exporter import DEME
from experiments.export.exporter import Exporter
from experiments.export.lammps_exporter import LAMMPS
from experiments.export.liggghts_exporter import LIGGGHTS
from experiments.export.mercury_exporter import MERCURY
from experiments.export.sheet import EDEM, ROCKY
from experiments.export.yade_exporter import YADE


def _check(name: str, exporter: object, known: object) -> None:
    if not isinstance(exporter, Exporter):
        raise TypeError(f"must be an Exporter, got {exporter!r}")


_ALL = {
    "liggghts": LIGGGHTS,
    "lammps": LAMMPS,
    "yade": YADE,
    "deme": DEME,
    "mercurydpm": MERCURY,
    "edem": EDEM,
    "rocky": ROCKY,
}

EXPORTERS: Registry[Exporter] = Registry("dem_warp.exporters", _ALL, _check)
"""Exporters by the name of their code on the command line."""
