"""Wrong calls: every public function refuses them with a rule, and no error comes from inside a library."""

import datetime
from collections.abc import Callable

import numpy as np
import pandas as pd
import pytest

from doe import (
    Design,
    DesignError,
    Factor,
    Goal,
    Sample,
    Surface,
    agreement,
    aliases,
    central_composite,
    climb_table,
    compare_means,
    curvature_test,
    detectable_effect,
    effect_power,
    fit_surface,
    joint_fit,
    noise_floor,
    plackett_burman,
    pure_error,
    screen,
    steepest_path,
    variance_ratio,
)
from doe.plots.joint_plots import joint_plot

FACTORS = [Factor("A", 2.0, 5.0), Factor("B", -0.3, 0.9)]
DESIGN = central_composite(FACTORS)
RUNS = len(DESIGN.coded)
RESPONSE = 30.0 + DESIGN.points.to_numpy() @ [1.0, -2.0] + np.random.default_rng(1).normal(size=RUNS)
SURFACE = fit_surface(DESIGN, RESPONSE)
SCREENING = plackett_burman(FACTORS, 12)
SCREEN = screen(SCREENING, np.random.default_rng(2).normal(size=12))
TARGET = Sample(30.0, 0.5, 4)
JOINT = joint_fit({"a": Goal(SURFACE, TARGET)}, resolution=20)
REGION = SURFACE.compatible_region(TARGET, resolution=20)
PATH = steepest_path(SCREEN, 2)
VALUES = [1.0, 2.0, 4.0]

MASKED = np.ma.masked_array(RESPONSE, mask=np.arange(RUNS) == 3)
DATES = pd.date_range("2024-01-01", periods=RUNS)
LEVELS = [0.0, 1.0, -0.1, 2.0, np.nan, np.inf, "0.05", None, True, 0.05j]
NUMBERS = [np.nan, np.inf, -np.inf, "30", None, 1j, [30.0], True, datetime.date(2024, 1, 1)]
RESPONSES = [
    MASKED,
    DATES,
    pd.Series(DATES, index=DESIGN.coded.index),
    DATES - DATES[0],
    RESPONSE.astype(str),
    RESPONSE.astype(complex),
    RESPONSE > 30.0,
    RESPONSE[:-1],
    RESPONSE[None, :],
    RESPONSE.reshape(RUNS, 1, 1),
    np.where(np.arange(RUNS) == 2, np.nan, RESPONSE),
    np.where(np.arange(RUNS) == 2, np.inf, RESPONSE),
    [*RESPONSE[:-1], None],
    [*RESPONSE[:-1], "30"],
    [[1.0], [1.0, 2.0]],
    [],
    30.0,
    None,
    "response",
    {"A": 1.0},
    set(RESPONSE),
    pd.Series(RESPONSE),
    pd.Series(RESPONSE, index=DESIGN.coded.index.astype(str)),
    pd.Series(RESPONSE[:-1], index=DESIGN.coded.index[:-1]),
    pd.Series([*RESPONSE, 1.0], index=[*DESIGN.coded.index, 1]),
    pd.DataFrame({"angle": RESPONSE, "mass": 9.0 * RESPONSE}, index=DESIGN.coded.index),
    pd.Series(pd.array([*RESPONSE[:-1], pd.NA], dtype="Float64"), index=DESIGN.coded.index),
    pd.Series(RESPONSE, index=DESIGN.coded.index).astype("category"),
]
TABLES = [
    {"A": [1.0]},
    [[1.0, 2.0]],
    None,
    pd.DataFrame(),
    pd.DataFrame({"A": [-1.0, 1.0]}),
    pd.DataFrame({"A": DATES[:2], "B": [-1.0, 1.0]}),
    pd.DataFrame({"A": ["x", "y"], "B": [-1.0, 1.0]}),
    pd.DataFrame({"A": [True, False], "B": [-1.0, 1.0]}),
    pd.DataFrame({"A": [-1.0, np.nan], "B": [-1.0, 1.0]}),
    pd.DataFrame({"A": [-1.0, 1.0], "B": [-1.0, 1.0]}, index=[1, 1]),
    pd.DataFrame({"A": [2.0, 5.0], "B": [-0.3, 0.9]}),
    pd.DataFrame({"A": [-1.0, 1.0], "B": [-1.0, 1.0], "block": [1, 2]}),
]
POINTS = [
    {},
    {"A": 1.0},
    {"A": np.nan, "B": 0.0},
    {"A": np.inf, "B": 0.0},
    {"A": "3", "B": 0.0},
    {"A": None, "B": 0.0},
    pd.DataFrame({"A": [3.0]}),
    pd.DataFrame({"A": [3.0, np.nan], "B": 0.0}),
    pd.DataFrame({"A": DATES[:2], "B": 0.0}),
]

