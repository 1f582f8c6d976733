"""Single points of a surface: the nearest one on the target contour, and the stationary one."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import optimize

from doe.arguments import checked_number
from doe.design.design import coded_setting, natural_points
from doe.errors import DesignError, TargetError
from doe.response.contour import contour_points
from doe.response.quadratic import FittedSurface, QuadraticForm
from doe.response.region import box_cells

NEAREST_STARTS = 8
"""Points of the contour from which the nearest one is refined."""

FLAT_RATIO = 1e-9
"""Curvature relative to the largest coefficient below which a direction is straight."""


@dataclass(frozen=True, eq=False)
class StationaryPoint:
    """Point of zero gradient on a quadratic surface."""

    coded: pd.Series
    natural: pd.Series
    mean: float
    """Fitted response there."""
    kind: str
    """``"minimum"``, ``"maximum"`` or ``"saddle"``."""
    curvatures: NDArray[np.float64]
    """Eigenvalues of the quadratic form in coded units, ascending."""


def nearest(
    surface: FittedSurface, target: float, to: Mapping[str, float] | None = None, extent: float = 1.0
) -> pd.Series:
    """Return the point of the target contour with the smallest coded distance to a point, natural.

    Parameters
    ----------
    to : mapping of natural values by factor, optional
        Default: the design's center.
    extent : float
        Coded half width of the box of the point.

    Raises TargetError: the fitted surface does not reach the target in the box.
    """
    checked_number("target", target)
    checked_number("extent, the coded half width of the box,", extent, above=0.0)
    factors = surface.design.factors
    origin = np.zeros(len(factors)) if to is None else coded_setting("the point to be near to", to, factors)
    starts = contour_points(surface, target, extent, None).to_numpy()
    if not len(starts):
        mean, _ = surface.evaluate(box_cells(len(factors), extent)[0])
        raise TargetError(
            f"the fitted surface does not reach the target {target:g}: it runs from {mean.min():.4g} to "
            f"{mean.max():.4g} inside the coded box -{extent:g}..+{extent:g}"
        )
    order = np.argsort(np.linalg.norm(starts - origin, axis=1), kind="stable")[:NEAREST_STARTS]
    candidates = [_refined(surface.quadratic_form, target, starts[i], origin, extent) for i in order]
    best = min(candidates, key=lambda point: float(np.linalg.norm(point - origin)))
    return pd.Series({f.name: float(f.to_natural(x)) for f, x in zip(factors, best, strict=True)})


def stationary_point(surface: FittedSurface) -> StationaryPoint:
    """Return the point of zero gradient (canonical analysis, Box and Wilson 1951).

    Raises DesignError: the surface is straight along some direction, so that there is no single such point.
    """
    form = surface.quadratic_form
    curvatures, directions = np.linalg.eigh(form.matrix)
    scale = max(np.abs(curvatures).max(), np.abs(form.slopes).max())
    if np.abs(curvatures).min() <= FLAT_RATIO * scale:
        flat = zip(surface.design.names, directions[:, np.abs(curvatures).argmin()], strict=True)
        raise DesignError(
            "a stationary point requires curvature in every direction; the fitted surface is straight along "
            + ", ".join(f"{share:+.3g} {name}" for name, share in flat)
            + " (coded)"
        )
    point = np.linalg.solve(form.matrix, -0.5 * form.slopes)
    kind = "minimum" if curvatures.min() > 0.0 else "maximum" if curvatures.max() < 0.0 else "saddle"
    coded = pd.DataFrame([point], columns=surface.design.names)
    natural = natural_points(surface.design.factors, coded)
    return StationaryPoint(coded.iloc[0], natural.iloc[0], float(form.value(point)), kind, curvatures)


def _refined(
    form: QuadraticForm,
    target: float,
    start: NDArray[np.float64],
    origin: NDArray[np.float64],
    extent: float,
) -> NDArray[np.float64]:
    """Return the contour's point nearest to the origin, searched from a point of the contour."""

    def squared_distance(x: NDArray[np.float64]) -> float:
        return float((x - origin) @ (x - origin))

    settings: dict[str, Any] = {
        "jac": lambda x: 2.0 * (x - origin),
        "bounds": [(-extent, extent)] * len(start),
        "constraints": {"type": "eq", "fun": lambda x: form.value(x) - target, "jac": form.gradient},
        "method": "SLSQP",
        "options": {"ftol": 1e-15, "maxiter": 200},
    }
    result = optimize.minimize(squared_distance, start, **settings)
    solved = result.success and abs(form.value(result.x) - target) <= 1e-9 * max(1.0, abs(target))
    return result.x if solved else start
