"""A search on drums: speeds, inclinations and wall materials as conditions, whole surfaces among the data."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from small_study import ANGLE, TUBE

from dem_warp.scenes.drum_surface import STATIONS
from doe.discrepancy import Outcomes, Point, Verdict, drive, load_bank
from experiments.discover.search import Search
from experiments.io.errors import InputError
from experiments.measurement.measured_file import read_measured
from experiments.studyfile import Study, load_study
from experiments.studyfile.observables import SURFACE

DRUM = '[scene.drum]\ndiameter = "60 mm"\nlength = "20 mm"\nrotation_rate = "15 1/min"\n'
CONDITIONS = """
[condition.slow]

[condition.fast]
scene.drum.rotation_rate = "45 1/min"

[condition.inclined]
scene.drum.inclination = "30 deg"

[condition.glass]
contact.grain-wall.static_friction = 0.2

[condition.fast-glass]
held_out = true
scene.drum.rotation_rate = "45 1/min"
contact.grain-wall.static_friction = 0.2

[discover]
mechanisms = ["contact_adhesion", "rolling_torque", "size_spread"]

[discover.settings]
bank_points = 24
bank_mechanism_points = 12
refinement_rounds = 2
finish_points = 0
shortlist = 2
pair_candidates = 2
"""
RADIUS = 0.03
NOISE = 2e-4
HIDDEN = {"contact_adhesion": 0.6}
"""Sizes of the effects in the measured heaps, as shares of the largest."""


class Beds:
    """A world of drums: smooth surfaces, linear in factor and sizes, whose heights scatter together."""

    observables = ("dynamic_angle", *SURFACE)

    def __init__(self, search: Search) -> None:
        self.space = search.space
        rng = np.random.default_rng(8)
        self._places = np.array(STATIONS)
        shape = (len(self.space.conditions), 4)
        self._base = rng.normal(size=shape)
        self._slopes = rng.normal(size=(len(self.space.factors), *shape))
        self._signatures = {name: 4.0 * rng.normal(size=shape) for name in self.space.names}

    def __call__(self, points: Sequence[Point]) -> Outcomes:
        rows = np.array([self._row(point) for point in points]).reshape(len(points), len(self.observables))
        return Outcomes(rows, ("",) * len(points))

    def _row(self, point: Point) -> np.ndarray:
        condition = self.space.conditions.index(point.condition)
        bends = (
            self._base[condition] + self.space.coded_theta(np.array(point.theta)) @ self._slopes[:, condition]
        )
        for name, size in point.sizes:
            share = size / self.space.mechanism(name).maximum
            bends = bends + share * self._signatures[name][condition]
        rng = np.random.default_rng(point.seed)
        bends = bends + 0.3 * rng.normal(size=4)
        heights = 5e-4 * np.polynomial.legendre.legval(self._places, bends) - 0.1 * RADIUS * self._places
        heights = heights + 0.1 * NOISE * rng.normal(size=len(self._places))
        line = np.polyfit(self._places * RADIUS, heights, 1)[0]
        return np.array([np.degrees(np.arctan(-line)), *heights])


@pytest.fixture
def study(write_study: Callable[..., Path]) -> Study:
    return load_study(write_study((TUBE, DRUM), (ANGLE, ""), add=CONDITIONS))


def write_measurements(folder: Path, search: Search, world: Beds) -> Path:
    """Write a table of measurements that names a file of profiles for each condition."""
    sizes = tuple((name, part * search.space.mechanism(name).maximum) for name, part in HIDDEN.items())
    rows = ["condition,replicate,observable,value,unit,profile"]
    for condition in search.space.conditions:
        lines = ["replicate,x,z"]
        for replicate in range(1, 7):
            point = Point((0.37,), sizes, condition, 7_000 + 10 * len(rows) + replicate)
            _, *heights = world([point]).values[0]
            places = zip(STATIONS, heights, strict=True)
            lines += [f"{replicate},{1e3 * RADIUS * at:.4f} mm,{1e3 * float(z)!r} mm" for at, z in places]
            rows.append(f"{condition},{replicate},surface,,,{condition}.csv")
        (folder / f"{condition}.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    table = folder / "measured.csv"
    table.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return table


def test_a_hidden_effect_is_named_from_surfaces_alone(study: Study, tmp_path: Path) -> None:
    search = Search.of(study)
    assert search.space.conditions == ("slow", "fast", "inclined", "glass", "fast-glass")
    world = Beds(search)
    measured = read_measured(write_measurements(tmp_path, search, world), study)
    # Profiles bring what the drum shows of itself: heights below its axis are as good as those above.
    assert measured.observables == SURFACE
    assert all(np.isfinite(rows).all() for rows in measured.values.values())
    assert min(rows.min() for rows in measured.values.values()) < 0.0
    search.make_bank(world).save(tmp_path / "bank.npz")
    found = drive(search.analysis(measured, load_bank(tmp_path / "bank.npz"), seed=3), world)
    assert found.verdict is Verdict.NAMED
    assert found.named == tuple(HIDDEN)


@pytest.mark.parametrize(
    ("row", "rule"),
    [
        ("slow,9,surface,,,slow.csv", "measured.csv:2: replicate: has no profile in the file"),
        ("slow,1,surface,31,deg,slow.csv", "measured.csv:2: profile: must be alone"),
        ("slow,2,surface,,,slow.csv", "slow.csv:9: x, z: must be in the drum, within 30 mm of its axis"),
    ],
)
def test_a_profile_that_does_not_fit_the_drum_is_refused(
    study: Study, tmp_path: Path, row: str, rule: str
) -> None:
    lines = [f"1,{x} mm,0 mm" for x in range(-18, 19, 6)]
    if row.startswith("slow,2"):
        lines += ["2,29 mm,20 mm"]
    (tmp_path / "slow.csv").write_text("replicate,x,z\n" + "\n".join(lines) + "\n", encoding="utf-8")
    table = tmp_path / "measured.csv"
    table.write_text(f"condition,replicate,observable,value,unit,profile\n{row}\n", encoding="utf-8")
    with pytest.raises(InputError, match=rule):
        read_measured(table, study)
