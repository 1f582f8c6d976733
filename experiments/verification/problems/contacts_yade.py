"""Contacts in Yade, with the terms that the exporter writes."""

import tempfile
from pathlib import Path

from dem_warp import laws_named
from experiments.verification.codes.chapters import code_result
from experiments.verification.codes.yade import run_yade
from experiments.verification.result import Result

TEXT = """`Ip2_FrictMat_FrictMat_MindlinPhys` and `Law2_ScGeom_MindlinPhys_Mindlin` with
`includeMoment`, on one core. Yade's spring of rolling is set in every contact at the end of the step in which
it begins, so that it lacks the roll of that step: that is the difference of the spheres that roll on each
other."""


def contacts_yade(device: str) -> Result:
    """Two spheres, and a sphere on a plate, in Yade and here."""
    laws = laws_named("yade")
    with tempfile.TemporaryDirectory() as folder:
        run = run_yade(laws, Path(folder))
    return code_result(run, laws, device, TEXT)
