"""Wrong calls: every argument of every public function rejects wrong values with a rule of this package."""

import datetime
import inspect
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pandas as pd
import pytest

import doe
from doe import Factor, Goal, MeasuredCurve, Sample, Wish, plots
from doe.plots.joint_plots import joint_plot

FACTORS = [Factor("A", 0.0, 1.0), Factor("B", 2.0, 5.0), Factor("C", -1.0, 1.0)]
DESIGN = doe.central_composite(FACTORS)
NOISE = np.random.default_rng(0).normal(size=len(DESIGN.coded))
RESPONSE = 9.0 + NOISE + DESIGN.points.to_numpy() @ [2.0, 3.0, 0.5]
SURFACE = doe.fit_surface(DESIGN, RESPONSE)
SURFACES, WISHES, POINT = {"y": SURFACE}, {"y": Wish(0.0, 20.0)}, {"A": 0.5, "B": 3.0, "C": 0.0}
CORNERS, EIGHT = doe.full_factorial(FACTORS), RESPONSE[:8]
SCREENING = doe.plackett_burman(FACTORS, 12)
SCREEN = doe.screen(SCREENING, RESPONSE[:12])
PATH = doe.steepest_path(SCREEN, 2)
BLENDS = doe.simplex_lattice(["x", "y", "z"], 2)
TARGET = Sample(9.0, 0.5, 4)
JOINT = doe.joint_fit({"y": Goal(SURFACE, TARGET)}, resolution=5)
RUNS = DESIGN.natural.iloc[:6]
CARRIED = doe.transfer(SURFACE, RUNS, RESPONSE[:6], 9.0)
AGREED = doe.agreement([1.0, 2.0, 4.0], [1.5, 2.0, 3.5])
FORMULA = doe.fit_formula(DESIGN, RESPONSE, "A * B")
REGION = SURFACE.compatible_region(TARGET, resolution=5)
CURVE = MeasuredCurve("slow", 0.0, np.array([0]), np.array([1.0]))
VALUES = [1.0, 2.0, 4.0]

TODAY = datetime.date(2026, 1, 1)
THINGS = [None, "x", 3.5, np.nan, {}, pd.DataFrame(), object(), {"q": 3}, [None], True]
FLAGS = [None, "yes", 1, np.nan, [], pd.DataFrame()]
COUNTS = [None, "x", -1, 1.5, np.nan, np.inf, [], {}, True, 1j, 10**9, TODAY]
NUMBERS = [None, "x", np.nan, np.inf, [], {}, True, 1j, (1.0, 2.0), pd.DataFrame(), TODAY]
NAMES = [None, "nothing", 3, [], {}, np.nan, pd.DataFrame()]
WRONG = {"float": NUMBERS, "int": COUNTS, "bool": FLAGS, "str": NAMES}
"""Wrong values by the type of an argument; of any other type: THINGS."""

RESPONSES = [
    np.ma.masked_array(RESPONSE, mask=np.arange(len(RESPONSE)) == 3),
    pd.date_range("2024-01-01", periods=len(RESPONSE)),
    RESPONSE.astype(str), RESPONSE.astype(complex), RESPONSE > 9.0, RESPONSE[:-1], RESPONSE[None, :],
    np.where(np.arange(len(RESPONSE)) == 2, np.nan, RESPONSE), [*RESPONSE[:-1], None], [[1.0], [1.0, 2.0]],
    [], set(RESPONSE), pd.Series(RESPONSE), pd.Series(RESPONSE, index=DESIGN.coded.index).astype("category"),
    pd.DataFrame({"angle": RESPONSE, "mass": RESPONSE}, index=DESIGN.coded.index),
]  # fmt: skip

