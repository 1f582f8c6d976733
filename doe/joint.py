"""Several responses together: the setting that they agree on best, where they agree, what stays open."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import optimize

from doe.checks import checked_count, checked_level, checked_number
from doe.compare import Sample
from doe.errors import DesignError
from doe.factors import Factor
from doe.fitted import FittedSurface, unselected
from doe.region import Region, box_cells, misfit
from doe.two_errors import TwoErrors

Misfit = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], TwoErrors]

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
        for place, wanted in (("design", "a fitted surface"), ("evaluate", "a fitted surface")):
            if not hasattr(self.surface, place):
                raise DesignError(f"a goal's surface is {wanted}, received {self.surface!r}")
        if not isinstance(self.target, Sample):
            raise DesignError(f"a goal's target is a Sample (mean, sd, n), received {self.target!r}")
        if not self.target.sd > 0.0:
            raise DesignError(f"a response is weighed by its target's spread, received {self.target}")

    @property
    def fit(self) -> FittedSurface:
        """The surface before the data chose its terms: its errors hold (``doe.Surface.unselected``)."""
        return unselected(self.surface)

    def misfit(self, coded: NDArray[np.float64]) -> Misfit:
        """Return fit less target at coded points, its standard error and the shares of the two errors."""
        return misfit(self.surface, coded, self.target.mean, self.target.se, float(self.target.df))

    def accepts(self, found: Misfit, alpha: float) -> NDArray[np.bool_]:
        """Return where fit and target do not differ significantly at a level."""
        difference, error, share, errors = found
        return np.abs(difference) <= errors.critical(share, alpha) * error


@dataclass(frozen=True, eq=False)
class JointFit:
    """Responses fitted over the same factors, against their targets; made by ``joint_fit``.

    The region explored is the coded box -extent..+extent as far as the farthest run. There a setting is
    compatible with k responses when none of them differs from its target significantly at alpha / k
    (Bonferroni; ``doe.region.compatible_region`` has the rule for one): so the true setting is compatible
    with probability 1 - alpha at least, where the models hold and however the errors of the responses hang
    together. Surfaces whose terms the data chose count as they were before the choice.
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
        """Factors that all surfaces are fitted over."""
        return next(iter(self.goals.values())).surface.design.factors

    @cached_property
    def explored(self) -> NDArray[np.bool_]:
        """Cells as near to the centre as the farthest run."""
        return np.linalg.norm(self.cells, axis=1) <= self.radius

    @cached_property
    def misfits(self) -> dict[str, Misfit]:
        """By response, how far fit and target differ at every cell."""
        return {name: goal.misfit(self.cells) for name, goal in self.goals.items()}

    def region(self, *names: str) -> Region:
        """Return where some responses agree with their targets; without names, all of them."""
        return self._region(self._mask(names or tuple(self.goals)))

    def band(self, name: str) -> Region:
        """Return where one response agrees at the level that all share; all bands meet in ``region()``."""
        self._check_names((name,))
        level = self.alpha / len(self.goals)
        return self._region(self.explored & self.goals[name].accepts(self.misfits[name], level))

    def share(self, *names: str) -> float:
        """Return which part of the region explored is compatible with some responses (default: all)."""
        mask = self._mask(names or tuple(self.goals))
        return float(np.count_nonzero(mask) / np.count_nonzero(self.explored))

    @cached_property
    def coded_point(self) -> NDArray[np.float64]:
        """The setting with the smallest chi2; among several as good, the one nearest to the centre."""
        objective = sum(self._chi2(found) for found in self.misfits.values())
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
            fitted (mean), fitted_se, target, target_se, t (of the difference), df (Welch and
            Satterthwaite's), p (the level from which on the difference is significant), agrees (p is not
            below alpha over the number of responses).
        """
        coded = self.coded_point if point is None else self._coded(point)
        level = self.alpha / len(self.goals)
        rows = {}
        for name, goal in self.goals.items():
            found = goal.misfit(coded[None])
            difference, error, share = (float(values[0]) for values in found[:3])
            mean, se = (float(values[0]) for values in goal.fit.evaluate(coded[None]))
            rows[name] = {
                "fitted": mean,
                "fitted_se": se,
                "target": goal.target.mean,
                "target_se": goal.target.se,
                "t": difference / error,
                "df": float(found[3].df(share)),
                "p": found[3].p(difference / error, share),
                "agrees": bool(goal.accepts(found, level)[0]),
            }
        return pd.DataFrame.from_dict(rows, orient="index").rename_axis("response")

    def agrees(self, point: Mapping[str, float] | None = None) -> bool:
        """Tell if all responses agree with their targets at a point (default: that of the smallest chi2)."""
        coded = self.coded_point if point is None else self._coded(point)
        level = self.alpha / len(self.goals)
        return all(bool(goal.accepts(goal.misfit(coded[None]), level)[0]) for goal in self.goals.values())

    @cached_property
    def shrinkage(self) -> pd.DataFrame:
        """Shares of the compatible region left by each response: the first, then what shrinks it most.

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
            A column for each factor (the unit vector, its largest component positive), half_width (coded;
            infinite where no response changes, NaN where nothing is compatible), span (of the compatible
            region along it, over that of the region explored; 0 where nothing is compatible).

            The true setting lies within half_width of the point along the direction with probability
            1 - alpha at least, where the surfaces are straight that far: it is how far the settings reach
            with which no response differs significantly at alpha / k, so that it holds for every direction
            at once, though the data chose them.
        """
        slopes, limits = [], []
        for goal in self.goals.values():
            difference, error, share, errors = goal.misfit(self.coded_point[None])
            slopes.append(goal.fit.quadratic_form.gradient(self.coded_point) / error[0])
            reach = float(errors.critical(share, self.alpha / len(self.goals))[0])
            limits.append((-reach - difference[0] / error[0], reach - difference[0] / error[0]))
        information = np.transpose(slopes) @ np.array(slopes)
        values, vectors = np.linalg.eigh(information)
        values, vectors = values[::-1], vectors[:, ::-1]
        # Rounding leaves eigenvalues of either sign where there is no information at all.
        values = np.where(values > 1e-12 * max(values[0], np.finfo(float).tiny), values, 0.0)
        largest = np.abs(vectors).argmax(axis=0)
        vectors = vectors * np.sign(vectors[largest, range(len(values))])
        half_width = [
            _reach(vector, np.array(slopes), np.array(limits)) if value > 0.0 else np.inf
            for vector, value in zip(vectors.T, values, strict=True)
        ]
        index = pd.RangeIndex(1, len(values) + 1, name="direction")
        table = pd.DataFrame(vectors.T, columns=[factor.name for factor in self.factors], index=index)
        return table.assign(half_width=half_width, span=[self._span(vector) for vector in vectors.T])

    def _mask(self, names: tuple[str, ...]) -> NDArray[np.bool_]:
        """Return the cells where some responses agree at the level that these share."""
        self._check_names(names)
        level = self.alpha / len(names)
        return self.explored & np.all(
            [self.goals[name].accepts(self.misfits[name], level) for name in names], axis=0
        )

    def _check_names(self, names: tuple[str, ...]) -> None:
        unknown = [name for name in names if name not in self.goals]
        if unknown:
            raise DesignError(f"no response is named {unknown[0]!r}; the fit has {', '.join(self.goals)}")

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
        missing = [factor.name for factor in self.factors if factor.name not in point]
        if missing:
            raise DesignError(f"no value for factor {missing[0]!r} in the point {dict(point)}")
        values = {f: checked_number(f"the point's value of {f.name!r}", point[f.name]) for f in self.factors}
        return np.array([float(factor.to_coded(value)) for factor, value in values.items()])

    def _chi2(self, found: Misfit) -> NDArray[np.float64]:
        return (found[0] / found[1]) ** 2

    def _objective(self, coded: NDArray[np.float64]) -> float:
        chi2 = sum(float(self._chi2(goal.misfit(coded[None]))[0]) for goal in self.goals.values())
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


def _reach(direction: NDArray[np.float64], slopes: NDArray[np.float64], limits: NDArray[np.float64]) -> float:
    """Return how far a direction leads from the origin to both sides within linear limits; NaN if none is."""
    rows = np.vstack([slopes, -slopes])
    bounds = np.concatenate([limits[:, 1], -limits[:, 0]])
    ends = []
    for sign in (1.0, -1.0):
        found = optimize.linprog(-sign * direction, A_ub=rows, b_ub=bounds, bounds=(None, None))
        if found.status == 3:
            return np.inf
        if not found.success:
            return np.nan
        ends.append(abs(float(direction @ found.x)))
    return max(ends)


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
    if not isinstance(goals, Mapping) or not goals:
        received = "none" if isinstance(goals, Mapping) else repr(goals)
        raise DesignError(f"a joint fit needs at least one response by its name, received {received}")
    for name, goal in goals.items():
        if not isinstance(goal, Goal):
            raise DesignError(f"response {name!r} of a joint fit is a Goal, received {goal!r}")
    checked_level(alpha)
    if resolution is not None:
        checked_count("resolution", resolution)
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
