"""Canonical and ridge analysis: the shape of a quadratic surface, and the best points on spheres about it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import optimize, stats

from doe.arguments import checked_flag, checked_kind, checked_level, real_array
from doe.design.design import natural_points
from doe.design.polynomial_terms import Term, term_name
from doe.errors import DesignError
from doe.response.quadratic import QuadraticForm
from doe.response.region import Region, box_cells
from doe.response.response_surface import Surface
from doe.response.surface_points import StationaryPoint

FAR = 2.0
"""Coded distance beyond which a stationary point is out of range of the runs, which reach 1 to 2."""


@dataclass(frozen=True, eq=False)
class CanonicalAnalysis:
    """A quadratic surface along its own axes; made by ``canonical``."""

    stationary: StationaryPoint
    axes: pd.DataFrame
    """Directions of the axes in coded units, a row for each factor and a column for each axis."""
    table: pd.DataFrame
    """Table by axis: curvature (eigenvalue), se, low, high (its interval), flat (the interval holds 0)."""
    notes: tuple[str, ...]
    """Warnings: a ridge, a stationary point far away."""

    def __str__(self) -> str:
        point = self.stationary
        where = ", ".join(f"{name} = {value:.4g}" for name, value in point.natural.items())
        lines = [f"{point.kind.capitalize()} at {where} with a fitted response of {point.mean:.5g}."]
        for axis, row in self.table.iterrows():
            direction = ", ".join(f"{value:+.2f} {name}" for name, value in self.axes[axis].items())
            lines.append(
                f"{axis} ({direction}): curvature {row['curvature']:.4g}, "
                f"{row['low']:.4g} to {row['high']:.4g}"
            )
        return "\n".join([*lines, *self.notes])


def canonical(surface: Surface, alpha: float = 0.05) -> CanonicalAnalysis:
    """Return the canonical analysis of a fitted quadratic (Box and Wilson 1951).

    Along axis i the surface is mean + curvature_i w_i^2 from the stationary point. The curvatures' standard
    errors are those of Bisgaard and Ankenman (Technometrics 38, 1996, p. 238): curvature_i = v_i' B v_i with
    the axis held, which is linear in the coefficients. An interval that holds 0 is a ridge: along that axis
    the response hardly changes, and a stationary point far out on it is an effect of the noise.

    Parameters
    ----------
    surface : Surface
        Surface of second degree.
    alpha : float
        The intervals of the curvatures hold with probability 1 - alpha, each.

    Raises
    ------
    DesignError
        The fitted surface is exactly straight along some direction, or of a higher degree.
    """
    checked_level(alpha)
    checked_kind("surface", surface, Surface)
    form, names = surface.quadratic_form, surface.design.names
    stationary = surface.stationary_point()
    values, vectors = np.linalg.eigh(form.matrix)
    order = np.argsort(-np.abs(values), kind="stable")
    labels = [f"axis {number}" for number in range(1, len(names) + 1)]
    axes = pd.DataFrame(vectors[:, order], index=names, columns=labels)
    honest = surface.unselected
    se = np.array([_curvature_error(honest, axes[label].to_numpy()) for label in labels])
    reach = float(stats.t.isf(0.5 * alpha, honest.residual_df)) * se
    low, high = values[order] - reach, values[order] + reach
    flat = (low <= 0.0) & (high >= 0.0)
    columns = {"curvature": values[order], "se": se, "low": low, "high": high, "flat": flat}
    notes = [
        f"Ridge: along {label} the curvature may be 0: the surface is a ridge there, and the "
        "stationary point is poorly known in that direction."
        for label in np.array(labels)[flat]
    ]
    distance = float(np.linalg.norm(stationary.coded))
    if distance > FAR:
        notes.append(
            f"The stationary point is {distance:.2g} coded units from the center, beyond the runs: "
            "follow the ridge path instead."
        )
    return CanonicalAnalysis(stationary, axes, pd.DataFrame(columns, index=labels), tuple(notes))


def ridge_path(
    surface: Surface, radii: Sequence[float] | NDArray[np.floating], *, descend: bool = False
) -> pd.DataFrame:
    """Return the best point on each sphere about the design's center (Hoerl 1959; Draper 1963).

    On the sphere of coded radius r the largest response is where (B - mu I) x = -b / 2 with mu above every
    curvature, and there is one such mu for each r.

    Parameters
    ----------
    surface : Surface
        Surface of second degree.
    radii : sequence of float
        Coded, not negative.
    descend : bool
        Take the smallest response instead.

    Returns
    -------
    DataFrame, index ``radius``
        Coded settings, columns ``coded NAME``; natural ones by name; mean, se and the multiplier mu.

    Raises
    ------
    DesignError
        A radius that is negative or not finite; a surface without slope and curvature.
    """
    checked_kind("surface", surface, Surface)
    radii = real_array("radii", radii)
    if radii.ndim != 1 or not np.isfinite(radii).all() or (radii < 0.0).any() or radii.size == 0:
        raise DesignError(f"radii must be finite and not negative, got {radii.tolist()}")
    form = surface.quadratic_form
    sign = -1.0 if checked_flag("descend", descend) else 1.0
    rising = QuadraticForm(sign * form.constant, sign * form.slopes, sign * form.matrix)
    found = [_on_sphere(rising, float(radius)) for radius in radii]
    coded = pd.DataFrame([point for point, _ in found], columns=surface.design.names)
    mean, se = surface.evaluate(coded)
    table = coded.add_prefix("coded ").join(natural_points(surface.design.factors, coded))
    table = table.assign(mean=mean, se=se, multiplier=[sign * mu for _, mu in found])
    return table.set_axis(pd.Index(radii, name="radius"))


def _curvature_error(surface: Surface, direction: NDArray[np.float64]) -> float:
    """Return the standard error of v'Bv at a fixed direction v."""
    weights = pd.Series(0.0, index=surface.fit.params.index)
    places = {name: place for place, name in enumerate(surface.design.names)}
    for term in surface.terms:
        if len(term) == 2:
            weights[term_name(term)] = direction[places[term[0]]] * direction[places[term[1]]]
    vector = weights.to_numpy()
    return float(np.sqrt(max(vector @ surface.fit.cov_params().to_numpy() @ vector, 0.0)))


