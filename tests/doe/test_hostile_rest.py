"""Wrong calls of figures, mixtures, transfers, power tables and options: each is refused with a rule."""

import datetime
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import doe
from doe import (
    Design,
    DesignError,
    Factor,
    Goal,
    MeasuredCurve,
    Mixture,
    Sample,
    Wish,
    add_axial,
    agreement,
    alias_structure,
    box_behnken,
    box_cox,
    central_composite,
    climb_table,
    definitive_screening,
    design_quality,
    fit_curves,
    fit_formula,
    fit_mixture,
    fit_surface,
    foldover,
    fractional_factorial,
    full_factorial,
    join,
    joint_fit,
    latin_hypercube,
    maximize,
    most_desirable,
    optimal_design,
    plackett_burman,
    plots,
    power_table,
    pure_error,
    ridge_path,
    scatter_of_views,
    screen,
    simplex_lattice,
    sobol,
    steepest_path,
    transfer,
    transfer_points,
    two_level_effects,
)
from doe.plots.joint_plots import joint_plot

FACTORS = [Factor("A", 0.0, 1.0), Factor("B", 2.0, 5.0), Factor("C", -1.0, 1.0)]
MORE = [*FACTORS, Factor("D", 0.0, 1.0)]
DESIGN = central_composite(FACTORS)
NOISE = np.random.default_rng(0).normal(size=len(DESIGN.coded))
RESPONSE = 9.0 + NOISE + DESIGN.points.to_numpy() @ [2.0, 3.0, 0.5]
SURFACE = fit_surface(DESIGN, RESPONSE)
SURFACES, WISHES, POINT = {"y": SURFACE}, {"y": Wish(0.0, 20.0)}, {"A": 0.5, "B": 3.0, "C": 0.0}
CORNERS, EIGHT = full_factorial(FACTORS), RESPONSE[:8]
SCREENING = plackett_burman(FACTORS, 12)
SCREEN = screen(SCREENING, RESPONSE[:12])
PATH = steepest_path(SCREEN, 2)
BLENDS = simplex_lattice(["x", "y", "z"], 2)
JOINT = joint_fit({"y": Goal(SURFACE, Sample(9.0, 0.5, 4))}, resolution=5)
CARRIED = transfer(SURFACE, DESIGN.natural.iloc[:6], RESPONSE[:6], 9.0)
AGREED = agreement([1.0, 2.0, 4.0], [1.5, 2.0, 3.5])
EFFECTS = two_level_effects(CORNERS, EIGHT)
FORMULA = fit_formula(DESIGN, RESPONSE, "A * B")

CURVE = MeasuredCurve("slow", 0.0, np.array([0]), np.array([1.0]))
THINGS = [None, "x", 3, np.nan, [], {}, pd.DataFrame(), np.array([1.0, 2.0]), object()]
NO_FLAGS = [None, "yes", 1, np.nan, [], pd.DataFrame()]
NO_COUNTS = ["x", -1, 1.5, np.nan, np.inf, [], {}, True, 1j, 10**9, datetime.date(2024, 1, 1)]
NO_NUMBERS = ["x", np.nan, np.inf, [], {}, True, 1j, (1.0, 2.0), pd.DataFrame(), datetime.date(2024, 1, 1)]
NO_LISTS = [None, 3, np.nan, "A", {}, pd.DataFrame(), True]
NO_SEEDS = ["x", -1, 1.5, np.nan, [], {}, pd.DataFrame()]
NO_NAMES = ["none", 3, [], {}, np.nan, pd.DataFrame()]
NO_POINTS = ["x", 3, [1.0], {"A": 0.5}, {**POINT, "A": None}, {**POINT, "A": np.nan}, {**POINT, "A": "x"}]


def builders(option: str, values: list, *functions: Callable) -> dict[str, tuple[Callable, list]]:
    """Return the calls of functions of factors with one option."""
    return {
        f"{function.__name__} {option}": (
            lambda value, function=function: function(MORE, **{option: value}),
            values,
        )
        for function in functions
    }


