"""Codes that contacts and tests can be translated for: one file and one line here each."""

from __future__ import annotations

from dem_warp.registry import Registry
from experiments.export.deme import DEME
from experiments.export.edem import EDEM
from experiments.export.exporter import Exporter
from experiments.export.lammps import LAMMPS
from experiments.export.liggghts import LIGGGHTS
from experiments.export.mercury import MERCURY
from experiments.export.rocky import ROCKY
from experiments.export.yade import YADE


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
