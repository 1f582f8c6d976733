"""Best settings: the largest or smallest response in a region, and several responses by desirability."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import optimize
from scipy.stats import qmc

from doe.arguments import checked_flag, checked_kind, checked_list, checked_map, checked_number, checked_seed
from doe.design.design import Design, natural_points
from doe.design.families.optimal import Constraint, allowed
from doe.errors import DesignError
from doe.response.response_surface import Surface

STARTS = 6
"""Best points of the search grid from which the optimum is refined."""

MOST_MOVES = 400
"""Largest number of moves along the axes: at an edge between two wishes the search creeps without end."""

DRAWS_LOG2 = 12


@dataclass(frozen=True)
class Wish:
    """Desirability of one response, from 0 (useless) to 1 (ideal).

    Derringer and Suich (J. Qual. Technol. 12, 1980, p. 214): between the ends it is the share of the way to
    the power of a weight. Below 1 a weight rises early, above 1 late.

    Parameters
    ----------
    low, high : float
        Ends of the scale, ``low < high``.
    target : float, optional
        Response of desirability 1, between the ends. Default: the wish is one-sided.
    larger : bool
        Without target: larger is better (0 at ``low``, 1 at ``high``), else smaller.
    weight : float or (float, float)
        Power; two with a target: below it, and above.
    importance : float
        Weight of this wish among several.
    """

    low: float
    high: float
    target: float | None = None
    larger: bool = True
    weight: float | tuple[float, float] = 1.0
    importance: float = 1.0

    def __post_init__(self) -> None:
        for place in ("low", "high"):
            checked_number(f"{place} of a wish", getattr(self, place))
        if self.target is not None:
            checked_number("target of a wish", self.target)
        if not self.low < self.high:
            raise DesignError(f"low of a wish must be below high, got {self.low} and {self.high}")
        if self.target is not None and not self.low < self.target < self.high:
            raise DesignError(f"target must be between {self.low} and {self.high}, got {self.target}")
        checked_flag("larger", self.larger)
        checked_number("importance of a wish", self.importance, above=0.0)
        weights = self.weight if isinstance(self.weight, tuple) else (self.weight,)
        for weight in weights:
            checked_number("weight of a wish", weight, above=0.0)
        if not 1 <= len(weights) <= 2:
            raise DesignError(f"weight must be one number, or two with a target, got {self.weight}")
        if self.target is None and len(weights) > 1:
            raise DesignError(f"weight without target must be one number, got {self.weight}")

    def of(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the desirability of responses."""
        below, above = (float(number) for number in np.broadcast_to(self.weight, 2))
        rising = (values - self.low) / ((self.high if self.target is None else self.target) - self.low)
        falling = (self.high - values) / (self.high - (self.low if self.target is None else self.target))
        if self.target is None:
            share = rising if self.larger else falling
            return np.clip(share, 0.0, 1.0) ** below
        shares = np.where(
            values <= self.target, np.clip(rising, 0, 1) ** below, np.clip(falling, 0, 1) ** above
        )
        return np.asarray(shares, dtype=np.float64)


@dataclass(frozen=True, eq=False)
class BestSetting:
    """The best setting that was found, and the surfaces there."""

    natural: pd.Series
    coded: pd.Series
    responses: pd.DataFrame
    """Table by response: the columns of ``Surface.predict`` and its desirability."""
    desirability: float
    """Overall desirability; NaN where one response is maximized or minimized."""
    at_edge: tuple[str, ...]
    """Factors at an edge of the region: the best setting may be outside."""

    def __str__(self) -> str:
        where = ", ".join(f"{name} = {value:.5g}" for name, value in self.natural.items())
        lines = [f"Best at {where}."]
        for name, row in self.responses.iterrows():
            wish = "" if np.isnan(row["desirability"]) else f", desirability {row['desirability']:.3f}"
            lines.append(
                f"{name}: {row['mean']:.5g}, mean between {row['confidence_low']:.5g} and "
                f"{row['confidence_high']:.5g}{wish}"
            )
        if len(self.responses) > 1:
            lines.append(f"All together: desirability {self.desirability:.3f}.")
        if self.at_edge:
            lines.append(f"At the edge in {', '.join(self.at_edge)}: the best setting may be beyond.")
        return "\n".join(lines)