CALLS: dict[str, tuple[Callable, list]] = {
    **builders("blocks", [*NO_COUNTS, None, 0, 3], full_factorial, fractional_factorial),
    **builders("center", [*NO_COUNTS, None], full_factorial, fractional_factorial, central_composite),
    **builders("center", [*NO_COUNTS, None, 0], definitive_screening),
    **builders("spare", [*NO_COUNTS, None], definitive_screening),
    **builders("generators", ["x", 3, {}, [3], [None], ["E = A:B"]], fractional_factorial),
    **builders("resolution", [*NO_COUNTS[:9], 1], fractional_factorial),
    **builders("full", NO_FLAGS, central_composite),
    **builders("blocks", [*NO_COUNTS[:9], 4], central_composite),
    **builders("blocks", NO_FLAGS, box_behnken),
    **builders(
        "seed",
        NO_SEEDS,
        plackett_burman,
        definitive_screening,
        box_behnken,
        central_composite,
        full_factorial,
    ),
    "sobol seed": (lambda value: sobol(FACTORS, 8, seed=value), NO_SEEDS),
    "latin_hypercube seed": (lambda value: latin_hypercube(FACTORS, 8, seed=value), [*NO_SEEDS, None]),
    "latin_hypercube optimize": (
        lambda value: latin_hypercube(FACTORS, 8, seed=1, optimize=value),
        NO_NAMES,
    ),
    "optimal criterion": (lambda value: optimal_design(FACTORS, 12, criterion=value), [*NO_NAMES, None]),
    "optimal model": (lambda value: optimal_design(FACTORS, 12, value), [*NO_NAMES, None]),
    "optimal constraints": (
        lambda value: optimal_design(FACTORS, 12, constraints=value),
        [*NO_LISTS, [3], [None], ["A <"], ["A + B"], ["A > 9"]],
    ),
    "optimal existing": (
        lambda value: optimal_design(FACTORS, 12, existing=value),
        [*THINGS[1:], BLENDS],
    ),
    "optimal levels": (lambda value: optimal_design(FACTORS, 12, levels=value), [*NO_COUNTS, 1]),
    "optimal starts": (lambda value: optimal_design(FACTORS, 12, starts=value), [*NO_COUNTS, 0]),
    "optimal seed": (lambda value: optimal_design(FACTORS, 12, seed=value), NO_SEEDS),
    "foldover": (lambda value: foldover(CORNERS, value), [[], {}, pd.DataFrame(), [None], [3]]),
    "join blocks": (lambda value: join(CORNERS, DESIGN, blocks=value), [3, "ab", ["a"], ["a", "a"], {}]),
    "add_axial center": (lambda value: add_axial(CORNERS, 1.5, value), [10**9]),
    "Design coded": (lambda value: Design(tuple(FACTORS), value), THINGS),
    "Design dummies": (lambda value: Design(tuple(FACTORS), DESIGN.coded, dummies=value), [3, "A", ["e"]]),
    "from_table coded": (
        lambda value: Design.from_table(DESIGN.coded, FACTORS, coded=value),
        [v for v in NO_FLAGS if v is not None],
    ),
    "from_table block": (
        lambda value: Design.from_table(DESIGN.coded, FACTORS, coded=True, block=value),
        [3, "day", [], {}, np.nan, pd.DataFrame()],
    ),
    "select": (DESIGN.select, [None, 3, "x", {}, [None], [99], [[1]]]),
    "with_blocks": (DESIGN.with_blocks, [None, 3, "x", {}, ["a"]]),
    "factor": (DESIGN.factor, [None, 3, "", "D", [], pd.DataFrame()]),
    "Mixture shares": (
        lambda value: Mixture(value, {}),
        [*THINGS, pd.DataFrame({"a": [0.5]}), pd.DataFrame({"a": ["x"]}), pd.DataFrame({"a": [np.nan]})],
    ),
    "Mixture lower": (lambda value: Mixture(BLENDS.shares, value), [None, 3, "x", [0.1]]),
    "Mixture seed": (lambda value: Mixture(BLENDS.shares, {}, value), NO_SEEDS),
    "lattice lower": (
        lambda value: simplex_lattice(["x", "y"], 2, lower=value),
        [3, "x", [0.1], {"q": 0.1}, {"x": -0.1}, {"x": 1.0}, {"x": "a"}, {"x": np.nan}],
    ),
    "lattice interior": (lambda value: simplex_lattice(["x", "y"], 2, interior=value), NO_FLAGS),
    "lattice degree": (lambda value: simplex_lattice(["x", "y"], value), NO_COUNTS),
    "quality model": (lambda value: design_quality(DESIGN, value), [*NO_NAMES, None]),
    "quality seed": (lambda value: design_quality(DESIGN, seed=value), NO_SEEDS),
    "power_table design": (power_table, THINGS),
    "power_table effects": (lambda value: power_table(CORNERS, value), [*NO_LISTS, [], ["x"], [np.nan]]),
    "power_table model": (lambda value: power_table(CORNERS, model=value), [*NO_NAMES, "three-factor"]),
    "power_table sd": (lambda value: power_table(CORNERS, sd=value), [None, 0.0, -1.0, *NO_NUMBERS]),
    "power_table replicates": (lambda value: power_table(CORNERS, replicates=value), [0, *NO_COUNTS[:9]]),
    "power_table alpha": (lambda value: power_table(CORNERS, alpha=value), [0.0, 1.0, *NO_NUMBERS]),
    "alias_structure order": (lambda value: alias_structure(CORNERS, value), [0, *NO_COUNTS[:9]]),
    "screen design": (lambda value: screen(value, RESPONSE), [*THINGS, BLENDS]),
    "fit_surface design": (lambda value: fit_surface(value, RESPONSE), [*THINGS, BLENDS]),
    "fit_formula coded": (lambda value: fit_formula(DESIGN, RESPONSE, "A", coded=value), NO_FLAGS),
    "formula points": (FORMULA.predict, [None, "x", 3, [1.0], {"A": 0.5}]),
    "formula alpha": (lambda value: FORMULA.predict(POINT, value), [0.0, 1.0, None, *NO_NUMBERS]),
    "fit_mixture model": (lambda value: fit_mixture(BLENDS, np.arange(6.0), value), [*NO_NAMES, None]),
    "pure_error blocks": (
        lambda value: pure_error(DESIGN.points, RESPONSE, value),
        [*THINGS[1:], pd.Series([1.0, 2.0]), pd.Series(np.nan, index=DESIGN.coded.index)],
    ),
    "climb_table path": (lambda value: climb_table(value, [1.0, 2.0, 3.0], 2.0), [*THINGS, BLENDS]),
    "path descend": (lambda value: steepest_path(SCREEN, 2, descend=value), NO_FLAGS),
    "path mappings": (
        lambda value: steepest_path(SCREEN, 2, start=value, limits=value),
        [3, "x", [1.0], True, np.nan],
    ),
    "ridge descend": (lambda value: ridge_path(SURFACE, [0.5], descend=value), NO_FLAGS),
    "box_cox confidence": (lambda value: box_cox(SURFACE, value), [None, 0.0, 1.0, *NO_NUMBERS]),
    "equation units": (SURFACE.equation, [*NO_NAMES, None]),
    "equation digits": (lambda value: SURFACE.equation(digits=value), [None, *NO_COUNTS]),
    "predict coded": (lambda value: SURFACE.predict(POINT, coded=value), NO_FLAGS),
    "evaluate": (SURFACE.evaluate, [[[np.nan, 0.0, 0.0]], [[np.inf, 0.0, 0.0]], []]),
    "contour resolution": (lambda value: SURFACE.contour(9.0, resolution=value), NO_COUNTS),
    "critical_t bonferroni": (lambda value: SCREEN.critical_t(0.05, value), NO_FLAGS),
    "limit together": (lambda value: EFFECTS.limit(0.05, value), NO_FLAGS),
    "Wish larger": (lambda value: Wish(0.0, 1.0, larger=value), NO_FLAGS),
    "Wish weight": (lambda value: Wish(0.0, 1.0, weight=value), [None, 0.0, -1.0, (), *NO_NUMBERS]),
    "Wish importance": (lambda value: Wish(0.0, 1.0, importance=value), [None, 0.0, -1.0, *NO_NUMBERS]),
    "maximize radius": (lambda value: maximize(SURFACE, radius=value), [0.0, -1.0, *NO_NUMBERS]),
    "maximize constraints": (lambda value: maximize(SURFACE, constraints=value), [*NO_LISTS, [3], ["A >"]]),
    "maximize seed": (lambda value: maximize(SURFACE, seed=value), NO_SEEDS),
    "most_desirable surfaces": (
        lambda value: most_desirable(value, WISHES),
        [*THINGS, {"y": 3}, {"y": None}],
    ),
    "most_desirable wishes": (lambda value: most_desirable(SURFACES, value), [*THINGS, {"y": 3}, {"z": 3}]),
    "transfer source": (lambda value: transfer(value, DESIGN.natural, RESPONSE, 9.0), [*THINGS, DESIGN]),
    "transfer runs": (
        lambda value: transfer(SURFACE, value, RESPONSE[:6], 9.0),
        [*THINGS, DESIGN.natural.iloc[:3], DESIGN.natural.iloc[:6].astype(str), DESIGN.natural.iloc[[0] * 6]],
    ),
    "transfer response": (
        lambda value: transfer(SURFACE, DESIGN.natural.iloc[:6], value, 9.0),
        [*THINGS, RESPONSE[:5], RESPONSE[:6] * np.nan, np.ones(6)],
    ),
    "transfer level": (
        lambda value: transfer(SURFACE, DESIGN.natural.iloc[:6], RESPONSE[:6], value),
        [None, 1e9, *NO_NUMBERS],
    ),
    "transfer scale_sd": (
        lambda value: transfer(SURFACE, DESIGN.natural.iloc[:6], RESPONSE[:6], 9.0, value),
        [None, 0.0, -1.0, "x", np.nan, [], {}, True],
    ),
    "transferred": (CARRIED.evaluate, [None, "x", 3, [], [1.0], [[np.nan, 0.0, 0.0]]]),
    "transferred target": (CARRIED.nearest, [None, *NO_NUMBERS]),
    "transferred alpha": (CARRIED.intervals, [None, 0.0, 1.0, *NO_NUMBERS]),
    "transfer_points source": (lambda value: transfer_points(value, POINT, 5), [*THINGS, DESIGN]),
    "transfer_points at": (lambda value: transfer_points(SURFACE, value, 5), [None, *NO_POINTS]),
    "transfer_points count": (lambda value: transfer_points(SURFACE, POINT, value), [None, 0, *NO_COUNTS]),
    "transfer_points step": (lambda value: transfer_points(SURFACE, POINT, 5, value), [0.0, *NO_NUMBERS]),
    "transfer_points extent": (
        lambda value: transfer_points(SURFACE, POINT, 5, extent=value),
        [0.0, *NO_NUMBERS],
    ),
    "transfer_points turn": (lambda value: transfer_points(SURFACE, POINT, 5, turn=value), NO_COUNTS[:9]),
    "scatter_of_views": (scatter_of_views, [*NO_LISTS, ["x"], [None], [[1.0, 2.0]], [[[1.0, np.nan]]]]),
    "fit_curves emulators": (
        lambda value: fit_curves(value, [0.0], [CURVE], 1.0, 1),
        [*THINGS[:4], {"a": 3}],
    ),
    "fit_curves curves": (lambda value: fit_curves({}, [0.0], value, 1.0, 1), [*NO_LISTS, [], [3], [CURVE]]),
    "pareto_chart": (plots.pareto_chart, [*THINGS, SURFACE]),
    "pareto_chart alphas": (lambda value: plots.pareto_chart(SCREEN, value), [*NO_LISTS, [0.0], ["x"]]),
    "half_normal_plot": (plots.half_normal_plot, [*THINGS, SURFACE]),
    "residual_plots": (plots.residual_plots, [*THINGS, SCREEN]),
    "contour_plot": (plots.contour_plot, [*THINGS, SCREEN]),
    "contour_plot target": (lambda value: plots.contour_plot(SURFACE, value), NO_NUMBERS),
    "contour_plot point": (lambda value: plots.contour_plot(SURFACE, point=value), NO_POINTS),
    "contour_plot region": (lambda value: plots.contour_plot(SURFACE, region=value), THINGS[1:]),
    "contour_plot x": (
        lambda value: plots.contour_plot(SURFACE, x=value),
        [3, "", "D", "B", [], pd.DataFrame()],
    ),
    "contour_plot extent": (lambda value: plots.contour_plot(SURFACE, extent=value), [0.0, *NO_NUMBERS]),
    "surface_plot": (plots.surface_plot, [*THINGS, SCREEN]),
    "surface_plot at": (
        lambda value: plots.surface_plot(SURFACE, at=value),
        ["x", 3, [1.0], {"C": None}, {"C": "x"}, {"C": np.nan}],
    ),
    "main_effects_plot": (lambda value: plots.main_effects_plot(value, RESPONSE), THINGS),
    "interaction_plot": (lambda value: plots.interaction_plot(value, EIGHT, "A", "B"), THINGS),
    "interaction_plot x": (
        lambda value: plots.interaction_plot(CORNERS, EIGHT, value, "B"),
        [None, 3, "B", "D", [], pd.DataFrame()],
    ),
    "cube_plot": (plots.cube_plot, [*THINGS, SCREEN]),
    "cube_plot factors": (
        lambda value: plots.cube_plot(SURFACE, value),
        [3, "ABC", ["A", "B"], ["A", "B", "B"], ["A", "B", "D"], [1, 2, 3], {}],
    ),
    "cube_plot at": (lambda value: plots.cube_plot(SURFACE, at=value), ["x", 3, {"A": np.nan}, {"A": "x"}]),
    "profile_plot surfaces": (lambda value: plots.profile_plot(value, POINT), [*THINGS, {"y": SCREEN}]),
    "profile_plot at": (lambda value: plots.profile_plot(SURFACES, value), [None, *NO_POINTS]),
    "profile_plot wishes": (
        lambda value: plots.profile_plot(SURFACES, POINT, value),
        [*THINGS[1:], {"y": 3}, {"z": WISHES["y"]}],
    ),
    "overlay_plot surfaces": (lambda value: plots.overlay_plot(value, {"y": (1.0, 2.0)}), THINGS),
    "overlay_plot limits": (
        lambda value: plots.overlay_plot(SURFACES, value),
        [*THINGS, {"y": 3.0}, {"y": (1.0,)}, {"y": ("a", "b")}, {"y": (np.nan, 1.0)}],
    ),
    "overlay_plot point": (
        lambda value: plots.overlay_plot(SURFACES, {"y": (1.0, 2.0)}, point=value),
        NO_POINTS,
    ),
    "climb_plot": (lambda value: plots.climb_plot(value, [1.0, 2.0, 3.0], 2.0), THINGS),
    "climb_plot target_sd": (
        lambda value: plots.climb_plot(PATH, [1.0, 2.0, 3.0], 2.0, value),
        [-1.0, *NO_NUMBERS],
    ),
    "agreement_plot": (lambda value: plots.agreement_plot(value, "aab"), [*THINGS, SURFACE]),
    "agreement_plot groups": (lambda value: plots.agreement_plot(AGREED, value), [*NO_LISTS, ["a"]]),
    "joint_plot": (joint_plot, [*THINGS, SURFACE]),
    "joint_plot truth": (lambda value: joint_plot(JOINT, value), NO_POINTS),
    "joint_plot axes": (lambda value: joint_plot(JOINT, axes=value), [3, "x", [], {}]),
}
"""Name of the argument, a call with it, and wrong values."""

HOSTILE = [
    pytest.param(call, value, id=f"{name} {number}")
    for name, (call, values) in CALLS.items()
    for number, value in enumerate(values)
]


@pytest.mark.parametrize(("call", "value"), HOSTILE)
def test_a_wrong_value_is_refused_with_its_rule(call: Callable, value: object) -> None:
    with pytest.raises(DesignError) as error:
        call(value)
    assert len(str(error.value)) > 20


def test_every_public_function_is_called_wrongly_somewhere() -> None:
    """The lists of wrong calls name every function of the package and of its figures, beside its import."""
    texts = "".join(path.read_text() for path in Path(__file__).parent.glob("test_hostile_*.py"))
    functions = [name for name in doe.__all__ if name[0].islower()]
    functions += [name for name in plots.__all__ if name.endswith(("_plot", "_plots", "_chart"))]
    assert [name for name in functions if len(re.findall(rf"\b{name}\b", texts)) < 2] == []