CALLS: list[tuple[Callable, dict[str, Any]]] = [
    (doe.plackett_burman, {"factors": FACTORS, "runs": 12, "seed": 1}),
    (doe.definitive_screening, {"factors": FACTORS, "spare": 0, "center": 1, "seed": 1}),
    (doe.full_factorial, {"factors": FACTORS, "levels": 2, "blocks": 2, "center": 1, "seed": 1}),
    (
        doe.fractional_factorial,
        {"factors": [*FACTORS, Factor("D", 0, 1)], "runs": 8, "resolution": 4, "center": 0},
    ),
    (
        doe.central_composite,
        {"factors": FACTORS, "alpha": 1.5, "center": 2, "seed": 1, "blocks": 2, "full": True},
    ),
    (doe.box_behnken, {"factors": FACTORS, "center": 3, "blocks": False, "seed": 1}),
    (
        doe.optimal_design,
        {
            "factors": FACTORS,
            "runs": 12,
            "model": "interaction",
            "criterion": "D",
            "levels": 2,
            "starts": 1,
            "seed": 1,
            "existing": CORNERS,
            "constraints": ["A < 2"],
        },
    ),
    (doe.latin_hypercube, {"factors": FACTORS, "runs": 8, "seed": 1, "optimize": "lloyd"}),
    (doe.sobol, {"factors": FACTORS, "runs": 8, "seed": 1}),
    (
        doe.simplex_lattice,
        {"components": ["x", "y"], "degree": 2, "interior": True, "lower": {"x": 0.1}, "seed": 1},
    ),
    (doe.simplex_centroid, {"components": ["x", "y"], "lower": {"x": 0.1}, "seed": 1}),
    (doe.Mixture, {"shares": BLENDS.shares, "lower": {}, "seed": 1}),
    (doe.foldover, {"design": CORNERS, "factors": ["A"]}),
    (doe.add_center, {"design": CORNERS, "count": 2}),
    (doe.add_axial, {"design": CORNERS, "alpha": 1.5, "center": 1}),
    (lambda one, blocks: doe.join(CORNERS, one, blocks=blocks), {"one": DESIGN, "blocks": [1, 2]}),
    (doe.alias_structure, {"design": CORNERS, "order": 2}),
    (doe.design_quality, {"design": DESIGN, "model": "quadratic", "constraints": ["A < 2"], "seed": 1}),
    (
        doe.power_table,
        {
            "design": CORNERS,
            "effects": [1.0],
            "model": "first-order",
            "sd": 1.0,
            "replicates": 2,
            "alpha": 0.05,
        },
    ),
    (doe.effect_power, {"effect": 1.0, "sd": 1.0, "observations": 8, "error_df": 4.0, "alpha": 0.05}),
    (doe.detectable_effect, {"sd": 1.0, "observations": 8, "error_df": 4.0, "alpha": 0.05, "power": 0.8}),
    (doe.screen, {"design": SCREENING, "response": RESPONSE[:12], "error": "dummies"}),
    (doe.aliases, {"design": SCREENING, "interaction": "A:B"}),
    (doe.two_level_effects, {"design": CORNERS, "response": EIGHT, "order": 3}),
    (
        doe.steepest_path,
        {
            "fit": SCREEN,
            "steps": 2,
            "factors": ["A"],
            "step": 1.0,
            "start": {"A": 0.5},
            "limits": {"A": (0.0, 9.0)},
            "descend": True,
        },
    ),
    (doe.climb_table, {"path": PATH, "response": VALUES, "target": 2.0}),
    (doe.fit_surface, {"design": DESIGN, "response": RESPONSE, "model": "quadratic"}),
    (doe.fit_formula, {"design": DESIGN, "response": RESPONSE, "formula": "A * B", "coded": True}),
    (doe.fit_mixture, {"mixture": BLENDS, "response": EIGHT[:6], "model": "linear"}),
    (doe.influence, {"surface": SURFACE}),
    (doe.box_cox, {"surface": SURFACE, "confidence": 0.9}),
    (doe.robust_coefficients, {"surface": SURFACE}),
    (doe.canonical, {"surface": SURFACE, "alpha": 0.05}),
    (doe.ridge_path, {"surface": SURFACE, "radii": [0.5], "descend": True}),
    (doe.stationary_region, {"surface": SURFACE, "alpha": 0.05, "extent": 1.0, "resolution": 5}),
    (doe.maximize, {"surface": SURFACE, "extent": 1.0, "radius": 1.0, "constraints": ["A < 2"], "seed": 1}),
    (doe.minimize, {"surface": SURFACE, "extent": 1.0}),
    (doe.most_desirable, {"surfaces": SURFACES, "wishes": WISHES, "extent": 1.0}),
    (doe.compare_means, {"a": VALUES, "b": [2.0, 3.0], "margin": 1.0, "method": "welch", "alpha": 0.05}),
    (
        doe.agreement,
        {
            "values": VALUES,
            "reference": VALUES,
            "value_variance": 0.1,
            "reference_variance": 0.1,
            "settings": "abc",
            "strata": "abc",
            "confidence": 0.9,
        },
    ),
    (doe.noise_floor, {"values": VALUES, "confidence": 0.9}),
    (doe.variance_ratio, {"mean_sq": 1.0, "df": 1.0, "error_ms": 1.0, "error_df": 1.0}),
    (doe.curvature_test, {"corners": VALUES, "centers": VALUES}),
    (
        doe.pure_error,
        {"coded": DESIGN.points, "response": RESPONSE, "blocks": pd.Series(1, DESIGN.coded.index)},
    ),
    (doe.joint_fit, {"goals": {"y": Goal(SURFACE, TARGET)}, "alpha": 0.05, "resolution": 5}),
    (doe.scatter_of_views, {"heaps": [[[1.0], [2.0]]] * 2}),
    (
        lambda emulators, curves: doe.fit_curves(emulators, [0.0], curves, 1.0, 1),
        {"emulators": {}, "curves": [CURVE]},
    ),
    (
        doe.transfer,
        {"source": SURFACE, "runs": RUNS, "response": RESPONSE[:6], "level": 9.0, "scale_sd": 0.2},
    ),
    (
        doe.transfer_points,
        {"source": SURFACE, "at": POINT, "count": 5, "step": 0.5, "extent": 1.0, "turn": 0},
    ),
    (doe.Factor, {"name": "A", "low": 0.0, "high": 1.0}),
    (doe.Category, {"name": "c", "levels": ["a", "b"]}),
    (doe.Sample, {"mean": 1.0, "sd": 1.0, "n": 3}),
    (Goal, {"surface": SURFACE, "target": TARGET}),
    (Wish, {"low": 0.0, "high": 2.0, "target": 1.0, "larger": True, "weight": 1.0, "importance": 1.0}),
    (doe.Design, {"factors": tuple(FACTORS), "coded": DESIGN.coded, "dummies": (), "seed": 1}),
    (
        doe.Design.from_table,
        {"table": DESIGN.coded.assign(day=1), "factors": FACTORS, "coded": True, "block": "day"},
    ),
    (DESIGN.select, {"runs": [1]}),
    (DESIGN.with_blocks, {"labels": [1] * len(DESIGN.coded)}),
    (DESIGN.factor, {"name": "A"}),
    (SURFACE.predict, {"points": POINT, "alpha": 0.05, "coded": False}),
    (SURFACE.evaluate, {"coded": [[0.0, 0.0, 0.0]]}),
    (SURFACE.reduce, {"alpha": 0.05}),
    (SURFACE.equation, {"units": "natural", "digits": 3}),
    (SURFACE.agrees, {"point": POINT, "target": TARGET, "alpha": 0.05, "coded": False}),
    (
        SURFACE.compatible_region,
        {"target": 9.0, "target_se": 0.1, "target_df": 3.0, "alpha": 0.05, "extent": 1.0, "resolution": 5},
    ),
    (SURFACE.band, {"target": 9.0, "half_width": 0.5, "resolution": 5}),
    (SURFACE.nearest, {"target": 9.0, "to": POINT, "extent": 1.0}),
    (SURFACE.contour, {"target": 9.0, "extent": 1.0, "resolution": 5}),
    (REGION.axis, {"name": "A"}),
    (REGION.projection, {"x": "A", "y": "B"}),
    (JOINT.agrees, {"point": POINT}),
    (JOINT.band, {"name": "y"}),
    (SCREEN.critical_t, {"alpha": 0.05, "bonferroni": True}),
    (SCREEN.significant, {"alpha": 0.05}),
    (FORMULA.predict, {"points": POINT, "alpha": 0.05}),
    (CARRIED.evaluate, {"coded": [[0.0, 0.0, 0.0]]}),
    (CARRIED.intervals, {"alpha": 0.05}),
    (plots.pareto_chart, {"result": SCREEN, "alphas": [0.05]}),
    (plots.half_normal_plot, {"result": SCREEN}),
    (plots.residual_plots, {"surface": SURFACE}),
    (
        plots.contour_plot,
        {"surface": SURFACE, "target": 9.0, "point": POINT, "region": REGION, "x": "A", "extent": 1.0},
    ),
    (plots.surface_plot, {"surface": SURFACE, "target": 9.0, "at": POINT}),
    (plots.main_effects_plot, {"design": CORNERS, "response": EIGHT}),
    (plots.interaction_plot, {"design": CORNERS, "response": EIGHT, "x": "A", "trace": "B"}),
    (plots.cube_plot, {"surface": SURFACE, "factors": ["A", "B", "C"], "at": POINT}),
    (plots.profile_plot, {"surfaces": SURFACES, "at": POINT, "wishes": WISHES}),
    (plots.overlay_plot, {"surfaces": SURFACES, "limits": {"y": (1.0, 2.0)}, "point": POINT}),
    (plots.climb_plot, {"path": PATH, "response": VALUES, "target": 2.0, "target_sd": 0.1}),
    (plots.agreement_plot, {"result": AGREED, "groups": "abc"}),
    (joint_plot, {"fit": JOINT, "truth": POINT}),
]
"""Functions with right arguments, each of which is replaced by wrong ones in turn."""

