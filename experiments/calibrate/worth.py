"""Tests that buy nothing, by the screening: said before the climb and the surface simulate more of them."""

from __future__ import annotations

import numpy as np
import pandas as pd

from doe import Factor
from experiments.calibrate.joint import NO_HELP
from experiments.calibrate.results import Decision, NoiseFloorResult, ScreeningResult, TargetResult
from experiments.calibrate.selection_stage import STAGE
from experiments.calibrate.values import kept_factors
from experiments.studyfile import Study
from experiments.studyfile.campaign import scenes_of

RULE = (
    f"A test must narrow the region by {1.0 - NO_HELP:.0%}, by its effects in the screening and its errors."
)

LARGE_SHARE = 0.2
"""Share of the work from which a test that buys nothing is worth a warning."""

SURFACE_PART = 0.5
"""Variance of a surface, of that of a run: 10 terms by 19 runs of three factors, 6 by 13 of two."""

ROUNDING = 1e-12
"""Least variance of a response, of the square of its slopes."""


def costs_of(cases: pd.DataFrame) -> pd.DataFrame:
    """Return the cost of every scene (index ``scene``): cases, simulated_time [s], grain_time [s].

    The last is the simulated time of every grain together, to which the work is nearly proportional.
    """
    known = cases.reindex(columns=["scene", "simulated_time", "grain_count"])
    known = known.assign(grain_time=known["simulated_time"] * known["grain_count"])
    groups = known.groupby("scene", sort=False)
    return groups[["simulated_time", "grain_time"]].sum().assign(cases=groups.size())


def useless_tests(
    study: Study,
    kept: tuple[str, ...],
    target: TargetResult,
    noise: NoiseFloorResult,
    screening: ScreeningResult,
) -> tuple[Decision, ...]:
    """Name the tests that take much of the work and buy nothing; that of the leading response is needed.

    What a test leaves of the region follows from the information on the kept factors over their ranges: of
    direct readings, and of the effects on each response less the noise in them, over the errors of its target
    and of its surface to come.
    """
    fitted, leading = study.target.fitted, study.target.leading.scene
    ranges = kept_factors(study, kept)
    base = np.diag([3.0 + _read(study, factor) for factor in ranges])  # a range has a variance of 1/3
    found = dict.fromkeys(scenes_of(fitted), np.zeros_like(base))
    for one in fitted:
        screen, run = screening.responses[one.name].screen, noise.responses[one.name].sd ** 2
        seen = 0.5 * screen.table.loc[list(kept), "effect"].to_numpy()
        slopes = np.sign(seen) * np.sqrt(np.maximum(seen**2 - run / len(screen.response), 0.0))
        variance = target.responses[one.name].se ** 2 + SURFACE_PART * run
        least = ROUNDING * float(slopes @ slopes)  # an exact target is known to rounding
        found[one.scene] = found[one.scene] + np.outer(slopes, slopes) / (variance + least or 1.0)
    whole, work = sum(found.values(), base), costs_of(screening.cases)["grain_time"]
    decisions = []
    for scene, own in found.items():
        left = float(np.sqrt(np.linalg.det(whole - own) / np.linalg.det(whole)))
        share = float(work[scene] / (work.sum() or np.nan))
        if scene != leading and left > NO_HELP and share >= LARGE_SHARE:
            numbers = {"share of the region that it leaves": left, "share of the work": share}
            said = (
                f"Warning: {scene} takes {share:.0%} of the work and buys nothing: it would leave {left:.0%} "
                "of the region. A larger or longer one may narrow it: dem-warp plan finds the size."
            )
            decisions.append(Decision(STAGE, RULE, numbers, said))
    return tuple(decisions)


def _read(study: Study, factor: Factor) -> float:
    """Return the information of direct readings of a factor, per coded unit squared."""
    own = [one for one in study.direct if one.factor == factor.name]
    return sum(factor.half_range**2 / (one.measured.se**2 + one.model_sd**2) for one in own)
