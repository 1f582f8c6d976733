"""Confidence region of a stationary point: the settings where the true gradient may vanish."""

import numpy as np
from scipy import stats

from doe.arguments import checked_kind, checked_level
from doe.design.polynomial_terms import Term
from doe.response.region import Region, box_cells
from doe.response.response_surface import Surface


def stationary_region(
    surface: Surface, alpha: float = 0.05, extent: float = 1.0, resolution: int | None = None
) -> Region:
    """Return the settings that may be the true stationary point (Box and Hunter 1954).

    Biometrika 41, p. 190. At the true point the k components of the gradient are zero. The fitted gradient
    d(x) has the covariance V(x) of its coefficients, so that d' V^-1 d <= k F(1 - alpha; k, residual df)
    holds there with probability 1 - alpha, exactly for normal errors and a true quadratic. The region may be
    open: it then runs to the edge of the box and on, which says that the runs do not settle the point.

    Parameters
    ----------
    surface : Surface
        Of second degree. After ``reduce``, the model before it gives the region.
    alpha : float
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
    # A setting at which a part of the gradient has no error (no term moves it) must have none of it either.
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