def maximize(
    surface: Surface,
    *,
    extent: float = 1.0,
    radius: float | None = None,
    constraints: Sequence[Constraint] = (),
    seed: int = 0,
) -> BestSetting:
    """Return the setting with the largest fitted response in the box, or in a sphere of the box.

    Parameters
    ----------
    extent : float
        Coded half width of the box.
    radius : float, optional
        Coded radius of the sphere about the center.
    constraints : sequence of str or callable
        Rules for the natural values, such as ``"v0 < v1"``.
    seed : int
        Seed of the points that the search starts from.
    """
    checked_kind("surface", surface, Surface)
    return _best({"response": surface}, {}, 1.0, extent, radius, constraints, seed)


def minimize(
    surface: Surface,
    *,
    extent: float = 1.0,
    radius: float | None = None,
    constraints: Sequence[Constraint] = (),
    seed: int = 0,
) -> BestSetting:
    """Return the setting with the smallest fitted response (see ``maximize``)."""
    checked_kind("surface", surface, Surface)
    return _best({"response": surface}, {}, -1.0, extent, radius, constraints, seed)


def most_desirable(
    surfaces: Mapping[str, Surface],
    wishes: Mapping[str, Wish],
    *,
    extent: float = 1.0,
    radius: float | None = None,
    constraints: Sequence[Constraint] = (),
    seed: int = 0,
) -> BestSetting:
    """Return the setting with the largest geometric mean of the desirabilities, weighted by importance.

    Parameters
    ----------
    surfaces : mapping of Surface by response
        Surfaces over the same factors.
    wishes : mapping of Wish by response
        One for every surface.
    extent, radius, constraints, seed
        As in ``maximize``.

    Raises
    ------
    DesignError
        Other factors, a response without wish or surface, or no setting that meets all wishes.
    """
    checked_surfaces(surfaces)
    for name, wish in checked_map("wishes", wishes).items():
        checked_kind(f"wish of {name!r}", wish, Wish)
    if set(surfaces) != set(wishes):
        raise DesignError(f"wishes must be for every surface, got {sorted(surfaces)} and {sorted(wishes)}")
    return _best(surfaces, wishes, 1.0, extent, radius, constraints, seed)


def checked_surfaces(surfaces: Mapping[str, Surface]) -> Design:
    """Return the design of surfaces by response; raise DesignError for different factors."""
    given = checked_map("surfaces", surfaces)
    if not given:
        raise DesignError("surfaces must be one or more by response, got an empty mapping")
    for name, surface in given.items():
        checked_kind(f"surface of {name!r}", surface, Surface)
    first = next(iter(given.values())).design
    if any(surface.design.factors != first.factors for surface in given.values()):
        raise DesignError("the surfaces must have the same factors, with the same ranges")
    return first


