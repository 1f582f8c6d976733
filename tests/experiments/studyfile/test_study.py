"""Study files: their meaning in SI, and the errors of a wrong one."""

import math
from collections.abc import Callable
from pathlib import Path

import pytest

from dem_warp.parameters import UNITS as ENGINE_UNITS
from doe import Sample
from experiments.io.errors import StudyError
from experiments.io.units import UNITS, Quantity, dimension_of_unit
from experiments.studyfile import campaign, load_study, schema, study_scales, write_template

WriteStudy = Callable[..., Path]

FACTOR, R = '[[factor]]\nname = "{}"\nlabel = "x"\nparameter = "{}"\nlow = 0.1\nhigh = 0.2\n', ("R", 0.1, 0.2)
PAPER_FACTORS = {
    "A": (0.16, 0.42, ""),
    "B": (6.81, 61.84, "MPa"),
    "C": (0.10, 0.26, ""),
    "D": (0.20, 0.80, ""),
    "E": (0.32, 0.60, ""),
    "F": (0.18, 0.58, ""),
    "G": (0.03, 0.08, ""),
    "H": (0.02, 0.09, ""),
}
"""Table 2 of the paper."""


def test_every_unit_survives_a_round_trip() -> None:
    for dimension, units in UNITS.items():
        for unit in units:
            for other in units:
                there = schema.Dimension(dimension).to_unit(Quantity(1.5, unit), other)
                # Two roundings each way.
                back = schema.Dimension(dimension).to_unit(Quantity(there, other), unit)
                assert back == pytest.approx(1.5, rel=1e-15)


def test_every_unit_of_a_parameter_of_the_engine_can_be_written() -> None:
    assert "" not in [dimension_of_unit(unit) for unit in ENGINE_UNITS if unit != "1"]


def test_the_paper_study_is_the_papers() -> None:
    study = load_study()
    assert {f.name: (f.low, f.high, f.unit) for f in study.factors} == PAPER_FACTORS
    angle = campaign.Response("angle", "angle", "deg", measured=Sample(30.148, 0.518, 5))
    assert study.target == campaign.Target((angle,))
    assert study.companion == "buckwheat"
    case = study.case({}, seed=3)
    assert (case.scene.diameter, case.scene.height, case.scene.lift_speed) == (0.035, 0.110, 0.05)
    assert (case.grains.material.density, case.scene.wall_material.shear_modulus) == (698.0, 70.0e9)
    assert case.grains.shape.sphere_count == 9
    assert case.numerics.modulus_scale == 1.0


def test_factors_that_are_not_set_are_at_their_middle() -> None:
    case = load_study().case({"E": 0.48}, seed=3)
    assert case.grain_grain.static_friction == 0.48
    assert case.grain_wall.static_friction == pytest.approx(0.38, rel=1e-15)
    assert case.grains.material.poisson_ratio == pytest.approx(0.29, rel=1e-15)
    assert case.grains.material.shear_modulus == pytest.approx(34.325e6, rel=1e-15)


TWO_SHAPES = """
[grain.shapes.whole]
sphere = "2 mm"
[grain.shapes.split]
clump = "split.txt"
fraction = 0.25
"""


@pytest.fixture
def two_shapes(tmp_path: Path, write_study: WriteStudy) -> WriteStudy:
    """Write the small study with two shapes, some of its text replaced."""
    (tmp_path / "split.txt").write_text("0 0 0 1\n1 0 0 1\n", encoding="utf-8")

    def write(*replacements: tuple[str, str], add: str = "") -> Path:
        text = TWO_SHAPES
        for old, new in replacements:
            assert text.count(old) == 1, old
            text = text.replace(old, new)
        return write_study(('sphere = "2 mm"\n', ""), ("[wall]", f"{text}\n[wall]"), add=add)

    return write


def test_several_shapes_are_mixed_in_the_order_of_the_file(two_shapes: WriteStudy) -> None:
    grains = load_study(two_shapes()).case({}, seed=1).grains
    whole, split = grains.mixture.shapes
    assert (whole.sphere_count, whole.radii[0], split.sphere_count) == (1, 2e-3, 2)
    assert grains.mixture.fractions == (0.75, 0.25)
    given = load_study(two_shapes(('sphere = "2 mm"', 'sphere = "2 mm"\nfraction = 0.75')))
    assert given.case({}, seed=1).grains == grains