CALLS: dict[str, tuple[Callable, list]] = {
    "fit_surface response": (lambda value: fit_surface(DESIGN, value), RESPONSES),
    "screen response": (lambda value: screen(DESIGN, value), RESPONSES),
    "pure_error response": (lambda value: pure_error(DESIGN.points, value), RESPONSES),
    "climb_table response": (lambda value: climb_table(DESIGN, value, 30.0), RESPONSES),
    "from_table": (lambda value: Design.from_table(value, FACTORS), TABLES),
    "predict alpha": (lambda value: SURFACE.predict({"A": 3.0, "B": 0.0}, alpha=value), LEVELS),
    "predict points": (SURFACE.predict, POINTS),
    "reduce alpha": (SURFACE.reduce, LEVELS),
    "region alpha": (lambda value: SURFACE.compatible_region(TARGET, alpha=value), LEVELS),
    "region target": (SURFACE.compatible_region, NUMBERS),
    "region target_se": (lambda value: SURFACE.compatible_region(30.0, value), [-1.0, *NUMBERS]),
    "region target_df": (
        lambda value: SURFACE.compatible_region(30.0, 0.1, value),
        [0, -1, np.nan, None, "4"],
    ),
    "region extent": (
        lambda value: SURFACE.compatible_region(TARGET, extent=value),
        [0.0, -1.0, np.nan, np.inf, None],
    ),
    "region resolution": (
        lambda value: SURFACE.compatible_region(TARGET, resolution=value),
        [0, -3, 2.5, "9", np.nan, 10**6],
    ),
    "agrees point": (lambda value: SURFACE.agrees(value, TARGET), POINTS[:6]),
    "agrees target": (lambda value: SURFACE.agrees({"A": 3.0, "B": 0.0}, value), NUMBERS),
    "band target": (lambda value: SURFACE.band(value, 0.5), NUMBERS),
    "band half_width": (lambda value: SURFACE.band(30.0, value), [-1.0, *NUMBERS]),
    "nearest target": (SURFACE.nearest, NUMBERS),
    "nearest extent": (lambda value: SURFACE.nearest(30.0, extent=value), [0.0, -1.0, np.nan, np.inf, None]),
    "nearest to": (lambda value: SURFACE.nearest(30.0, to=value), POINTS[1:6]),
    "contour target": (SURFACE.contour, NUMBERS),
    "contour extent": (lambda value: SURFACE.contour(30.0, value), [0.0, np.nan, np.inf, "1"]),
    "contour resolution": (lambda value: SURFACE.contour(30.0, resolution=value), [0, 1, -5, 2.5, "9"]),
    "evaluate": (SURFACE.evaluate, [[1.0], [[1.0, 2.0, 3.0]], "ab", None, [["a", "b"]]]),
    "drop": (SURFACE.drop, ["C", "", "A:A:A", None, 3]),
    "region axis": (REGION.axis, ["C", None, 0]),
    "region projection": (lambda value: REGION.projection("A", value), ["A", "C", None]),
    "region section": (lambda value: REGION.section("A", value, {}), ["A", "C", None]),
    "goal target": (lambda value: Goal(SURFACE, value), [30.0, None, [30.0, 31.0], Sample(30.0, 0.0, 4)]),
    "goal surface": (lambda value: Goal(value, TARGET), [None, 30.0, SCREENING, RESPONSE]),
    "joint goals": (joint_fit, [{}, None, [Goal(SURFACE, TARGET)], {"a": SURFACE}, {"a": TARGET}]),
    "joint alpha": (lambda value: joint_fit({"a": Goal(SURFACE, TARGET)}, alpha=value), LEVELS),
    "joint resolution": (
        lambda value: joint_fit({"a": Goal(SURFACE, TARGET)}, resolution=value),
        [0, -1, 2.5, "9", 10**6],
    ),
    "joint point": (JOINT.agrees, POINTS[:6]),
    "joint names": (JOINT.region, ["b", None]),
    "joint share": (JOINT.share, ["b", None]),
    "joint band": (JOINT.band, ["b", None]),
    "joint plot truth": (lambda value: joint_plot(JOINT, value), [{}, {"A": 1.0}]),
    "screen error": (lambda value: screen(SCREENING, SCREEN.response, error=value), ["none", "", 3, "pure"]),
    "critical_t": (SCREEN.critical_t, LEVELS),
    "significant": (SCREEN.significant, LEVELS),
    "aliases": (lambda value: aliases(SCREENING, value), ["A", "A:C", "", None, 3, "A^2"]),
    "path fit": (lambda value: steepest_path(value, 2), [None, DESIGN, RESPONSE]),
    "path steps": (lambda value: steepest_path(SCREEN, value), [0, -1, 2.5, np.nan, "3", None, True]),
    "path step": (
        lambda value: steepest_path(SCREEN, 2, step=value),
        [0.0, *NUMBERS, {}, {"A": np.nan, "B": 1.0}],
    ),
    "path start": (
        lambda value: steepest_path(SCREEN, 2, start=value),
        [{"C": 1.0}, {"A": np.nan}, {"A": "3"}, {"A": None}],
    ),
    "path limits": (
        lambda value: steepest_path(SCREEN, 2, limits=value),
        [{"C": (0.0, 1.0)}, {"A": 3.0}, {"A": (9.0, 1.0)}, {"A": ("a", "b")}, {"A": (np.nan, 9.0)}],
    ),
    "path factors": (lambda value: steepest_path(SCREEN, 2, factors=value), [["C"], [], [None]]),
    "climb target": (lambda value: climb_table(PATH, VALUES, value), NUMBERS),
    "Sample.of": (
        Sample.of,
        [[], [1.0], [1.0, np.nan], [1.0, None], "ab", None, 3.0, DATES, [[1.0, 2.0]], MASKED],
    ),
    "Sample mean": (lambda value: Sample(value, 1.0, 3), NUMBERS),
    "Sample sd": (lambda value: Sample(1.0, value, 3), [-1.0, *NUMBERS]),
    "Sample n": (lambda value: Sample(1.0, 1.0, value), [1, 0, -2, 2.5, np.nan, np.inf, "3", None]),
    "compare a": (lambda value: compare_means(value, VALUES), [[], [1.0], None, "ab", DATES, MASKED, 3.0]),
    "compare b": (lambda value: compare_means(VALUES, value), [[], [1.0], None, "ab", DATES, 3.0]),
    "compare number": (
        lambda value: compare_means(VALUES, value, method="one-sample"),
        [TARGET, VALUES, np.nan, None, "3"],
    ),
    "compare margin": (
        lambda value: compare_means(VALUES, [2.0, 3.0], value),
        [0.0, -1.0, np.nan, np.inf, "1"],
    ),
    "compare method": (lambda value: compare_means(VALUES, [2.0, 3.0], method=value), ["t", None, 3]),
    "compare alpha": (lambda value: compare_means(VALUES, [2.0, 3.0], alpha=value), LEVELS),
    "compare level": (lambda value: compare_means(VALUES, [2.0, 3.0], 1.0, alpha=value), [0.5, 0.7]),
    "agreement values": (
        lambda value: agreement(value, VALUES),
        [[], [1.0, 2.0], None, "abc", [1.0, 2.0, np.nan]],
    ),
    "agreement reference": (lambda value: agreement(VALUES, value), [DATES[:3], ["a", "b", "c"], [VALUES]]),
    "agreement labels": (
        lambda value: agreement(pd.Series(VALUES), value),
        [pd.Series(VALUES, index=[1, 2, 3]), pd.Series(VALUES, index=[0, 1, 1])],
    ),
    "agreement variance": (
        lambda value: agreement(VALUES, VALUES, value),
        [-1.0, np.nan, [1.0, 2.0], "1", None],
    ),
    "agreement reference variance": (
        lambda value: agreement(VALUES, VALUES, 0.0, value),
        [-1.0, np.nan, np.inf, "1", None],
    ),
    "agreement settings": (
        lambda value: agreement(VALUES, VALUES, settings=value),
        [["a"], "abc", [1, 2, None]],
    ),
    "agreement confidence": (lambda value: agreement(VALUES, VALUES, confidence=value), LEVELS),
    "noise_floor": (noise_floor, [[], [1.0], None, "ab", DATES, MASKED, [1.0, np.inf]]),
    "noise_floor confidence": (lambda value: noise_floor(VALUES, value), LEVELS),
    "variance_ratio": (lambda value: variance_ratio(value, 3, 1.0, 4), [0.0, -1.0, *NUMBERS]),
    "curvature": (lambda value: curvature_test(value, VALUES), [[], [1.0], None, "ab", DATES]),
    "power alpha": (lambda value: effect_power(1.0, 1.0, 8, 4, value), LEVELS),
    "power effect": (lambda value: effect_power(value, 1.0, 8, 4), NUMBERS),
    "power sd": (lambda value: effect_power(1.0, value, 8, 4), [0.0, -1.0, *NUMBERS]),
    "detectable power": (
        lambda value: detectable_effect(1.0, 8, 4, power=value),
        [0.01, 1.0, np.nan, None, "0.8"],
    ),
    "detectable runs": (lambda value: detectable_effect(1.0, value, 4), [0, -8, *NUMBERS]),
}
"""Name of the argument, a call with it, and wrong values."""

