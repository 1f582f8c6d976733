"""The lifted cylinder of a trial as an input of LAMMPS, filmed and weighed while the tube rises."""

from __future__ import annotations

from experiments.trials.other_codes.surfaces import Bench


def lammps_files(bench: Bench) -> dict[str, str]:
    """Files of the input of a case, by name."""
    raise NotImplementedError
