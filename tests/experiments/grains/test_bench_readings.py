"""Bench readings: formulas against simulated trajectories, errors against draws, and what is refused."""

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from doe import StatedValue
from experiments.grains.bench_readings import METHODS, Formula, formula_of, read_columns
from experiments.io.errors import InputError
from experiments.io.units import Quantity

G = 9.81


def values(**given: float | str | list) -> dict[str, list[Quantity]]:
    lists = {name: one if isinstance(one, list) else [one] for name, one in given.items()}
    return {name: [Quantity.parse(each) for each in column] for name, column in lists.items()}


def one(method: str, **given: float | str) -> float:
    columns = values(**given)
    formula = formula_of(method, columns)
    exact = values(**{next(iter(given)): 1e-9})
    return formula.of_means(columns, exact, 1).mean


def test_a_block_slides_where_friction_no_longer_holds_it() -> None:
    mu = 0.42
    angles = np.linspace(0.0, 45.0, 100_001)
    slides = np.sin(np.radians(angles)) > mu * np.cos(np.radians(angles))
    # the step of the angle is .00045 deg, so that its tangent is known to 1e-5
    assert one("incline", angle=float(angles[slides][0])) == pytest.approx(mu, abs=2e-5)


def test_a_sphere_rolls_as_far_as_its_resistance_lets_it() -> None:
    mu, slope, distance, step = 0.05, math.radians(30.0), 0.1, 1e-5
    # energy per weight, the resistance taking mu times the normal force over the way
    energy = distance * (math.sin(slope) - mu * math.cos(slope))
    run = 0.0
    while energy > 0.0:
        energy, run = energy - mu * step, run + step
    # the run is known to one step of 10 um in 0.83 m
    found = one("rolling-run", slope="30 deg", distance="100 mm", run=f"{1e3 * run} mm")
    assert found == pytest.approx(mu, rel=2e-5)


@pytest.mark.parametrize("restitution", [0.2, 0.55, 0.9])
def test_a_ball_that_bounces_gives_its_restitution(restitution: float) -> None:
    fall = 0.2
    speed = restitution * math.sqrt(2.0 * G * fall)
    assert one("rebound", fall="200 mm", height=f"{1e3 * speed**2 / (2 * G)} mm") == pytest.approx(
        restitution
    )
    times = {"first": 2.0 * speed / G, "second": 2.0 * restitution * speed / G}
    assert one("rebound", **times) == pytest.approx(restitution)


@pytest.mark.parametrize(("normal", "tangential"), [(0.35, 0.78), (0.8, 0.6), (0.6, 1.0)])
def test_a_grain_off_a_tilted_plate_gives_the_normal_part(normal: float, tangential: float) -> None:
    fall = 0.3
    hit = math.sqrt(2.0 * G * fall) / math.sqrt(2.0)  # along the plate and into it
    away, up = (normal + tangential) * hit / math.sqrt(2.0), (normal - tangential) * hit / math.sqrt(2.0)

    def distance(height: float) -> float:
        return away * (up + math.sqrt(up**2 + 2.0 * G * height)) / G

    found = one(
        "rebound-45",
        fall=fall,
        height_1=0.1,
        distance_1=distance(0.1),
        height_2=0.25,
        distance_2=distance(0.25),
    )
    assert found == pytest.approx(normal, rel=1e-9)


def test_two_pendulums_give_the_restitution_of_their_hit() -> None:
    restitution, start = 0.7, math.radians(60.0)
    speed = math.sqrt(2.0 * G * (1.0 - math.cos(start)))  # length 1
    after = [0.5 * (1.0 - restitution) * speed, 0.5 * (1.0 + restitution) * speed]  # equal masses
    swings = [math.degrees(math.acos(1.0 - v**2 / (2.0 * G))) for v in after]
    assert one("pendulum", release="60 deg", striker=swings[0], struck=swings[1]) == pytest.approx(
        restitution
    )


ERRORS: dict[str, tuple[Mapping[str, float], Mapping[str, float]]] = {
    "incline": ({"angle": 20.0}, {"angle": 1.0}),
    "rolling-run": ({"slope": 30.0, "distance": 100.0, "run": 900.0}, {"slope": 0.5, "run": 40.0}),
    "rebound": ({"fall": 300.0, "height": 60.0}, {"fall": 2.0, "height": 3.0}),
    "rebound-45": (
        {"fall": 300.0, "height_1": 150.0, "distance_1": 140.0, "height_2": 300.0, "distance_2": 210.0},
        {"distance_1": 2.0, "distance_2": 2.0},
    ),
    "pendulum": ({"release": 60.0, "striker": 10.0, "struck": 50.0}, {"striker": 0.5, "struck": 0.5}),
}