def _on_sphere(form: QuadraticForm, radius: float) -> tuple[NDArray[np.float64], float]:
    """Return the largest value's point on a sphere, and its multiplier mu."""
    values, vectors = np.linalg.eigh(form.matrix)
    slopes = -0.5 * vectors.T @ form.slopes
    scale = max(float(np.abs(values).max()), float(np.abs(slopes).max()))
    if scale == 0.0:
        raise DesignError("no ridge path: the fitted surface has no slope and no curvature")
    if radius == 0.0:
        return np.zeros(len(values)), np.inf

    def excess(gap: float) -> float:
        return float(np.linalg.norm(slopes / (values - values[-1] - gap))) - radius

    # as mu approaches the largest curvature the point goes to infinity, unless the slope along that axis
    # is zero: then the rest of the radius is spent on that axis, in either direction
    low = 1e-14 * scale
    if excess(low) <= 0.0:
        inner = np.zeros(len(values))
        off = values - values[-1] < -low
        inner[off] = slopes[off] / (values[off] - values[-1])
        inner[-1] = np.sqrt(max(radius**2 - float(inner @ inner), 0.0))
        return vectors @ inner, float(values[-1])
    high = float(np.linalg.norm(slopes)) / radius + 1e-12 * scale
    gap = optimize.brentq(excess, low, high, xtol=1e-300, rtol=8.9e-16, maxiter=500)
    return vectors @ (slopes / (values - values[-1] - gap)), float(values[-1] + gap)


def stationary_region(
    surface: Surface, alpha: float = 0.05, extent: float = 1.0, resolution: int | None = None
) -> Region:
    """Return the settings that may be the true stationary point.

    At the true point the k components of the gradient are zero. The fitted gradient d(x) has the covariance
    V(x) of its coefficients, so that d' V^-1 d <= k F(1 - alpha; k, residual df) holds there with probability
    1 - alpha, exactly for normal errors and a true quadratic (Box and Hunter, Biometrika 41, 1954, p. 190).
    The region may be open: it then extends beyond the box, and the runs do not determine the point.

    Parameters
    ----------
    surface : Surface
        Surface of second degree. After ``reduce``, the model before it gives the region.
    extent : float
        Coded half width of the box.
    resolution : int, optional
        Cells along each factor.
    """
    checked_level(alpha)
    checked_kind("surface", surface, Surface)
    honest = surface.unselected
    names = honest.design.names
    points, count = box_cells(len(names), extent, resolution)
    terms = honest.terms
    covariance = honest.fit.cov_params().to_numpy()[1 : len(terms) + 1, 1 : len(terms) + 1]
    weights = honest.coded_coefficients.to_numpy()[1:]
    jacobian = np.stack([_derivatives(points, terms, names.index(name), names) for name in names], axis=1)
    gradient = jacobian @ weights
    spread = np.einsum("pit,tu,pju->pij", jacobian, covariance, jacobian, optimize=True)
    # where a part of the gradient has no error (no term moves it), that part must be zero
    solved = np.einsum("pij,pj->pi", np.linalg.pinv(spread, hermitian=True), gradient)
    statistic = np.einsum("pi,pi->p", gradient, solved)
    limit = len(names) * stats.f.isf(alpha, len(names), honest.residual_df)
    table = honest.points.iloc[:0].reindex(range(len(points)))
    table[names] = points
    return Region(honest.design.factors, table, statistic <= limit, count, extent)


def _derivatives(points: np.ndarray, terms: tuple[Term, ...], place: int, names: list[str]) -> np.ndarray:
    """Return the derivative of every term by one factor at points, shape (points, terms)."""
    columns = []
    for term in terms:
        exponents = np.array([term.count(name) for name in names])
        power = exponents[place]
        if power == 0:
            columns.append(np.zeros(len(points)))
            continue
        exponents[place] -= 1
        columns.append(power * np.prod(points**exponents, axis=1))
    return np.column_stack(columns)
