"""Surfaces of a cheaper scale that a few runs move: is the hidden setting in the compatible region."""

from collections.abc import Callable, Iterator
from itertools import product

import numpy as np
import pandas as pd
from numpy.random import Generator
from numpy.typing import NDArray

from doe import (
    Design,
    Factor,
    Sample,
    Surface,
    Transfer,
    central_composite,
    fit_surface,
    spread_points,
    transfer,
)
from doe.design.design import natural_points
from experiments.calibrate.fidelity_stage import LEAST
from experiments.evidence.accuracy.statistics.coverage import EXACT, Figure, generator

TWINS, RESOLUTION = 500, {2: 40, 3: 11}  # of each case; cells along each factor
CHEAP, OWN, MEASURED = 1.0, 0.7, 5  # standard deviations of a run at both scales; measurements of the target

Cells = NDArray[np.float64]


def fidelity() -> Iterator[Figure]:
    """Yield the coverage of the region by factors, runs, and how unlike the slopes at the two scales are."""
    for number, (factors, slope) in enumerate(product((2, 3), (0.0, 1.0))):
        rng = generator("fidelity", number)
        found = np.array([twin for twin in (one(rng, factors, 12, slope) for _ in range(TWINS)) if twin])
        size = float(np.median(found[:, 1] / found[:, 2]))
        case = f"{factors} factors, 12 runs, slopes apart {slope:g} a coded unit; {size:.2f} times as large"
        yield Figure("region of a moved surface", case, 0.95, EXACT, float(found[:, 0].mean()), len(found))


def one(rng: Generator, count: int, runs: int, slope: float) -> tuple[bool, float, float] | None:
    """Draw a twin: is it inside, the share of the region, and that share with the whole design at its scale.

    None where the surface of the cheaper scale shows no term.
    """
    design = central_composite([Factor(name, 0.0, 1.0) for name in "EFG"[:count]], "rotatable", 6)
    points = design.points.to_numpy()
    lines, bends = rng.normal([4.0, 0.0, 0.0][:count], 3.0), rng.normal(0.0, 0.5, (count, count))
    shift, scale, apart = rng.normal(0.0, 1.0), rng.normal(1.0, 0.15), rng.normal(0.0, slope, count)

    def cheap(x: Cells) -> Cells:
        return np.asarray(x @ lines + np.einsum("ij,jk,ik->i", x, bends, x))

    def own(x: Cells, noise: float = OWN) -> Cells:
        return shift + scale * cheap(x) + x @ apart + rng.normal(0.0, noise, len(x))

    source = fit_surface(design, cheap(points) + rng.normal(0.0, CHEAP, len(points))).reduce()
    if not source.terms:
        return None
    hidden = rng.uniform(-1.0, 1.0, (1, count))
    target = Sample.of(own(np.repeat(hidden, MEASURED, axis=0)))
    moved = moved_surface(design, source, target, own, runs)
    values = zip(design.factors, hidden[0], strict=True)
    natural = {factor.name: float(factor.to_natural(value)) for factor, value in values}
    whole = fit_surface(design, own(points))
    shares = [len(inside(fit, target, design)) for fit in (moved, whole)]
    return moved.agrees(natural, target), shares[0], max(shares[1], 1)


def moved_surface(
    design: Design, source: Surface, target: Sample, own: Callable[[Cells], Cells], runs: int
) -> Transfer:
    """Move a surface by runs in two rounds, as a campaign does."""
    made, values = np.zeros((0, len(design.names))), np.zeros(0)
    cells = inside(source, Sample(0.0, 1e6, 2), design)
    first = max(runs // 2, LEAST + len(design.names))
    for count in (first, runs - first):
        points = spread_points(source, cells, count, made)
        made, values = np.vstack([made, points]), np.append(values, own(points))
        table = natural_points(design.factors, pd.DataFrame(made, columns=design.names))
        moved = transfer(source, table, values, target.mean, slopes=True)
        near = inside(moved, target, design)
        cells = near if len(near) else cells
    return moved


def inside(fit: Surface | Transfer, target: Sample, design: Design) -> Cells:
    """Cells that are compatible, coded, (cells, factors)."""
    extent = float(np.abs(design.points.to_numpy()).max())
    radius = float(np.linalg.norm(design.points, axis=1).max()) * (1.0 + 1e-9)
    region = fit.compatible_region(
        target, extent=extent, resolution=RESOLUTION[len(design.names)], radius=radius
    )
    return np.asarray(region.coded.to_numpy()[region.mask])
