"""Surfaces of a cheaper scale that a few runs move: is the hidden setting in the compatible region."""

from collections.abc import Iterator
from dataclasses import replace
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
from experiments.calibrate.fidelity_stage import further_runs
from experiments.evidence.accuracy.statistics.coverage import EXACT, Figure, generator
from experiments.studyfile.campaign import FidelitySettings

TWINS, RESOLUTION = 500, {2: 40, 3: 11}  # of each case; cells along each factor
CHEAP, OWN, MEASURED = 1.0, 0.7, 5  # standard deviations of a run at both scales; measurements of the target
STEPS = np.linspace(-2.5, 2.5, 6)  # of the climb, in half-ranges of the strongest factor

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

    None where the climb does not cross the target, or the hidden setting is outside the design.
    """
    lines, bends = rng.normal([4.0, 0.0, 0.0][:count], 3.0), rng.normal(0.0, 0.5, (count, count))
    shift, scale, apart = rng.normal(0.0, 1.0), rng.normal(1.0, 0.15), rng.normal(0.0, slope, count)

    def cheap(x: Cells) -> Cells:
        return np.asarray(x @ lines + np.einsum("ij,jk,ik->i", x, bends, x))

    def own(x: Cells, noise: float = OWN) -> Cells:
        return shift + scale * cheap(x) + x @ apart + rng.normal(0.0, noise, len(x))

    hidden = rng.uniform(-1.0, 1.0, (1, count))
    target = Sample.of(own(np.repeat(hidden, MEASURED, axis=0)))
    places = np.outer(STEPS, lines / np.abs(lines).max())
    climbed = own(places)
    error = climbed - target.mean
    crossed = np.flatnonzero(error[:-1] * error[1:] <= 0.0)
    if not len(crossed):
        return None
    first = crossed[0]
    center = places[first] + error[first] / (error[first] - error[first + 1]) * (places[1] - places[0])
    factors = [Factor.around(name, value, 1.0) for name, value in zip("EFG", center, strict=False)]
    design = central_composite(factors, "rotatable", 6)
    points = design.points.to_numpy()
    source = fit_surface(design, cheap(points + center) + rng.normal(0.0, CHEAP, len(points)))
    farthest = np.linalg.norm(points, axis=1).max() * (1.0 + 1e-9)
    if np.linalg.norm(hidden - center) > farthest:
        return None
    near = np.linalg.norm(places - center, axis=1) <= farthest
    level = float(source.evaluate(np.zeros((1, count)))[0][0])
    cells = inside(source, replace(target, mean=level), design)
    further = further_runs(FidelitySettings(scale="", runs=runs), len(STEPS), count)
    fresh = spread_points(source, cells, further, places[near] - center)
    table = pd.DataFrame(np.vstack([places[near], fresh + center]), columns=design.names)
    moved = transfer(source, table, np.append(climbed[near], own(fresh + center)), target.mean, slopes=True)
    natural = dict(zip(design.names, hidden[0].tolist(), strict=True))
    whole = fit_surface(design, own(points + center))
    shares = [len(inside(fit, target, design)) for fit in (moved, whole)]
    return moved.agrees(natural, target), shares[0], max(shares[1], 1)


def inside(fit: Surface | Transfer, target: Sample, design: Design) -> Cells:
    """Cells that are compatible, coded, (cells, factors)."""
    extent = float(np.abs(design.points.to_numpy()).max())
    radius = float(np.linalg.norm(design.points, axis=1).max()) * (1.0 + 1e-9)
    region = fit.compatible_region(
        target, extent=extent, resolution=RESOLUTION[len(design.names)], radius=radius
    )
    return np.asarray(region.coded.to_numpy()[region.mask])