MANY, EMPTY = "1000000000", "Empty DataFrame\nColumns: []\nIndex: []"
MEANINGFUL = {
    "seed": ("None", MANY),
    **dict.fromkeys(("order", "replicates", "observations", "n", "turn"), (MANY,)),
    **dict.fromkeys(("start", "limits", "lower"), ("{}", "{'q': 3}")),
    **dict.fromkeys(("scale_sd", "target_df"), ("inf",)),
    **dict.fromkeys(("surface_plot at", "cube_plot at"), ("{}", "{'q': 3}")),
    **dict.fromkeys(("axis name", "projection x", "projection y", "band name"), ("[]", "{}", EMPTY)),
    **dict.fromkeys(("Factor name", "Category name"), ("'nothing'",)),
    **dict.fromkeys(("compare_means b", "Wish weight"), ("(1.0, 2.0)",)),
    "central_composite alpha": ("3",),
    "latin_hypercube optimize": ("None",),
    "<lambda> blocks": ("None",),
    "fit_surface model": ("[]",),
    "Factor high": ("True",),
    "agrees target": ("3.5",),
}
"""Values of the lists above that an argument takes, by their text."""


def wrong_values(function: Callable, name: str) -> Iterator[object]:
    """Yield the wrong values of an argument by its annotation."""
    parameter = inspect.signature(function).parameters[name]
    kinds = str(parameter.annotation).removeprefix("<class '").removesuffix("'>").split(" | ")
    wrong = next((WRONG[kind] for kind in kinds if kind in WRONG), THINGS)
    taken = MEANINGFUL.get(name, ()) or MEANINGFUL.get(f"{function.__name__} {name}", ())
    optional = "None" in kinds or parameter.default is None
    for value in wrong:
        if not (optional and value is None) and repr(value) not in taken:
            yield value
    if name == "response":
        yield from RESPONSES


