"""Several responses together: the setting that they agree on best, where they agree, what stays open."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import optimize, stats

from doe.compare import Sample
from doe.errors import DesignError
from doe.factors import Factor
from doe.fitted import FittedSurface
from doe.region import Region, box_cells, misfit

PULL = 1e-3
"""Weight of the squared distance to the centre beside chi2: it chooses among settings that are as good."""

STARTS = 3
"""Cells from which the smallest chi2 is refined: the best ones of as many orthants."""


@dataclass(frozen=True)
class Goal:
    """One response: its fitted surface, and what was measured."""

    surface: FittedSurface
    target: Sample

    def __post_init__(self) -> None:
        if not self.target.sd > 0.0:
            raise DesignError(f"a response is weighed by its target's spread, received {self.target}")

    def misfit(self, coded: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
        """Return fit less target at coded points, its standard error and the degrees of freedom."""
        return misfit(self.surface, coded, self.target.mean, self.target.se, float(self.target.df))


@dataclass(frozen=True, eq=False)
class JointFit:
    """Responses fitted over the same factors, against their targets; made by ``joint_fit``.

    The region explored is the coded box -extent..+extent as far as the farthest run. There a setting is
    compatible with k responses when none of them differs from its target significantly at alpha / k
    (Bonferroni): so the true setting is compatible with probability 1 - alpha at least, where the models hold
    and however the errors of the responses hang together.
    """

    goals: Mapping[str, Goal]
    """Responses by name."""
    alpha: float
    extent: float
    radius: float
    """Coded distance of the farthest run from the centre."""
    cells: NDArray[np.float64]
    """Centers of the box's cells, coded, shape (cells, factors)."""
    resolution: int

    @property
    def factors(self) -> tuple[Factor, ...]:
        """What all surfaces are fitted over."""
        return next(iter(self.goals.values())).surface.design.factors

    @cached_property
    def explored(self) -> NDArray[np.bool_]:
        """Cells as near to the centre as the farthest run."""
        return np.linalg.norm(self.cells, axis=1) <= self.radius

    @cached_property
    def p(self) -> dict[str, NDArray[np.float64]]:
        """By response, the two-sided p value of no difference from its target, at every cell."""
        values = {}
        for name, goal in self.goals.items():
            difference, error, df = goal.misfit(self.cells)
            values[name] = 2.0 * stats.t.sf(np.abs(difference) / error, df)
        return values

    def region(self, *names: str) -> Region:
        """Return where some responses agree with their targets; without names, all of them."""
        return self._region(self._mask(names or tuple(self.goals)))

    def band(self, name: str) -> Region:
        """Return where one response agrees at the level that all share; all bands meet in ``region()``."""
        return self._region(self.explored & (self.p[name] >= self.alpha / len(self.goals)))

    def share(self, *names: str) -> float:
        """Return which part of the region explored is compatible with some responses (default: all)."""
        mask = self._mask(names or tuple(self.goals))
        return float(np.count_nonzero(mask) / np.count_nonzero(self.explored))

    @cached_property
    def coded_point(self) -> NDArray[np.float64]:
        """The setting with the smallest chi2; among several as good, the one nearest to the centre."""
        objective = sum(self._chi2(goal, self.cells) for goal in self.goals.values())
        objective = objective + PULL * np.sum(self.cells**2, axis=1)
        order = np.argsort(np.where(self.explored, objective, np.inf), kind="stable")
        orthant = (self.cells[order] > 0.0) @ 2 ** np.arange(len(self.factors))
        _, best = np.unique(orthant, return_index=True)
        found = [self._refined(self.cells[start]) for start in order[np.sort(best)[:STARTS]]]
        return min(found, key=self._objective)

    @property
    def point(self) -> dict[str, float]:
        """The same setting in natural units."""
        return {f.name: float(f.to_natural(x)) for f, x in zip(self.factors, self.coded_point, strict=True)}

    def tests(self, point: Mapping[str, float] | None = None) -> pd.DataFrame:
        """Compare every response with its target at a point.

        Parameters
        ----------
        point : mapping of natural values by factor, optional
            Default: the setting with the smallest chi2.

        Returns
        -------
        DataFrame, index ``response``
            fitted (mean), fitted_se, target, target_se, t (of the difference), df, p, agrees (p is not below
            alpha over the number of responses).
        """
        coded = self.coded_point if point is None else self._coded(point)
        rows = {}
        for name, goal in self.goals.items():
            mean, se = (values[0] for values in goal.surface.evaluate(coded))
            difference, error, df = (values[0] for values in goal.misfit(coded[None]))
            t = difference / error
            rows[name] = {
                "fitted": mean,
                "fitted_se": se,
                "target": goal.target.mean,
                "target_se": goal.target.se,
                "t": t,
                "df": df,
                "p": 2.0 * stats.t.sf(abs(t), df),
            }
        table = pd.DataFrame.from_dict(rows, orient="index").rename_axis("response")
        table["agrees"] = table["p"] >= self.alpha / len(self.goals)
        return table

    def agrees(self, point: Mapping[str, float] | None = None) -> bool:
        """Whether all responses agree with their targets at a point (default: that of the smallest chi2)."""
        return bool(self.tests(point)["agrees"].all())

    @cached_property
    def shrinkage(self) -> pd.DataFrame:
        """How the compatible region shrinks with each response: the first, then what shrinks it most.

        A response that tells nothing new makes it a little larger, as each is then held to a stricter level.

        Returns
        -------
        DataFrame, index ``response`` in the order of adding
            share (of the region explored that is compatible with this and those before), ratio (to the share
            before), alone (share with this response alone), with_first (share with the first and this).
        """
        rows = {}
        for added in self._order():
            share, before = self.share(*added), self.share(*added[:-1]) if len(added) > 1 else 1.0
            name, first = added[-1], added[0]
            rows[name] = {
                "share": share,
                "ratio": share / before if before > 0.0 else np.nan,
                "alone": self.share(name),
                "with_first": self.share(*dict.fromkeys((first, name))),
            }
        return pd.DataFrame.from_dict(rows, orient="index").rename_axis("response")

    @cached_property
    def directions(self) -> pd.DataFrame:
        """Directions of the factors by how well the responses together pin them down, the best first.

        They are the eigenvectors of the Fisher information at the point of the smallest chi2,
        sum of g g' / s^2 over the responses with the gradient g of the fitted mean and the error s of its
        difference from the target, all in coded units.

        Returns
        -------
        DataFrame, index ``direction`` from 1
            A column for each factor (the unit vector, its largest component positive), half_width (of the
            1 - alpha interval along it, coded; infinite where no response changes), span (of the compatible
            region along it, over that of the region explored; 0 where nothing is compatible).
        """
        slopes = []
        for goal in self.goals.values():
            _, error, _ = goal.misfit(self.coded_point[None])
            slopes.append(goal.surface.quadratic_form.gradient(self.coded_point) / error[0])
        information = np.transpose(slopes) @ np.array(slopes)
        values, vectors = np.linalg.eigh(information)
        values, vectors = values[::-1], vectors[:, ::-1]
        # Rounding leaves eigenvalues of either sign where there is no information at all.
        values = np.where(values > 1e-12 * max(values[0], np.finfo(float).tiny), values, 0.0)
        largest = np.abs(vectors).argmax(axis=0)
        vectors = vectors * np.sign(vectors[largest, range(len(values))])
        with np.errstate(divide="ignore"):
            half_width = stats.norm.isf(0.5 * self.alpha) / np.sqrt(values)
        index = pd.RangeIndex(1, len(values) + 1, name="direction")
        table = pd.DataFrame(vectors.T, columns=[factor.name for factor in self.factors], index=index)
        return table.assign(half_width=half_width, span=[self._span(vector) for vector in vectors.T])

    def _mask(self, names: tuple[str, ...]) -> NDArray[np.bool_]:
        """Return the cells where some responses agree at the level that these share."""
        level = self.alpha / len(names)
        return self.explored & np.all([self.p[name] >= level for name in names], axis=0)

    def _region(self, mask: NDArray[np.bool_]) -> Region:
        table = pd.DataFrame(self.cells, columns=[factor.name for factor in self.factors])
        return Region(self.factors, table, mask, self.resolution, self.extent, self.explored)

    def _span(self, direction: NDArray[np.float64]) -> float:
        """Return the compatible region's shadow on a direction, over that of the region explored."""
        shadow = self.cells @ direction
        belonging = shadow[self._mask(tuple(self.goals))]
        return float(np.ptp(belonging) / np.ptp(shadow[self.explored])) if belonging.size else 0.0

    def _order(self) -> Iterator[tuple[str, ...]]:
        """Return the responses so far, from the first on, each time with the one that shrinks most."""
        added, *left = self.goals
        chosen: tuple[str, ...] = (added,)
        yield chosen
        while left:
            best = min(left, key=lambda name: self.share(*chosen, name))
            left.remove(best)
            chosen = (*chosen, best)
            yield chosen

    def _coded(self, point: Mapping[str, float]) -> NDArray[np.float64]:
        return np.array([float(factor.to_coded(float(point[factor.name]))) for factor in self.factors])

    def _chi2(self, goal: Goal, coded: NDArray[np.float64]) -> NDArray[np.float64]:
        difference, error, _ = goal.misfit(coded)
        return (difference / error) ** 2

    def _objective(self, coded: NDArray[np.float64]) -> float:
        chi2 = sum(float(self._chi2(goal, coded[None])[0]) for goal in self.goals.values())
        return chi2 + PULL * float(coded @ coded)

    def _refined(self, start: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the smallest chi2 of the region explored, searched from a cell; the cell if none is less."""
        inside = {"type": "ineq", "fun": lambda x: self.radius**2 - x @ x, "jac": lambda x: -2.0 * x}
        bounds = [(-self.extent, self.extent)] * len(start)
        options = {"ftol": 1e-12, "maxiter": 200}
        result = optimize.minimize(
            self._objective, start, method="SLSQP", bounds=bounds, constraints=inside, options=options
        )
        better = result.success and self._objective(result.x) <= self._objective(start)
        return result.x if better else start


def joint_fit(goals: Mapping[str, Goal], alpha: float = 0.05, resolution: int | None = None) -> JointFit:
    """Fit several responses together: chi2 = sum of ((fit - target) / error)^2 over the responses.

    The error of a response is that of its fit and that of its target together.

    Parameters
    ----------
    goals : mapping of Goal by name
        Surfaces over the same factors in the same coding, the first response first.
    alpha : float
        1 - alpha is the level of the compatible region.
    resolution : int, optional
        Cells along each factor.

    Raises
    ------
    DesignError
        No response, surfaces over other factors, or a target without a spread.
    """
    if not goals:
        raise DesignError("a joint fit needs at least one response, received none")
    designs = {name: goal.surface.design for name, goal in goals.items()}
    first, design = next(iter(designs.items()))
    for name, other in designs.items():
        if other.factors != design.factors:
            raise DesignError(
                f"responses are fitted together over the same factors: {first!r} has {design.factors}, "
                f"{name!r} has {other.factors}"
            )
    runs = np.vstack([other.points.to_numpy(dtype=np.float64) for other in designs.values()])
    extent = float(np.abs(runs).max())
    radius = float(np.linalg.norm(runs, axis=1).max()) * (1.0 + 1e-9)  # the farthest run itself is inside
    cells, count = box_cells(len(design.factors), extent, resolution)
    return JointFit(dict(goals), alpha, extent, radius, cells, count)
