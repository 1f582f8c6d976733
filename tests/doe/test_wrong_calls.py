"""Wrong calls: every argument of every public function rejects wrong values with a rule of this package."""

import datetime
import inspect
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest

import doe
from doe import Factor, Goal, Sample, Wish, plots
from doe.curves.curve_emulator import CurveEmulator
from doe.curves.curve_fit import MeasuredCurve, fit_curves
from doe.discrepancy import Measured, Settings, settings_of
from doe.errors import RuleError

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
BLOCKS = pd.Series(1, DESIGN.coded.index)

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

RIGHT_VALUES: list[tuple[Any, str]] = [
    (FACTORS, "factors"),
    ([*FACTORS, Factor("D", 0, 1)], "fractional_factorial.factors"),
    (tuple(FACTORS), "Design.factors"),
    (["A"], "foldover.factors steepest_path.factors"),
    (["A", "B", "C"], "cube_plot.factors"),
    (CORNERS, "design existing"),
    (DESIGN, "one design_quality.design fit_surface.design fit_formula.design"),
    (DESIGN.points, "pure_error.coded"),
    (DESIGN.coded, "Design.coded"),
    (DESIGN.coded.assign(day=1), "table"),
    (BLOCKS, "Design.blocks pure_error.blocks labels"),
    (SCREENING, "screen.design"),
    (BLENDS, "mixture"),
    (BLENDS.shares, "shares"),
    (EIGHT, "response"),
    (RESPONSE, "fit_surface.response fit_formula.response pure_error.response"),
    (RESPONSE[:12], "screen.response"),
    (RESPONSE[:6], "fit_mixture.response transfer.response"),
    (RUNS, "transfer.runs"),
    (VALUES, "a values reference climb_table.response climb_plot.response"),
    (SURFACE, "surface source"),
    (SURFACES, "surfaces"),
    (WISHES, "wishes"),
    (POINT, "point points at to truth"),
    (SCREEN, "result steepest_path.fit"),
    (AGREED, "agreement_plot.result"),
    (doe.design_quality(DESIGN), "quality"),
    (PATH, "path"),
    (REGION, "region"),
    (TARGET, "Goal.target agrees.target"),
    ({"y": Goal(SURFACE, TARGET)}, "goals"),
    ({}, "emulators Mixture.lower"),
    ([CURVE], "curves"),
    ([[[1.0], [2.0]]] * 2, "heaps"),
    ([[0.0, 0.0, 0.0]], "evaluate.coded cells made"),
    (list("abc"), "settings strata groups"),
    (["x", "y"], "components"),
    ({"x": 0.1}, "lower"),
    ({"A": 0.5}, "start"),
    ({"A": (0.0, 9.0)}, "limits"),
    ({"y": (1.0, 2.0)}, "overlay_plot.limits"),
    (["A < 2"], "constraints"),
    (["a", "b"], "Category.levels"),
    ([1, 2], "<lambda>.blocks"),
    ([2.0, 3.0], "b"),
    ([1.0], "effects"),
    ([0.5], "radii"),
    ([0.05], "alphas"),
    ([1], "select.runs"),
    ((), "dummies"),
    (True, "full interior descend larger bonferroni fit_formula.coded from_table.coded"),
    (False, "coded box_behnken.blocks"),
    (0, "spare turn fractional_factorial.center"),
    (1, "seed center starts"),
    (2, "blocks degree order replicates levels steps add_center.count"),
    (3, "n digits"),
    (4, "fractional_factorial.resolution"),
    (5, "count resolution"),
    (8, "runs observations"),
    (12, "plackett_burman.runs optimal_design.runs"),
    (0.0, "low"),
    (0.05, "alpha pareto_chart.bonferroni"),
    (0.1, "value_variance reference_variance target_se target_sd"),
    (0.2, "scale_sd"),
    (0.5, "step half_width"),
    (0.8, "power"),
    (0.9, "confidence"),
    (1.0, "extent radius effect sd mean mean_sq df error_ms margin weight importance Wish.target"),
    (1.5, "central_composite.alpha add_axial.alpha"),
    (2.0, "high climb_table.target climb_plot.target"),
    (4.0, "error_df target_df"),
    (9.0, "target level"),
    ("A", "name x"),
    ("B", "y trace"),
    ("y", "band.name"),
    ("A:B", "interaction"),
    ("A * B", "formula"),
    ("day", "block"),
    ("D", "criterion"),
    ("lloyd", "optimize"),
    ("dummies", "error"),
    ("welch", "method"),
    ("natural", "units"),
    ("quadratic", "model"),
    ("interaction", "optimal_design.model"),
    ("first-order", "power_table.model"),
    ("linear", "fit_mixture.model"),
]
"""Right values, and the arguments that take them: of one function, or of all others."""
RIGHT = {name: value for value, names in RIGHT_VALUES for name in names.split()}

