"""Does a heap's angle depend on the numerics: time step, skin, precision, or a tube of triangles."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from dem_warp import Case, CaseResult, LiftedCylinder, simulate
from dem_warp.scenes.walled_scene import default_skin
from dem_warp.walls import Mesh, Wall
from doe import Comparison, Sample, compare_means
from experiments.evidence.verification.check import Curve, Plot, Result, Row, absolute_row
from experiments.evidence.verification.problems.stored import finished_cases, repose_angles
from experiments.studyfile import Study, load_study

MARGIN = 1.0
"""Shift of the mean angle that does not matter [deg]: twice the standard deviation of the measured heaps."""

SEGMENTS = 48
"""Flat sides of the tube of triangles; they stand within 0.2 % of the round tube's radius."""

FIRST_SEED = 70_000
SKIN_SEEDS = 2

TEXT = f"""Heaps of the buckwheat study, every factor at its middle, in many replicates: as production has
them, with half the time step, with forces in float64, and out of a tube of {SEGMENTS} flat sides of two
triangles each, whose cross-section has the area of the round one's. A replicate is another seed; kinds are
compared unpaired. A kind passes when the 95 % interval of the shift of its mean angle (Welch) lies within
{MARGIN:g} degree. That is stricter than two one-sided tests at 5 % (D. J. Schuirmann, Journal of
Pharmacokinetics and Biopharmaceutics 15 (1987) 657-680), whose p is given, too.

Half the skin of the neighbour lists needs no statistics: it gives the same bits, so that its shift is zero.

"""


TRIALS = {
    "cpu": ("bench", 64, "Here at bench scale: 400 grains, shear modulus / 400, {} heaps of each kind."),
    "cuda": ("soft", 20, "Here at the paper's size with its shear modulus / 100, {} heaps of each kind."),
}
"""Scale of the heaps that are compared, their number of each kind, and both in words."""


@dataclass(frozen=True)
class LiftedMesh(LiftedCylinder):
    """A lifted cylinder whose tube is made of triangles."""

    def walls(self, reach: float) -> tuple[Wall, ...]:
        """Return the plate and the tube."""
        return super().walls(reach)[0], Mesh.tube(self.diameter / 2, self.height, SEGMENTS)


def with_numerics(case: Case, **changes: Any) -> Case:
    """Return the same case, computed in another way."""
    return replace(case, numerics=replace(case.numerics, **changes))


def _from_mesh(case: Case) -> Case:
    scene = case.scene
    return replace(case, scene=LiftedMesh(**{f.name: getattr(scene, f.name) for f in fields(scene)}))


KINDS: Mapping[str, Callable[[Case], Case]] = {
    "half the time step": lambda case: with_numerics(
        case, time_step_fraction=0.5 * case.numerics.time_step_fraction
    ),
    "float64": lambda case: with_numerics(case, precision="double"),
    "tube of triangles": _from_mesh,
}
BASE = "production"


def heaps(study: Study, replicates: int, device: str) -> dict[str, list[CaseResult]]:
    """Results of every kind of heap."""
    base = [study.case({}, FIRST_SEED + number) for number in range(replicates)]
    cases = {BASE: base} | {name: [change(case) for case in base] for name, change in KINDS.items()}
    return {name: finished_cases(kind, device) for name, kind in cases.items()}


def changed_arrays(study: Study, device: str) -> int:
    """Arrays, of those that describe a heap, in which half the skin changes any bit."""
    cases = [study.case({}, FIRST_SEED + number) for number in range(SKIN_SEEDS)]
    thin = [with_numerics(case, skin=0.5 * default_skin(case)) for case in cases]
    results = simulate([*cases, *thin], device)
    names = ("positions", "orientations", "sizes", "shapes")
    return sum(
        not np.array_equal(getattr(result, name), getattr(other, name))
        for result, other in zip(results[:SKIN_SEEDS], results[SKIN_SEEDS:], strict=True)
        for name in names
    )


def shift(angles: np.ndarray, base: np.ndarray) -> Comparison:
    """Shift of a kind's mean angle against production's [deg]; heaps without an angle are left out."""
    seen, base_seen = (values[np.isfinite(values)] for values in (angles, base))
    return compare_means(seen, base_seen, margin=MARGIN, method="welch")


def shift_rows(problem: str, name: str, compared: Comparison) -> list[Row]:
    """Rows of one kind: how far the interval of its shift reaches, and the two one-sided tests."""
    low, high = compared.interval
    sizes = f"{compared.a.n} heaps against {compared.b.n}" if isinstance(compared.b, Sample) else ""
    reach = max(abs(low), abs(high))
    quantity = f"shift of the mean angle [deg]; 95 % interval {low:+.2f} to {high:+.2f}"
    reference = "farther end of the interval within the margin"
    p = (problem, f"{name}, {sizes}", "p of the two one-sided tests", "below 5 %")
    return [
        Row(problem, f"{name}, {sizes}", quantity, reference, 0.0, compared.difference, reach, MARGIN, False),
        absolute_row(p, 0.0, compared.equivalence_p or 0.0, 0.05),
    ]


def _plot(angles: Mapping[str, np.ndarray]) -> Plot:
    curves = []
    for name, values in angles.items():
        seen = np.sort(values[np.isfinite(values)])
        curves.append(Curve(name, seen, (np.arange(len(seen)) + 0.5) / len(seen)))
    labels = ("Heaps by angle", "repose angle [deg]", "part of the heaps below")
    return Plot("heap-angle", *labels, tuple(curves))


def heap_angle(device: str) -> Result:
    """Shift of the angle under other numerics."""
    problem = "Heaps of buckwheat"
    scale, replicates, words = TRIALS["cpu" if device == "cpu" else "cuda"]
    study = load_study(scale=scale)
    results = heaps(study, replicates, device)
    angles = {name: repose_angles(study, kind) for name, kind in results.items()}
    rows = []
    for name, values in angles.items():
        labels = (problem, name, "heaps without an angle", "every one is measured")
        rows.append(absolute_row(labels, 0.0, np.count_nonzero(np.isnan(values)), 0.0))
    for name in KINDS:
        rows += shift_rows(problem, name, shift(angles[name], angles[BASE]))
    labels = (problem, f"half the skin, {SKIN_SEEDS} heaps", "arrays of a heap that differ", "the same bits")
    rows.append(absolute_row(labels, 0.0, changed_arrays(study, device), 0.0))
    text = TEXT + words.format(replicates)
    return Result("Heap angle and numerics", text, tuple(rows), (_plot(angles),))
