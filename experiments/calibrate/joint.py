"""The optimum of several responses: where they agree, what each of them buys, and what they leave open."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from doe import JointFit, Region
from experiments.calibrate.direct_checks import DirectCheck, disagreement_text
from experiments.calibrate.results import Decision
from experiments.calibrate.values import fixed_values, p_text
from experiments.io.texts import enumeration
from experiments.studyfile.campaign import OptimumSettings

STAGE = "optimum"

SMALL_COMPONENT = 0.2
"""A factor whose part in a direction is smaller is not named."""

NO_HELP = 0.95
"""A response that leaves more than this share of the region buys nothing worth the name."""


def choose_jointly(joint: JointFit, settings: OptimumSettings) -> tuple[dict[str, float], str]:
    """Return the chosen point and the rule that chose it."""
    fixed = fixed_values(settings.point, [factor.name for factor in joint.factors])
    if fixed is not None:
        return fixed, "The study fixes the chosen point."
    rule = (
        "The chosen point has the smallest chi2 over all responses, each weighed by the errors of its fit "
        "and of its target; among points as good, it is the one nearest to the design's centre, in coded "
        "units."
    )
    return joint.point, rule


def ranges_of(
    region: Region, joint: JointFit | None, limits: Mapping[str, tuple[float, float]]
) -> pd.DataFrame:
    """Return the range of each factor, with the ends at an edge of what was explored.

    With several responses that agree it is the interval of the factor by itself, else that of the region.
    An end at a physical limit is not open: nothing is beyond.
    """
    if joint is not None and region.mask.any():
        ranges = joint.intervals.drop(columns="value")
    else:
        ranges = region.ranges.join(region.open_ends.add_suffix("_open"))
    for factor in region.factors:
        for end, limit in zip(("low", "high"), limits[factor.name], strict=True):
            if abs(ranges.loc[factor.name, end] - limit) < 1e-6 * factor.half_range:
                ranges.loc[factor.name, [end, f"{end}_open"]] = limit, False
    return ranges


def joint_decisions(
    joint: JointFit, point: Mapping[str, float], settings: OptimumSettings
) -> tuple[Decision, ...]:
    """Say whether the responses agree, what each of them buys, and which directions they leave open."""
    return _agreement(joint, point), _purchase(joint), _directions(joint, settings)


def open_directions(joint: JointFit, settings: OptimumSettings) -> pd.DataFrame:
    """Return the directions along which the compatible region spans too much of the design."""
    return joint.directions[joint.directions["span"] > settings.unidentified_span]


def direction_text(direction: pd.Series) -> str:
    """Write a direction by what it moves, as ``E up, F down (1 : 0.6)``."""
    parts = direction.drop("span")
    named = parts[parts.abs() >= SMALL_COMPONENT].sort_values(key=np.abs, ascending=False)
    moves = ", ".join(f"{name} {'up' if part > 0.0 else 'down'}" for name, part in named.items())
    if len(named) == 1:
        return f"{moves} alone"
    shares = " : ".join(f"{abs(part) / abs(named.iloc[0]):.2g}" for part in named)
    return f"{moves} ({shares} in coded units)"


def direct_decision(checks: Sequence[DirectCheck]) -> Decision:
    """Say which direct readings contradict the other measurements, and by how much."""
    numbers = {f"{check.direct.name}, standard errors off": check.errors for check in checks}
    numbers |= {f"p of {check.direct.name}": check.p for check in checks}
    apart = [check for check in checks if check.apart]
    names = enumeration(f"the {check.direct.title}" for check in checks)
    outcome = f"No contradiction is found to {names}."
    if apart:
        outcome = "; ".join(map(disagreement_text, apart))
        outcome = f"{outcome[:1].upper()}{outcome[1:]}."
    return Decision(
        STAGE,
        "A direct reading contradicts the others when it raises the smallest chi2 of the region explored by "
        "more than errors explain; the level is shared among the direct readings.",
        numbers,
        outcome,
    )


def _agreement(joint: JointFit, point: Mapping[str, float]) -> Decision:
    tests = joint.tests(point)
    numbers = {f"{name}, standard errors off": t for name, t in tests["t"].items()}
    numbers |= {f"p of {name}": p for name, p in tests["p"].items()}
    apart = tests[~tests["agrees"]]
    if apart.empty:
        outcome = "All responses agree with their targets at the chosen point."
    else:
        missed = [f"{row.Index} ({row.t:+.1f} errors, {p_text(row.p)})" for row in apart.itertuples()]
        outcome = f"At the chosen point these differ from their targets: {', '.join(missed)}."
        if not joint.region().mask.any():
            outcome += (
                " No setting that the design explored agrees with all: fix surface.center nearer to where "
                "they might, widen surface.half_range, or look for a mechanism that the model lacks."
            )
    level = joint.level(point)
    rule = "A response agrees when its fit at the chosen point differs from its target with p >= "
    return Decision(STAGE, f"{rule}{level:.3g}.", numbers, outcome)


def _purchase(joint: JointFit) -> Decision:
    table = joint.shrinkage
    alone = float(table["share"].iloc[0])
    numbers = {f"share with {name} added": share for name, share in table["share"].items()}
    numbers |= {f"share of {name} alone": share for name, share in table["alone"].items()}
    with_first = table["with_first"].iloc[1:]
    first, best = table.index[0], str(with_first.idxmin())
    if not alone > 0.0:
        outcome = f"No setting explored agrees with the {first} alone."
    elif with_first[best] > NO_HELP * alone:
        outcome = f"No response makes the {first}'s region smaller by more than {1.0 - NO_HELP:.0%}."
    else:
        whole, part = float(table["share"].iloc[-1]), with_first[best]
        outcome = (
            f"{best} buys most: with it {part / alone:.0%} of the {first}'s region are left. All together "
            f"leave {whole / alone:.0%} of it"
        )
        outcome += (
            ": the others buy nothing, and each more makes every test stricter." if whole > part else "."
        )
    return Decision(
        STAGE,
        f"The region of the {first} alone, then with the response that makes it smallest, and so on: shares "
        "of the region that the design explored.",
        numbers,
        outcome,
    )


def _directions(joint: JointFit, settings: OptimumSettings) -> Decision:
    rows = [row for _, row in joint.directions.iterrows()]
    numbers = {f"span along {direction_text(row)}": float(row["span"]) for row in rows}
    left = open_directions(joint, settings)
    if not joint.region().mask.any():
        outcome = "Nothing is compatible, so that nothing can be said of what stays open."
    elif left.empty:
        outcome = "The responses pin every direction down."
    else:
        texts = "; ".join(direction_text(row) for _, row in left.iterrows())
        outcome = f"Along these the responses do not change enough to tell settings apart: {texts}."
    return Decision(
        STAGE,
        "Directions are eigenvectors of the joint Fisher information; one is open when the compatible region "
        f"spans more than {settings.unidentified_span:.0%} of what the design explored along it.",
        numbers,
        outcome,
    )
