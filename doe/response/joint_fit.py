"""Several responses together: their best common setting, their agreement, and what stays open."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import optimize

from doe.arguments import checked_count, checked_level
from doe.design.design import coded_setting
from doe.design.factors import Factor
from doe.errors import DesignError
from doe.response.quadratic import FittedSurface, unselected
from doe.response.region import Region, box_cells, misfit
from doe.response.response_surface import Surface
from doe.samples.sample import Sample
from doe.samples.simultaneous import Simultaneous
from doe.samples.two_errors import TwoErrors

Misfit = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], TwoErrors]

NODES = 5
"""Cells at which the level of several responses is found."""

PULL = 1e-3
"""Weight of the squared distance to the centre added to chi2: it decides among equally good settings."""

STARTS = 3
"""Cells from which the smallest chi2 is refined: the best ones of different orthants."""


@dataclass(frozen=True)
class Goal:
    """One response: its fitted surface, and its measured target."""

    surface: FittedSurface
    target: Sample

    def __post_init__(self) -> None:
        if not (hasattr(self.surface, "design") and hasattr(self.surface, "evaluate")):
            raise DesignError(f"a goal's surface must be a fitted surface, got {self.surface!r}")
        if not isinstance(self.target, Sample):
            raise DesignError(f"a goal's target must be a Sample (mean, sd, n), got {self.target!r}")
        if not self.target.sd > 0.0:
            raise DesignError(f"a goal's target must have a spread, got {self.target}")

    @property
    def fit(self) -> FittedSurface:
        """The surface before the data chose its terms: its errors hold (``doe.Surface.unselected``)."""
        return unselected(self.surface)

    def misfit(self, coded: NDArray[np.float64]) -> Misfit:
        """Return fit less target at coded points, its standard error and the shares of the two errors."""
        return misfit(self.surface, coded, self.target.mean, self.target.se, float(self.target.df))


@dataclass(frozen=True, eq=False)
class JointFit:
    """Responses fitted over the same factors, with their targets; made by ``joint_fit``.

    The region explored is the coded box -extent..+extent up to the distance of the farthest run. There a
    setting is compatible with several responses when none differs from its target significantly, at the level
    of each at which all together hold alpha (``level``; ``doe.response.region.compatible_region`` has the
    rule for one). That level is above alpha over their number where the errors of the fits are correlated, as
    in responses of the same runs. The targets are independent measurements. So the true setting is compatible
    with probability 1 - alpha, where the models hold: .94 to .96 for .95 with 3 measurements of each target
    or more; with 2 at least .94, up to .995. Surfaces whose terms the data chose count as they were before
    the choice.
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
        """Differences of fit and target at every cell, by response."""
        return {name: goal.misfit(self.cells) for name, goal in self.goals.items()}

    def region(self, *names: str) -> Region:
        """Return the agreement of some responses with their targets; without names, of all of them."""
        return self._region(self._mask(names or tuple(self.goals)))

    def band(self, name: str) -> Region:
        """Return the agreement of one response at the common level; all bands meet in ``region()``."""
        self._check_names((name,))
        place = list(self.goals).index(name)
        return self._region(self.explored & self._accepted(tuple(self.goals), self.misfits)[:, place])

    def share(self, *names: str) -> float:
        """Return the share of the explored region that is compatible with some responses (default: all)."""
        mask = self._mask(names or tuple(self.goals))
        return float(np.count_nonzero(mask) / np.count_nonzero(self.explored))

    def level(self, point: Mapping[str, float] | None = None) -> float:
        """Return the level of each response's test at which all together hold alpha at a point (drawn)."""
        first = self._first(tuple(self.goals), self._misfits_at(self._coded(point)))
        return float(self._together(tuple(self.goals)).levels(first)[0])

    @cached_property
    def coded_point(self) -> NDArray[np.float64]:
        """Setting with the smallest chi2; among several equally good, the one nearest to the centre."""
        objective = sum(map(self._chi2, self.misfits.values())) + PULL * np.sum(self.cells**2, axis=1)
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
        """Compare every response with its target at a point (default: that of the smallest chi2).

        Returns
        -------
        DataFrame, index ``response``
            fitted (mean), fitted_se, target, target_se, t (of the difference), df (Welch and
            Satterthwaite's), p (the level from which on the difference is significant), agrees (p is not
            below ``level``).
        """
        coded = self._coded(point)
        every = self._misfits_at(coded)
        agreed = self._accepted(tuple(self.goals), every)[0]
        rows = {}
        for (name, goal), agrees in zip(self.goals.items(), agreed, strict=True):
            found = every[name]
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
                "agrees": bool(agrees),
            }
        return pd.DataFrame.from_dict(rows, orient="index").rename_axis("response")

    def agrees(self, point: Mapping[str, float] | None = None) -> bool:
        """Return True if all responses agree with their targets at a point (default: the smallest chi2)."""
        return bool(self._accepted(tuple(self.goals), self._misfits_at(self._coded(point))).all())

    def without(self, name: str) -> "JointFit":
        """Return the joint fit of the other responses, over the same region."""
        self._check_names((name,))
        return replace(self, goals={other: goal for other, goal in self.goals.items() if other != name})

    def conflict(self, name: str) -> tuple[float, float]:
        """Return by how many standard errors the other responses disagree with one, and the p value of that.

        The first is the root of what the response adds to the smallest chi2 of the region explored. It is 0
        where the others leave open what the response is about.
        """
        others = self.without(name)
        added = self._smallest_chi2 - others._smallest_chi2
        found, size = self.goals[name].misfit(self.coded_point[None]), float(np.sqrt(max(added, 0.0)))
        return size, found[3].p(size, float(found[2][0]))

    @cached_property
    def shrinkage(self) -> pd.DataFrame:
        """Share of the compatible region after each response: the first, then the one that shrinks it most.

        A response without new information makes it a little larger, as each then has a stricter level.

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
    def intervals(self) -> pd.DataFrame:
        """Interval of each factor by itself: it holds the true value with a probability of 1 - alpha or more.

        A value belongs when the smallest chi2 with it, the others free, is above the smallest of all by no
        more than errors explain (``doe.samples.simultaneous``). ``region().ranges`` hold for all together.

        Returns
        -------
        DataFrame, index ``factor``
            value (of the smallest chi2), low, high, low_open, high_open (at an edge of what was explored).
        """
        rows = {}
        for factor, unit in zip(self.factors, np.eye(len(self.factors)), strict=True):
            found = self._region(self._near(unit))
            ends, edges = found.ranges.loc[factor.name], found.open_ends.loc[factor.name]
            rows[factor.name] = {"value": self.point[factor.name], **ends, **edges.add_suffix("_open")}
        return pd.DataFrame.from_dict(rows, orient="index").rename_axis("factor")

    @cached_property
    def directions(self) -> pd.DataFrame:
        """Directions of the factors by how well the responses together determine them, the best first.

        They are the eigenvectors of the Fisher information at the point of the smallest chi2, sum of g g' /
        s^2 over the responses with the gradient g of the fitted mean and the error s of its difference from
        the target, in coded units.

        Returns
        -------
        DataFrame, index ``direction`` from 1
            A column for each factor (the unit vector, its largest component positive), span (of the
            interval along it, made as those of the factors, over that of the region explored).
        """
        every = self._misfits_at(self.coded_point)
        slopes = self._slopes / np.array([[float(found[1][0])] for found in every.values()])
        vectors = np.linalg.eigh(slopes.T @ slopes)[1][:, ::-1]
        vectors = vectors * np.sign(vectors[np.abs(vectors).argmax(axis=0), range(len(vectors))])
        index = pd.RangeIndex(1, len(vectors) + 1, name="direction")
        table = pd.DataFrame(vectors.T, columns=[factor.name for factor in self.factors], index=index)
        return table.assign(span=[self._span(vector) for vector in vectors.T])

    @cached_property
    def _slopes(self) -> NDArray[np.float64]:
        """Gradients of the fitted means at the smallest chi2, coded, shape (responses, factors)."""
        return np.array([g.fit.quadratic_form.gradient(self.coded_point) for g in self.goals.values()])

    def _mask(self, names: tuple[str, ...]) -> NDArray[np.bool_]:
        """Return the cells where some responses agree, by their common level."""
        self._check_names(names)
        return self.explored & self._accepted(names, self.misfits).all(axis=1)

    def _accepted(self, names: tuple[str, ...], every: Mapping[str, Misfit]) -> NDArray[np.bool_]:
        """Return which responses agree, for given misfits, shape (points, responses)."""
        difference = np.column_stack([every[name][0] for name in names])
        return self._together(names).accepted(difference, self._first(names, every))

    def _together(self, names: tuple[str, ...]) -> Simultaneous:
        """Return the joint test of some responses, its level found at small, medium and large errors."""
        if names not in self._tests:
            places = [list(self.goals).index(name) for name in names]
            first = self._first(names, self.misfits)[self.explored]
            order = np.argsort(first.sum(axis=1), kind="stable")
            self._tests[names] = Simultaneous(
                [self.misfits[name][3] for name in names],
                np.array([self.goals[name].target.se ** 2 for name in names]),
                self._correlation[np.ix_(places, places)],
                first[order[np.linspace(0, len(order) - 1, NODES).astype(int)]],
                self.alpha,
            )
        return self._tests[names]

    @cached_property
    def _tests(self) -> dict[tuple[str, ...], Simultaneous]:
        return {}

    @cached_property
    def _correlation(self) -> NDArray[np.float64]:
        """Correlation of the residuals of responses that were fitted to the same runs, else 0."""
        fits = [unselected(getattr(goal.fit, "source", goal.fit)) for goal in self.goals.values()]
        matrix = np.eye(len(fits))
        for (i, one), (j, other) in combinations(enumerate(fits), 2):
            if isinstance(one, Surface) and isinstance(other, Surface) and one.points.equals(other.points):
                matrix[i, j] = matrix[j, i] = np.corrcoef(one.residuals, other.residuals)[0, 1]
        return matrix

    def _first(self, names: tuple[str, ...], every: Mapping[str, Misfit]) -> NDArray[np.float64]:
        """Return the variances of the fitted means behind misfits, shape (points, responses)."""
        return np.column_stack([every[name][1] ** 2 * (1.0 - every[name][2]) for name in names])

    def _misfits_at(self, coded: NDArray[np.float64]) -> dict[str, Misfit]:
        return {name: goal.misfit(coded[None]) for name, goal in self.goals.items()}

    def _check_names(self, names: tuple[str, ...]) -> None:
        unknown = [name for name in names if name not in self.goals]
        if unknown:
            raise DesignError(f"no response is named {unknown[0]!r}; the fit has {', '.join(self.goals)}")

    def _region(self, mask: NDArray[np.bool_]) -> Region:
        table = pd.DataFrame(self.cells, columns=[factor.name for factor in self.factors])
        return Region(self.factors, table, mask, self.resolution, self.extent, self.explored)

    def _span(self, direction: NDArray[np.float64]) -> float:
        """Return the extent of the interval along a direction, over that of the region explored."""
        shadow = self.cells @ direction
        return float(np.ptp(shadow[self._near(direction)]) / np.ptp(shadow[self.explored]))

    def _near(self, direction: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return the cells whose chi2 exceeds the smallest by no more than errors explain, in a direction."""
        first = self._first(tuple(self.goals), self._misfits_at(self.coded_point))[0]
        added = self._together(tuple(self.goals)).added(self._slopes, direction, first)
        near = self.explored & (sum(map(self._chi2, self.misfits.values())) <= self._smallest_chi2 + added)
        near[np.linalg.norm(self.cells - self.coded_point, axis=1).argmin()] = True
        return near

    def _order(self) -> Iterator[tuple[str, ...]]:
        """Yield the responses so far, from the first on, each time with the one that shrinks most."""
        first, *left = self.goals
        chosen: tuple[str, ...] = (first,)
        yield chosen
        while left:
            best = min(left, key=lambda name: self.share(*chosen, name))
            left.remove(best)
            chosen = (*chosen, best)
            yield chosen

    def _coded(self, point: Mapping[str, float] | None) -> NDArray[np.float64]:
        """Return a point in coded units: that of the smallest chi2 unless one is given."""
        return self.coded_point if point is None else coded_setting("the point", point, self.factors)

    @property
    def _smallest_chi2(self) -> float:
        return self._objective(self.coded_point, pull=0.0)

    def _chi2(self, found: Misfit) -> NDArray[np.float64]:
        return (found[0] / found[1]) ** 2

    def _objective(self, coded: NDArray[np.float64], pull: float = PULL) -> float:
        chi2 = sum(float(self._chi2(found)[0]) for found in self._misfits_at(coded).values())
        return chi2 + pull * float(coded @ coded)

    def _refined(self, start: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the smallest chi2 of the region explored, searched from a cell, or that cell."""
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
    if not isinstance(goals, Mapping) or not goals:
        received = "none" if isinstance(goals, Mapping) else repr(goals)
        raise DesignError(f"goals must be at least one response by its name, got {received}")
    for name, goal in goals.items():
        if not isinstance(goal, Goal):
            raise DesignError(f"response {name!r} of a joint fit must be a Goal, got {goal!r}")
    checked_level(alpha)
    if resolution is not None:
        checked_count("resolution", resolution)
    designs = {name: goal.surface.design for name, goal in goals.items()}
    first, design = next(iter(designs.items()))
    for name, other in designs.items():
        if other.factors != design.factors:
            rule = f"responses must have the same factors: {first!r} has {design.factors}, "
            raise DesignError(f"{rule}{name!r} has {other.factors}")
    runs = np.vstack([other.points.to_numpy(dtype=np.float64) for other in designs.values()])
    extent = float(np.abs(runs).max())
    radius = float(np.linalg.norm(runs, axis=1).max()) * (1.0 + 1e-9)  # the farthest run itself is inside
    cells, count = box_cells(len(design.factors), extent, resolution)
    return JointFit(dict(goals), alpha, extent, radius, cells, count)
