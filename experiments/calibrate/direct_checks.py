"""Direct readings against all else that is known of their factors: which contradict it, and by how much."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from doe import JointFit
from doe.samples.two_errors import TwoErrors
from experiments.calibrate.values import p_text, quantity
from experiments.io.texts import enumeration
from experiments.studyfile import Study
from experiments.studyfile.campaign import Direct


@dataclass(frozen=True)
class DirectCheck:
    """A direct reading against all else that is known of its factor."""

    direct: Direct
    value: float
    """Value of the factor that suits the others best; where it was not kept, that of all cases."""
    errors: float
    """Standard errors by which they disagree."""
    p: float
    apart: bool
    """True where p is below the level, shared among the direct readings."""
    others: tuple[str, ...] = ()
    """Responses that it is compared with; empty where the factor was not kept."""

    @property
    def row(self) -> dict[str, Any]:
        """Row of a table."""
        return vars(self) | {"direct": self.direct.name, "others": ", ".join(self.others)}


def check_direct(study: Study, joint: JointFit | None, alpha: float) -> tuple[DirectCheck, ...]:
    """Compare each direct reading with the other responses; with the middle of a factor that was not kept."""
    middles = {factor.name: factor.center for factor in study.factors}
    checks = []
    for direct in study.direct:
        if joint is not None and direct.name in joint.goals:
            others = tuple(name for name in joint.goals if name != direct.name)
            value, (errors, p) = joint.without(direct.name).point[direct.factor], joint.conflict(direct.name)
        else:
            others, value, sample = (), middles[direct.factor], direct.measured
            total = math.hypot(sample.se, direct.model_sd)
            errors = abs(value - sample.mean) / total
            p = TwoErrors(math.inf, sample.df).p(errors, (sample.se / total) ** 2)
        apart = p < alpha / len(study.direct)
        checks.append(DirectCheck(direct, value, errors, p, apart, others))
    return tuple(checks)


def disagreement_text(check: DirectCheck) -> str:
    """Say by how much a direct reading and all else disagree, and where each sees the factor."""
    direct, off = check.direct, f"{check.errors:.1f} standard errors ({p_text(check.p)})"
    own = f"{quantity(direct.measured.mean, direct.unit)} ± {quantity(direct.measured.se, direct.unit)}"
    if not check.others:
        return (
            f"the {direct.title} gives {own}, {off} from the middle of {direct.factor}, "
            f"{quantity(check.value, direct.unit)}, which all cases had as the factor was not kept"
        )
    verb = "disagree" if len(check.others) > 1 else "disagrees"
    return (
        f"{enumeration(check.others)} {verb} with the {direct.title} by {off}: best met at {direct.factor} = "
        f"{quantity(check.value, direct.unit)}, it gives {own}"
    )