def test_one_shape_and_several_exclude_each_other(two_shapes: WriteStudy) -> None:
    with pytest.raises(StudyError, match=r"one shape .* or several .*, not both"):
        load_study(two_shapes(add='[scale.other]\ngrain.sphere = "1 mm"\n'), "other")


def test_a_fraction_can_be_a_factor(two_shapes: WriteStudy) -> None:
    factor = """
[[factor]]
name = "S"
label = "split grains"
parameter = "grain.shapes.split.fraction"
low = 0.0
high = 0.4
"""
    study = load_study(two_shapes(("fraction = 0.25\n", ""), add=factor))
    assert study.limits["S"] == (0.0, 1.0)
    assert study.case({}, seed=1).grains.mixture.fractions == (0.8, 0.2)
    assert study.case({"S": 0.1}, seed=1).grains.mixture.fractions == (0.9, 0.1)
    # Without split grains a case has spheres only.
    assert study.case({"S": 0.0}, seed=1).grains.sphere_count == 1
    with pytest.raises(StudyError, match="less than or equal to 1"):
        study.case({"S": 1.1}, seed=1)


def test_a_scale_exchanges_clump_sizes_tube_rain_step_and_fit(two_shapes: WriteStudy, tmp_path: Path) -> None:
    (tmp_path / "other.txt").write_text("0 0 0 1\n1 0 0 1\n0 1 0 1\n", encoding="utf-8")
    scale = """
[scale.other]
grain.shapes.split.clump = "other.txt"
grain.size_sd = 0.1
scene.lifted-cylinder.height = "50 mm"
scene.lifted-cylinder.rain_rate = "1000 1/s"
numerics.time_step_fraction = 0.1
measurement.fit = "middle"
"""
    study = load_study(two_shapes(add=scale), "other")
    case = study.case({}, seed=1)
    assert [shape.sphere_count for shape in case.grains.mixture.shapes] == [1, 3]
    assert (case.grains.size_sd, case.numerics.time_step_fraction) == (0.1, 0.1)
    assert (case.scene.height, case.scene.rain_rate, study.measurement.fit) == (0.05, 1000.0, "middle")


@pytest.mark.parametrize(
    ("fixed", "parameter", "low", "high"),
    [
        ("sphere", "grain.sphere", "1 mm", "2 mm"),
        ("height", "scene.lifted-cylinder.height", "20 mm", "40 mm"),
        ("modulus_scale", "numerics.modulus_scale", 10.0, 400.0),
    ],
)
def test_sizes_tube_and_softening_can_be_factors(
    write_study: WriteStudy, fixed: str, parameter: str, low: object, high: object
) -> None:
    path = write_study()
    lines = [line for line in path.read_text(encoding="utf-8").splitlines() if not line.startswith(fixed)]
    factor = (
        f'[[factor]]\nname = "X"\nlabel = "x"\nparameter = "{parameter}"\nlow = {low!r}\nhigh = {high!r}\n'
    )
    path.write_text("\n".join([*lines, factor]), encoding="utf-8")
    study = load_study(path)
    ends = [study.case({"X": getattr(study.factors[1], end)}, seed=1).to_dict() for end in ("low", "high")]
    assert ends[0] != ends[1]


def test_factor_values_are_in_the_factors_unit() -> None:
    study = load_study()
    assert study.natural_settings({"B": "34000 kPa", "E": 0.4}) == {"B": 34.0, "E": 0.4}
    assert study.case({"B": 34.0}, seed=1).grains.material.shear_modulus == 34.0e6


def test_bench_is_a_twin_and_leaves_the_paper_alone() -> None:
    assert study_scales() == ("paper", "printed", "soft", "bench")
    bench, paper = load_study(scale="bench"), load_study(scale="paper")
    assert bench.target.twin is not None
    assert paper.target.twin is None
    assert bench.scene.lifted_cylinder.grain_count == 400
    assert paper.scene.lifted_cylinder.grain_count is None
    assert bench.note != paper.note


def test_limits_are_physical_and_in_the_factors_unit() -> None:
    limits = load_study().limits
    assert limits["E"] == (0.0, math.inf)
    assert limits["A"] == (0.0, 0.5)
    assert limits["B"][0] == pytest.approx(1e-3)  # the 1 kPa of `MaterialSection`, in MPa
    for name, (low, high, _) in PAPER_FACTORS.items():
        assert limits[name][0] <= low < high <= limits[name][1]