def overall(
    surfaces: Mapping[str, Surface], wishes: Mapping[str, Wish], coded: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the overall desirability of coded points, shape (points,)."""
    total = sum(wish.importance for wish in wishes.values())
    logs = np.zeros(len(coded))
    with np.errstate(divide="ignore"):
        for name, wish in wishes.items():
            logs += wish.importance / total * np.log(wish.of(fitted_means(surfaces[name], coded)))
    return np.exp(logs)


def fitted_means(surface: Surface, coded: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the fitted means at coded points, shape (points, factors), without their errors."""
    names = surface.design.names
    powers = np.array([[term.count(name) for name in names] for term in surface.terms]).reshape(
        -1, len(names)
    )
    weights = surface.coded_coefficients.to_numpy()
    return weights[0] + np.prod(coded[:, None, :] ** powers[None], axis=2) @ weights[1:]


def _best(
    surfaces: Mapping[str, Surface],
    wishes: Mapping[str, Wish],
    sign: float,
    extent: float,
    radius: float | None,
    constraints: Sequence[Constraint],
    seed: int,
) -> BestSetting:
    surface = next(iter(surfaces.values()))
    count = len(surface.design.factors)
    checked_number("extent", extent, above=0.0)
    if radius is not None:
        checked_number("radius", radius, above=0.0)
    constraints = checked_list("constraints", constraints)

    def score(coded: NDArray[np.float64]) -> NDArray[np.float64]:
        return overall(surfaces, wishes, coded) if wishes else sign * fitted_means(surface, coded)

    unit = qmc.Sobol(count, rng=np.random.default_rng(checked_seed(seed))).random_base2(DRAWS_LOG2)
    corners = 2.0 * np.round(unit[:256]) - 1.0
    points = extent * np.vstack([np.zeros((1, count)), 2.0 * unit - 1.0, corners])
    if radius is not None:
        length = np.linalg.norm(points, axis=1, keepdims=True)
        points = points * np.minimum(1.0, radius / np.maximum(length, 1e-300))
    table = pd.DataFrame(points, columns=surface.design.names)
    inside = allowed(surface.design.factors, table, constraints) if constraints else table
    values = score(inside.to_numpy())
    if wishes and not values.max() > 0.0:
        raise DesignError(
            "no setting of the region meets every wish: loosen the ends of a wish, or widen the region"
        )
    starts = inside.to_numpy()[np.argsort(-values, kind="stable")[:STARTS]]
    feasible = _feasible(surface, extent, radius, constraints)
    candidates = [_climbed(score, start, extent, radius, feasible) for start in starts]
    best = max(candidates, key=lambda point: float(score(point[None, :])[0]))
    best = _polished(score, best, extent, feasible)
    return _described(surfaces, wishes, best, extent, radius, score)


def _feasible(
    surface: Surface, extent: float, radius: float | None, constraints: Sequence[Constraint]
) -> Callable[[NDArray[np.float64]], bool]:
    def check(point: NDArray[np.float64]) -> bool:
        if np.abs(point).max() > extent + 1e-12 or (radius and np.linalg.norm(point) > radius + 1e-9):
            return False
        if not constraints:
            return True
        try:
            allowed(surface.design.factors, pd.DataFrame([point], columns=surface.design.names), constraints)
        except DesignError:
            return False
        return True

    return check


def _climbed(
    score: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    start: NDArray[np.float64],
    extent: float,
    radius: float | None,
    feasible: Callable[[NDArray[np.float64]], bool],
) -> NDArray[np.float64]:
    """Return a better point near a start by gradients, or the start."""
    settings: dict[str, Any] = {"method": "SLSQP", "options": {"ftol": 1e-14, "maxiter": 100}}
    if radius is not None:
        settings["constraints"] = {"type": "ineq", "fun": lambda x: radius**2 - float(x @ x)}
    bounds = [(-extent, extent)] * len(start)
    found = optimize.minimize(lambda x: -float(score(x[None, :])[0]), start, bounds=bounds, **settings)
    better = np.clip(found.x, -extent, extent)
    return better if feasible(better) and score(better[None, :])[0] > score(start[None, :])[0] else start


def _polished(
    score: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    point: NDArray[np.float64],
    extent: float,
    feasible: Callable[[NDArray[np.float64]], bool],
) -> NDArray[np.float64]:
    """Return the point after steps along the axes, ever shorter, that keep every rule."""
    value = float(score(point[None, :])[0])
    step = 0.1 * extent
    moves = np.vstack([np.eye(len(point)), -np.eye(len(point))])
    for _ in range(MOST_MOVES):
        trials = [trial for trial in point + step * moves if feasible(trial)]
        scores = score(np.array(trials)) if trials else np.array([-np.inf])
        if scores.max() > value:
            point, value = trials[int(scores.argmax())], float(scores.max())
        else:
            step *= 0.5
        if step < 1e-9 * extent:
            break
    return point


def _described(
    surfaces: Mapping[str, Surface],
    wishes: Mapping[str, Wish],
    point: NDArray[np.float64],
    extent: float,
    radius: float | None,
    score: Callable[[NDArray[np.float64]], NDArray[np.float64]],
) -> BestSetting:
    factors = next(iter(surfaces.values())).design.factors
    names = [factor.name for factor in factors]
    coded = pd.DataFrame([point], columns=names)
    rows = {}
    for name, surface in surfaces.items():
        row = surface.predict(coded, coded=True).iloc[0]
        wish = wishes.get(name)
        row["desirability"] = np.nan if wish is None else wish.of(np.array([row["mean"]]))[0]
        rows[name] = row
    edge = [name for name, value in zip(names, point, strict=True) if abs(value) > (1.0 - 1e-6) * extent]
    if radius is not None and np.linalg.norm(point) > (1.0 - 1e-6) * radius:
        edge = [f"the sphere of radius {radius:g}"]
    together = float(score(point[None, :])[0]) if wishes else np.nan
    natural = natural_points(factors, coded).iloc[0]
    return BestSetting(natural, coded.iloc[0], pd.DataFrame(rows).T, together, tuple(edge))
