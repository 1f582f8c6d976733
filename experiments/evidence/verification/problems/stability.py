"""The twelve corners of the paper's screening at the production step, at twice and at four times it."""

from collections.abc import Sequence

import numpy as np

from dem_warp import Case, CaseResult
from experiments.evidence.studies.buckwheat.replay.runs import planned_cases
from experiments.evidence.verification.check import Curve, Plot, Result, Row, absolute_row
from experiments.evidence.verification.problems.heap_angle import with_numerics
from experiments.evidence.verification.problems.stored import finished_cases, repose_angles
from experiments.studyfile import Study, load_study

FRACTIONS = (0.25, 0.5, 1.0)
"""Time steps over the Rayleigh time of the smallest sphere; the first is production's."""

SCALES = {
    "cpu": ("bench", "Here at bench scale: 400 grains, shear modulus / 400."),
    "cuda": (
        "printed",
        "Here at the paper's size, moduli and time step; on the GPU all are worlds of one batch.",
    ),
}
ADVICE = "lower time_step_fraction"

TEXT = """The paper's screening is a Plackett-Burman design of twelve runs at the corners of its eight
factors: moduli, restitutions and frictions. At 25 % of the Rayleigh time of the smallest sphere another
code (LIGGGHTS) exploded at one of them. Here each must finish, or be flagged, in that world only, with the
time and what to do about it; that a world which diverges changes no bit of its neighbours is tested in
`tests/dem_warp/test_isolation.py`. The same at twice and at four times the step shows how far off the limit
is, and what a flag says. Between rest and divergence, damping over too long a step can keep a grain
trembling in place: then the scene fails by its own rule of rest, with the same advice.

"""


def corners(study: Study) -> list[Case]:
    """Return the runs of the screening, one seed each."""
    runs = planned_cases(1, ["screening"])
    names = [factor.name for factor in study.factors]
    return [
        study.case(settings, int(seed))
        for settings, seed in zip(runs[names].to_dict("records"), runs["seed"], strict=True)
    ]


def ended_in_order(result: CaseResult) -> bool:
    """Return True if a case finished, or was flagged with the advice to take."""
    return result.status == "finished" or ADVICE in result.reason


def outcome(result: CaseResult) -> str:
    """End of a case, in a few words."""
    if result.status == "finished":
        return f"finished after {result.observables['simulated_time']:.2f} s"
    return f"{result.status}: {result.reason}"


def _rows(problem: str, results: Sequence[CaseResult]) -> list[Row]:
    rows, wanted = [], ("1: it ends in neither way", "finishes, or is flagged with time and advice")
    for run, result in enumerate(results, 1):
        labels = (problem, f"run {run}, {outcome(result)}", *wanted)
        rows.append(absolute_row(labels, 0.0, float(not ended_in_order(result)), 0.0))
    return rows


def stability(device: str) -> Result:
    """Each corner of the screening, at three time steps."""
    scale, words = SCALES["cpu" if device == "cpu" else "cuda"]
    study = load_study(scale=scale)
    runs = corners(study)
    cases = [with_numerics(case, time_step_fraction=fraction) for fraction in FRACTIONS for case in runs]
    results = finished_cases(cases, device)
    rows, curves = [], []
    for k, fraction in enumerate(FRACTIONS):
        each = results[k * len(runs) : (k + 1) * len(runs)]
        name = f"{100.0 * fraction:g} % of the Rayleigh time"
        rows += _rows(f"Corners of the screening, {name}", each)
        angles = repose_angles(study, each)
        if np.isfinite(angles).any():
            curves.append(Curve(name, 1.0 + np.arange(len(runs)), angles, "points"))
    plot = Plot("stability", "Corners of the screening", "run", "repose angle [deg]", tuple(curves))
    return Result("Stability", TEXT + words, tuple(rows), (plot,))