HOSTILE = [
    pytest.param(call, value, id=f"{name} {number}")
    for name, (call, values) in CALLS.items()
    for number, value in enumerate(values)
]


def test_the_list_is_long_enough_to_mean_something() -> None:
    assert len(HOSTILE) >= 400


@pytest.mark.parametrize(("call", "value"), HOSTILE)
def test_a_wrong_value_is_refused_with_its_rule(call: Callable, value: object) -> None:
    with pytest.raises(DesignError) as error:
        call(value)
    assert len(str(error.value)) > 20


@pytest.mark.parametrize("name", ["response", "error", "error_percent"])
def test_a_factor_is_not_overwritten_by_a_column_of_the_climb(name: str) -> None:
    design = plackett_burman([Factor(name, 0.0, 1.0)], 4)
    with pytest.raises(DesignError, match=f"'{name}' names a column"):
        climb_table(design, np.arange(4.0), 1.0)


def test_a_target_of_zero_has_no_percent() -> None:
    assert climb_table(PATH, VALUES, 0.0)["error_percent"].isna().all()


def test_plain_calls_are_not_refused() -> None:
    """Integers, lists, Series in another order, numbers of Python's other kinds: all are read as they are."""
    shuffled = pd.Series(RESPONSE, index=DESIGN.coded.index).sample(frac=1.0, random_state=1)
    for response in (list(RESPONSE), shuffled, shuffled.to_frame(), RESPONSE.astype(object)):
        assert isinstance(fit_surface(DESIGN, response), Surface)
        np.testing.assert_allclose(fit_surface(DESIGN, response).fit.params, SURFACE.fit.params, rtol=1e-12)
    assert compare_means([1, 2, 4], (2, 3)).df > 0.0
    assert SURFACE.predict({"A": 3, "B": np.float32(0.0)}, alpha=np.float64(0.1)).notna().all(axis=None)