CASES = [
    pytest.param(function, right, name, value, id=f"{function.__name__} {name} {number}")
    for function, right in CALLS
    for name in right
    for number, value in enumerate(wrong_values(function, name))
]


@pytest.mark.parametrize(("function", "right", "name", "value"), CASES)
def test_a_wrong_value_is_rejected_with_its_rule(
    function: Callable, right: dict, name: str, value: object
) -> None:
    with pytest.raises(doe.DesignError) as error:
        function(**{**right, name: value})
    assert len(str(error.value)) > 20


def test_every_public_function_is_called_wrongly() -> None:
    called = {function.__name__ for function, _ in CALLS} | {"join", "fit_curves"}
    functions = [name for name in doe.__all__ if name[0].islower()]
    functions += [name for name in plots.__all__ if name.endswith(("_plot", "_plots", "_chart"))]
    assert set(functions) - called == set()


@pytest.mark.parametrize("name", ["response", "error", "error_percent"])
def test_a_factor_is_not_overwritten_by_a_column_of_the_climb(name: str) -> None:
    with pytest.raises(doe.DesignError, match=f"'{name}' names a column"):
        doe.climb_table(doe.plackett_burman([Factor(name, 0.0, 1.0)], 4), np.arange(4.0), 1.0)


def test_plain_calls_are_accepted() -> None:
    """Integers, lists, Series in another order and numbers of other kinds are read as they are."""
    shuffled = pd.Series(RESPONSE, index=DESIGN.coded.index).sample(frac=1.0, random_state=1)
    for response in (list(RESPONSE), shuffled, shuffled.to_frame(), RESPONSE.astype(object)):
        again = doe.fit_surface(DESIGN, response).fit.params
        np.testing.assert_allclose(again, SURFACE.fit.params, rtol=1e-12)
    assert doe.compare_means([1, 2, 4], (2, 3)).df > 0.0
    assert SURFACE.predict({**POINT, "A": 3}, alpha=np.float64(0.1)).notna().all(axis=None)
    assert doe.climb_table(PATH, VALUES, 0.0)["error_percent"].isna().all()