def test_campaign_values_carry_units(write_study: WriteStudy) -> None:
    extra = """
[[factor]]
name = "B"
label = "grain shear modulus"
parameter = "grain.shear_modulus"
low = "6 MPa"
high = "60 MPa"

[campaign.climb]
start = { B = "9000 kPa", E = 0.3 }
step = { B = "5 MPa", E = 0.05 }

[campaign.verification]
margin = "1.5 deg"
"""
    study = load_study(write_study(('shear_modulus = "10 MPa"\n', ""), add=extra))
    assert study.campaign.climb.start == {"B": 9.0, "E": 0.3}
    assert study.campaign.verification.margin == 1.5


def test_every_breach_is_listed_with_its_scale(write_study: WriteStudy) -> None:
    path = write_study(('density = "700 kg/m^3"', "density = 700"), add="numerics.precision = 'half'\n")
    with pytest.raises(StudyError) as caught:
        load_study(path, "stiff")
    last_line = len(path.read_text(encoding="utf-8").splitlines())
    assert [problem.place for problem in caught.value.problems] == [
        f"{path}:6: grain.density",
        f"{path}:{last_line}: scale.stiff.numerics.precision",
    ]


def test_a_scale_changes_the_range_of_a_factor_by_its_name(write_study: WriteStudy) -> None:
    other = FACTOR.format("R", "contact.grain-wall.static_friction")
    study = write_study(("static_friction = 0.4\n", ""), add=f"factor.E.low = 0.3\n{other}")
    assert [(one.name, one.low, one.high) for one in load_study(study).factors] == [("E", 0.2, 0.6), R]
    assert [(one.name, one.low, one.high) for one in load_study(study, "stiff").factors] == [
        ("E", 0.3, 0.6),
        R,
    ]


@pytest.mark.parametrize(
    ("change", "place", "problem"),
    [
        ("factor.E.low = 0.9", "factor[1]", "low must be below high, got 0.9 and 0.6"),
        ('factor.E.low = "3 mm"', "factor[1].low", "must be a plain number"),
        ("factor.E.lo = 0.3", "factor[1].lo", "unknown key, did you mean 'low'"),
        ("factor.e.low = 0.3", "factor.e.low", "must name a factor"),
        ("factor.E = 0.3", "factor.E", "must be a table"),
    ],
)
def test_a_wrong_change_of_a_factor_is_named_where_the_scale_has_it(
    write_study: WriteStudy, change: str, place: str, problem: str
) -> None:
    path = write_study(add=f"{change}\n")
    with pytest.raises(StudyError) as caught:
        load_study(path, "stiff")
    line = len(path.read_text(encoding="utf-8").splitlines())
    assert caught.value.problems[0].place == f"{path}:{line}: scale.stiff.{place}"
    assert problem in caught.value.problems[0].problem


def test_a_case_outside_what_is_physical_is_refused(write_study: WriteStudy) -> None:
    study = load_study(write_study())
    with pytest.raises(StudyError, match="greater than or equal to 0"):
        study.case({"E": -0.1}, seed=1)
    with pytest.raises(StudyError, match="must name a factor"):
        study.case({"F": 0.1}, seed=1)


def test_a_new_study_loads_and_never_overwrites(tmp_path: Path) -> None:
    path = write_template("my grain", tmp_path)
    study = load_study(path)
    assert study.name == "my grain"
    assert len(study.factors) == 4
    assert study.case({}, seed=1).seed == 1
    path.write_text("mine", encoding="utf-8")
    with pytest.raises(ValueError, match="never overwrites"):
        write_template("my grain", tmp_path)
    assert path.read_text(encoding="utf-8") == "mine"


def test_a_design_from_outside_may_have_any_number_of_runs() -> None:
    assert campaign.ScreeningSettings(design="three-levels", runs=9).runs == 9
    with pytest.raises(ValueError, match="must be a multiple of 4"):
        campaign.ScreeningSettings(runs=9)


def test_a_study_is_printed_in_a_line() -> None:
    study = load_study(scale="bench")
    for text in (str(study), repr(study)):
        assert "\n" not in text
        assert len(text) < 200, "two lines of a terminal"
        assert all(repr(each) in text for each in (study.name, study.scale, *(f.name for f in study.factors)))