@pytest.mark.parametrize("method", ERRORS)
def test_the_delta_method_gives_the_scatter_of_drawn_readings(method: str) -> None:
    mean, sd = ERRORS[method]
    formula = formula_of(method, mean)
    found = formula.of_means(values(**mean), values(**sd), 12)
    rng = np.random.default_rng(5)
    drawn = {name: [*rng.normal(value, sd.get(name, 0.0), 10_000)] for name, value in mean.items()}
    scatter = formula.of_readings(values(**drawn))
    # 10,000 draws know a standard deviation to .7 %; three of these, and the curvature of the formula.
    assert found.sd == pytest.approx(scatter.sd, rel=0.03)
    assert found.mean == pytest.approx(scatter.mean, abs=0.1 * scatter.sd)
    assert found.n == 12
    assert found.se == pytest.approx(found.sd / math.sqrt(12))


def test_units_are_read_and_lengths_count_by_their_ratio() -> None:
    assert one("incline", angle=f"{math.radians(20.0)} rad") == pytest.approx(one("incline", angle=20))
    assert one("rebound", fall="0.3 m", height="60 mm") == pytest.approx(one("rebound", fall=30, height=6))


def test_one_reading_has_the_stated_error() -> None:
    found = formula_of("value", [""]).of_means(values(**{"": 0.35}), values(**{"": 0.06}), 1)
    assert isinstance(found, StatedValue)
    assert (found.mean, found.se, found.df) == pytest.approx((0.35, 0.06, math.inf))


def test_a_fixed_quantity_holds_for_all_readings() -> None:
    found = formula_of("rebound", ["fall", "height"]).of_readings(values(fall="300 mm", height=[58, 61, 66]))
    assert found.n == 3
    assert found.mean == pytest.approx(np.mean(np.sqrt(np.array([58, 61, 66]) / 300.0)))


INCLINE, REBOUND = METHODS["incline"][0], METHODS["rebound"][0]


@pytest.mark.parametrize(
    ("formula", "columns", "words"),
    [
        (INCLINE, {"angle": [95.0, 20.0]}, "angle must be between 0 and 90 deg, got 95"),
        (INCLINE, {"angle": [0.0, 20.0]}, "angle must be between"),
        (INCLINE, {"angle": [20.0]}, "needs two readings or more"),
        (INCLINE, {"angle": [20.0, 20.0]}, "shows no scatter"),
        (INCLINE, {"angle": ["20 mm", 21.0]}, "angle needs a unit of angle"),
        (INCLINE, {"angel": [20.0, 21.0]}, "needs angle"),
        (
            REBOUND,
            {"fall": [300.0], "height": [310.0, 60.0]},
            "a restitution above 0 and at most 1, got 1.01",
        ),
        (REBOUND, {"fall": [300.0, 300.0], "height": [50.0, 60.0, 61.0]}, "as many of fall"),
    ],
)
def test_what_no_bench_can_read_is_refused(formula: Formula, columns: dict, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        formula.of_readings(values(**columns))


def test_quantities_that_give_nothing_are_refused() -> None:
    away = {"fall": 300, "height_1": 150, "distance_1": 140, "height_2": 300, "distance_2": 100}
    with pytest.raises(ValueError, match=r"restitution above 0 and at most 1, got nan from fall 0\.3"):
        one("rebound-45", **away)
    with pytest.raises(ValueError, match=r"rebound needs fall and height, or first and second, got fall"):
        formula_of("rebound", ["fall"])
    with pytest.raises(ValueError, match="sd must be positive"):
        INCLINE.of_means(values(angle=20), values(angle=0.0), 3)


def test_a_table_has_a_column_for_each_quantity(tmp_path: Path) -> None:
    path = tmp_path / "rebound.csv"
    path.write_text("no.;Fall [cm];height\n1;30;61,5 mm\n2;30;58 mm\n", encoding="utf-8")
    columns = read_columns(path, "rebound")
    assert columns["height"][0] == Quantity(61.5, "mm")
    assert formula_of("rebound", columns).of_readings(columns).mean == pytest.approx(0.446, abs=1e-3)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("no.,angel\n1,20\n", "needs rows below the columns angle"),
        ("angle\n", "has no rows below"),
        ("angle\n20\nsteep\n", "readings.csv:3: angle: must be a number"),
    ],
)
def test_a_table_that_cannot_be_read_is_refused(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "readings.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=words):
        read_columns(path, "incline")