PUBLIC = [
    getattr(doe, name) for name in doe.__all__ if name[0].islower() and name not in {"join", "fit_curves"}
]
DRAWN = [getattr(plots, name) for name in plots.__all__ if name.endswith(("_plot", "_plots", "_chart"))]
MEMBERS: list[tuple[Any, str]] = [
    (doe, "Mixture Factor Category Sample Goal Wish Design"),
    (DESIGN, "from_table select factor"),
    (SURFACE, "predict evaluate reduce equation agrees compatible_region band nearest contour"),
    (REGION, "axis projection"),
    (JOINT, "agrees band"),
    (SCREEN, "critical_t significant"),
    (FORMULA, "predict"),
    (CARRIED, "evaluate intervals"),
]
FUNCTIONS: list[Callable] = [
    *PUBLIC,
    *DRAWN,
    *(getattr(owner, name) for owner, names in MEMBERS for name in names.split()),
    lambda one, blocks: doe.join(CORNERS, one, blocks=blocks),
    lambda emulators, curves: fit_curves(emulators, [0.0], curves, 1.0, 1),
]
"""All public functions, and the classes and methods that check what they are given."""


def right_values(function: Callable) -> dict[str, Any]:
    """Return arguments that a function accepts; only those with a default may be missing from the table."""
    names = {name: f"{function.__name__}.{name}" for name in inspect.signature(function).parameters}
    return {
        name: RIGHT.get(own, RIGHT.get(name)) for name, own in names.items() if {own, name} & RIGHT.keys()
    }


