"""Wrong calls of designs and analyses: each is refused with a rule, none fails inside a library."""

from collections.abc import Callable

import numpy as np
import pytest

from doe import (
    Category,
    DesignError,
    Factor,
    Wish,
    add_axial,
    add_center,
    alias_structure,
    box_behnken,
    box_cox,
    canonical,
    central_composite,
    definitive_screening,
    design_quality,
    fit_formula,
    fit_mixture,
    fit_surface,
    foldover,
    fractional_factorial,
    full_factorial,
    influence,
    join,
    latin_hypercube,
    maximize,
    minimize,
    most_desirable,
    optimal_design,
    plackett_burman,
    ridge_path,
    robust_coefficients,
    simplex_centroid,
    simplex_lattice,
    sobol,
    stationary_region,
    two_level_effects,
)

FACTORS = [Factor("A", 0.0, 1.0), Factor("B", 2.0, 5.0), Factor("C", -1.0, 1.0)]
DESIGN = central_composite(FACTORS)
RESPONSE = np.random.default_rng(0).normal(size=len(DESIGN.coded)) + 5.0 * DESIGN.points["A"].to_numpy() ** 2
SURFACE = fit_surface(DESIGN, RESPONSE)
CORNERS = full_factorial(FACTORS)
BLENDS = simplex_lattice(["x", "y", "z"], 2)

NOTHINGS = [None, "x", -1, 0, 1.5, np.nan, np.inf, [], {}, True, (1, 2, 3), np.array([1.0])]
NO_NUMBERS = [None, "x", np.nan, np.inf, [], {}, (1, 2, 3)]
NO_COUNTS = [*NO_NUMBERS, -1, 1.5]

CALLS: dict[str, tuple[Callable, list]] = {
    **{
        f"{build.__name__} factors": (build, NOTHINGS)
        for build in (full_factorial, box_behnken, definitive_screening, plackett_burman, central_composite)
    },
    **{
        f"{use.__name__} object": (use, NOTHINGS)
        for use in (
            foldover, alias_structure, design_quality, influence, box_cox, robust_coefficients, canonical,
            stationary_region, maximize, minimize,
        )
    },
    "full_factorial levels": (lambda value: full_factorial(FACTORS, value), [*NO_COUNTS, 0, 1]),
    "fractional_factorial runs": (lambda value: fractional_factorial(FACTORS, value), NO_COUNTS[1:]),
    "box_behnken center": (lambda value: box_behnken(FACTORS, center=value), NO_COUNTS[1:]),
    "sobol runs": (lambda value: sobol(FACTORS, value), [*NO_COUNTS, 3]),
    "latin_hypercube runs": (lambda value: latin_hypercube(FACTORS, value, seed=1), [*NO_COUNTS, 1]),
    "central_composite alpha": (lambda value: central_composite(FACTORS, value), [*NO_NUMBERS, 0.0]),
    "central_composite center": (lambda value: central_composite(FACTORS, center=value), NO_COUNTS),
    "plackett_burman runs": (lambda value: plackett_burman(FACTORS, value), [*NO_COUNTS[1:], 14]),
    "optimal_design runs": (lambda value: optimal_design(FACTORS, value), [*NO_COUNTS, 0]),
    "simplex_lattice degree": (lambda value: simplex_lattice(["x", "y"], value), [*NO_COUNTS, 0]),
    "simplex_lattice names": (lambda value: simplex_lattice(value, 2), [None, "xy", 1, 1.5, [], ["x"]]),
    "simplex_centroid names": (simplex_centroid, [None, "xy", 1, 1.5, [], ["x", "x"]]),
    "foldover factors": (lambda value: foldover(CORNERS, value), [-1, 1.5, np.nan, ["D"], "AB"]),
    "add_center count": (lambda value: add_center(CORNERS, value), [*NO_COUNTS, 0]),
    "add_axial alpha": (lambda value: add_axial(CORNERS, value), [*NO_NUMBERS, 0.0]),
    "add_axial center": (lambda value: add_axial(CORNERS, 1.5, value), NO_COUNTS),
    "join": (lambda value: join(CORNERS, value), NOTHINGS),
    "alias_structure order": (lambda value: alias_structure(CORNERS, value), [*NO_COUNTS, 0]),
    "two_level_effects order": (lambda value: two_level_effects(CORNERS, range(8), value), NO_COUNTS[1:]),
    "fit_formula formula": (lambda value: fit_formula(DESIGN, RESPONSE, value), [None, 1, "", "D", "~ A"]),
    "fit_mixture response": (lambda value: fit_mixture(BLENDS, value), [None, "x", {}, [1.0, 2.0]]),
    "fit_mixture mixture": (lambda value: fit_mixture(value, [1.0]), [None, DESIGN, "x"]),
    "fit_surface model": (lambda value: fit_surface(DESIGN, RESPONSE, value), [None, 1, "cubic", (1, 2)]),
    "ridge_path radii": (lambda value: ridge_path(SURFACE, value), [None, "x", {}, [], [-1.0], [np.nan]]),
    "maximize extent": (lambda value: maximize(SURFACE, extent=value), [*NO_NUMBERS, 0.0]),
    "most_desirable": (lambda value: most_desirable({"a": SURFACE}, value), [None, "x", 1, {}]),
    "predict": (SURFACE.predict, [None, "x", 1, [], (1, 2, 3)]),
    "Wish low": (lambda value: Wish(value, 2.0), [*NO_NUMBERS, 2.0]),
    "Wish target": (lambda value: Wish(0.0, 2.0, target=value), [*NO_NUMBERS[1:], 3.0]),
    "Factor low": (lambda value: Factor("A", value, 3.0), [*NO_NUMBERS, 3.0]),
    "Factor name": (lambda value: Factor(value, 0.0, 1.0), [None, 1, "", "A:B", " A"]),
    "Category levels": (lambda value: Category("c", value), [None, "ab", 1, [], ["a"], ["a", "a"]]),
    "seed": (lambda value: full_factorial(FACTORS, seed=value), ["x", -1, 1.5, np.nan, {}]),
}  # fmt: skip
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