MANY, EMPTY = "1000000000", "Empty DataFrame\nColumns: []\nIndex: []"
MEANINGFUL = {
    "seed": ("None", MANY),
    **dict.fromkeys(("order", "replicates", "observations", "n", "turn"), (MANY,)),
    **dict.fromkeys(("start", "limits", "lower"), ("{}", "{'q': 3}")),
    **dict.fromkeys(("scale_sd", "target_df"), ("inf",)),
    **dict.fromkeys(
        ("surface_plot at", "cube_plot at", "contour_plot at", "overlay_plot at"), ("{}", "{'q': 3}")
    ),
    **dict.fromkeys(("axis name", "projection x", "projection y", "band name"), ("[]", "{}", EMPTY)),
    **dict.fromkeys(("Factor name", "Category name"), ("'nothing'",)),
    **dict.fromkeys(("compare_means b", "Wish weight"), ("(1.0, 2.0)",)),
    "central_composite alpha": ("3",),
    "latin_hypercube optimize": ("None",),
    "<lambda> blocks": ("None",),
    "fit_surface model": ("[]",),
    **dict.fromkeys(("Factor low", "Factor high"), ("True",)),
    **dict.fromkeys(("agrees target", "value_variance"), ("3.5",)),
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


@pytest.mark.parametrize("function", FUNCTIONS)
def test_a_wrong_value_is_rejected_with_its_rule(function: Callable) -> None:
    right = right_values(function)
    for name in right:
        for value in wrong_values(function, name):
            with pytest.raises(doe.DesignError) as error:
                function(**{**right, name: value})
            assert len(str(error.value)) > 20


@pytest.mark.parametrize("function", PUBLIC + DRAWN)
def test_right_values_are_accepted(function: Callable) -> None:
    function(**right_values(function))


def test_plain_calls_are_accepted() -> None:
    """Integers, lists, Series in another order and numbers of other kinds are read as they are."""
    shuffled = pd.Series(RESPONSE, index=DESIGN.coded.index).sample(frac=1.0, random_state=1)
    for response in (list(RESPONSE), shuffled, shuffled.to_frame(), RESPONSE.astype(object)):
        again = doe.fit_surface(DESIGN, response).fit.params
        np.testing.assert_allclose(again, SURFACE.fit.params, rtol=1e-12)
    assert doe.compare_means([1, 2, 4], (2, 3)).df > 0.0
    assert SURFACE.predict({**POINT, "A": 3}, alpha=np.float64(0.1)).notna().all(axis=None)
    assert doe.climb_table(PATH, VALUES, 0.0)["error_percent"].isna().all()


VARIETY = doe.Category("variety", ["old", "new", "wild"])
SPEEDS = [Factor(name, 0.0, 10.0) for name in ("v0", "v1", "v2")]
TWELVE = [Factor(f"x{number}", 0.0, 1.0) for number in range(12)]
BLENDED, ROW, NAN = pd.DataFrame({"a": [0.5], "b": [0.6]}), [[20.0, 1.0]], np.array([[np.nan]])


def fraction(*generators: str) -> doe.Design:
    return doe.fractional_factorial(TWELVE[:5], generators=generators)


def square(*runs: int) -> doe.Surface:
    return doe.fit_surface(doe.central_composite(FACTORS[:2]).select(runs), np.arange(float(len(runs))))


def climb(name: str) -> pd.DataFrame:
    return doe.climb_table(doe.plackett_burman([Factor(name, 0.0, 1.0)], 4), np.arange(4.0), 1.0)


def measured(rows: list[list[float]], *reasons: str) -> Measured:
    return Measured(
        ("base",), ("angle", "height"), {"base": np.array(rows)}, {"base": reasons} if reasons else {}
    )


DESIGNS = [
    (lambda: doe.fractional_factorial(TWELVE, resolution=6), "no fraction of resolution 6 in 12 factors"),
    (lambda: fraction("x3 = x0:x9"), "a generator must give one of"),
    (lambda: fraction("x9 = x0:x1"), "a generator must give one of"),
    (lambda: fraction("x0:x1"), "a generator must give one of"),
    (lambda: fraction("x4 = x3:x0", "x3 = x0:x1"), "a generator must give one of"),
    (lambda: doe.alias_structure(doe.box_behnken(FACTORS)), "factor 'A' is 0"),
    (lambda: doe.join(CORNERS, doe.full_factorial(SPEEDS)), "same factors"),
    (lambda: doe.sobol(SPEEDS, 12), "such as 8 or 16, got 12"),
    (lambda: doe.optimal_design(SPEEDS, 12, constraints=["v0 > 11"]), "no candidate run keeps"),
    (lambda: doe.optimal_design(SPEEDS, 12, constraints=["v9 > 11"]), "cannot be evaluated"),
    (lambda: doe.optimal_design(SPEEDS, 12, constraints=["v0 == v1"]), "cannot distinguish 10 coefficients"),
    (lambda: doe.central_composite([*FACTORS, VARIETY]), "'variety' is a category"),
    (lambda: doe.box_behnken([*FACTORS, VARIETY]), "'variety' is a category"),
    (lambda: doe.definitive_screening([*FACTORS, VARIETY]), "'variety' is a category"),
    (lambda: doe.plackett_burman([VARIETY]), "category 'variety' has 3"),
    (lambda: VARIETY.to_coded("tame"), "must be one of"),
    (lambda: doe.power_table(CORNERS, model="three-factor"), "leave no degrees of freedom"),
    (lambda: doe.Mixture(BLENDED, {}), "add up to 1"),
    (lambda: doe.simplex_centroid(["a", "b"], lower={"a": 0.6, "b": 0.5}), "less than 1"),
    (lambda: DESIGN.select([20]), "no run 20"),
    (lambda: replace(DESIGN, blocks=BLOCKS.where(BLOCKS.index > 1)), "run 1 has no block"),
    (
        lambda: doe.Design(DESIGN.factors, DESIGN.coded, blocks=BLOCKS.reset_index(drop=True)),
        "by the runs' labels",
    ),
    (
        lambda: doe.Design.from_table(DESIGN.points, FACTORS, coded=True, block="day"),
        "no column for the block",
    ),
]
ANALYSES = [
    (lambda: square(1, 2, 3, 4, 9, 10, 11), r"cannot distinguish these terms: B\^2 with A\^2"),
    (lambda: square(1, 2, 3, 5, 7, 9), "6 observations leave no residual for intercept, A, B"),
    (lambda: doe.fit_mixture(BLENDS, EIGHT[:6], "cubic"), "model must be one of"),
    (lambda: doe.two_level_effects(doe.full_factorial(FACTORS[:2]), EIGHT[:4]), "must be five or more"),
    (lambda: doe.ridge_path(SURFACE, [-1.0]), "finite and not negative"),
    (
        lambda: doe.compare_means(VALUES, TARGET, method="one-sample"),
        r"a known number, .*got Sample\(mean=9.0, sd=0.5, n=4\)",
    ),
    (lambda: Wish(0.0, -1.0), "low of a wish must be below high, got 0.0 and -1.0"),
    (lambda: Wish(0.0, 10.0, target=20.0), "target must be between 0.0 and 10.0, got 20.0"),
    (lambda: Wish(0.0, 10.0, weight=0.0), "weight of a wish must be positive and finite, got 0.0"),
    (lambda: Wish(0.0, 10.0, weight=(1.0, 2.0)), "weight without target must be one number, got"),
    (lambda: Wish(0.0, 10.0, importance=-1.0), "importance of a wish must be positive"),
    (lambda: climb("response"), "'response' names a column"),
    (lambda: climb("error"), "'error' names a column"),
    (lambda: climb("error_percent"), "'error_percent' names a column"),
]
RULES = [
    (lambda: CurveEmulator.of(np.zeros((4, 2)), np.zeros((4, 5))), "must be 6 or more"),
    (lambda: CurveEmulator.of(np.zeros((8, 2)), np.zeros((7, 5))), "must have a row for each run"),
    (lambda: CurveEmulator.of(np.zeros((8, 2)), np.full((8, 5), np.nan)), "must be finite"),
    (lambda: fit_curves({}, [0.0], [], 1.0, 1), "must have at least one measured curve"),
    (lambda: doe.ProfileSample.of(np.zeros((2, 9))), r"profiles: must be 3 rows or more, got shape \(2, 9\)"),
    (lambda: doe.ProfileSample.of(np.zeros(9)), "profiles: must be 3 rows or more"),
    (lambda: doe.ProfileSample.of(np.ones((4, 9))), "profiles: must scatter, got the same profile each time"),
    (lambda: doe.ProfileSample.of(np.vstack([np.ones((3, 1)), NAN])), r"profiles\[3\]: must be finite"),
    (lambda: measured([[20.0]]), "2 columns, one per observable"),
    (lambda: measured([[20.0, np.inf]]), "infinite"),
    (lambda: measured(ROW, "", ""), "one entry per replicate"),
    (lambda: measured(ROW, "lost"), "failed"),
    (lambda: measured(ROW).only(["r50"]), "must name measured observables"),
    (lambda: Settings(false_alarm=0.0), "false_alarm: must be between 0 and 1"),
    (lambda: Settings(bank_repeats=1), "bank_repeats: must be a whole number of at least 2"),
    (lambda: Settings(bank_points=24.5), "bank_points: must be a whole number"),
    (lambda: Settings(bank_points=10**9), "bank_points: must be .* at most 100,000"),
    (lambda: Settings(tie_margin=-1.0), "tie_margin: must not be negative"),
    (
        lambda: settings_of({"tie_margn": 3.0}, "a.json"),
        r"a\.json: must be one of .*tie_margin.*, got tie_margn",
    ),
]


@pytest.mark.parametrize(
    ("kind", "build", "message"),
    [*((doe.DesignError, *case) for case in DESIGNS + ANALYSES), *((RuleError, *case) for case in RULES)],
)
def test_what_breaks_a_rule_is_refused_with_it(kind: type, build: Callable, message: str) -> None:
    with pytest.raises(kind, match=message):
        build()
