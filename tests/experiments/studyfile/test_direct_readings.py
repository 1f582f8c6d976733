"""``[[direct]]`` of a study file: its meaning, and the errors of a wrong one."""

import math
from collections.abc import Callable
from pathlib import Path

import pytest

from doe import Sample, StatedValue
from experiments.io.errors import StudyError
from experiments.studyfile import load_study

WriteStudy = Callable[..., Path]

INCLINE = '[[direct]]\nparameter = "{}"\nby = "incline"\n'


def test_readings_are_the_factors_values_with_their_errors(write_study: WriteStudy) -> None:
    add = INCLINE.format("contact.grain-grain.static_friction") + 'readings = [20, "21 deg", 24]\n'
    add += '[[direct]]\nname = "sheet"\nparameter = "E"\nby = "value"\nmean = 0.4\nsd = 0.03\nn = 1\n'
    add += "model_sd = 0.01\n"
    first, second = load_study(write_study(add=add)).direct
    found = Sample.of([math.tan(math.radians(angle)) for angle in (20, 21, 24)])
    assert (first.name, first.factor, first.unit) == ("E_incline", "E", "1")
    assert first.measured.mean == pytest.approx(found.mean)
    assert first.measured.se == pytest.approx(found.se)
    assert first.model_sd == pytest.approx(0.05 * found.mean)
    assert (second.name, second.model_sd) == ("sheet", 0.01)
    assert isinstance(second.measured, StatedValue)
    assert second.measured.mean == 0.4


def test_a_table_of_readings_belongs_to_the_study(write_study: WriteStudy, tmp_path: Path) -> None:
    table = tmp_path / "incline.csv"
    hashes = []
    for angle in ("24", "25"):
        table.write_text(f"angle\n20\n{angle}\n", encoding="utf-8")
        path = write_study(add=INCLINE.format("E") + 'file = "incline.csv"\n')
        hashes.append(load_study(path).sha256)
    assert hashes[0] != hashes[1]


def test_a_measured_density_is_a_direct_reading_of_its_factor(write_study: WriteStudy) -> None:
    factor = '[[factor]]\nname = "rho"\nlabel = "density"\nparameter = "grain.density"\n'
    factor += 'low = "1.2 g/cm^3"\nhigh = "1.6 g/cm^3"\n'
    add = (
        factor
        + '[[direct]]\nparameter = "rho"\nby = "value"\nmean = "1400 kg/m^3"\nsd = "20 kg/m^3"\nn = 5\n'
    )
    study = load_study(write_study(('density = "700 kg/m^3"\n', ""), add=add))
    (found,) = study.direct
    assert found.unit == "g/cm^3"
    assert (found.measured.mean, found.measured.sd) == pytest.approx((1.4, 0.02))


def test_a_condition_has_no_readings(write_study: WriteStudy) -> None:
    add = INCLINE.format("E") + "readings = [20, 24]\n"
    add += "[condition.base]\n[condition.fixed]\ncontact.grain-grain.static_friction = 0.4\n"
    assert load_study(write_study(add=add)).under("fixed").direct == ()


@pytest.mark.parametrize(
    ("section", "message"),
    [
        (INCLINE.format("Q") + "readings = [20, 21]\n", "must be a factor or a place that one varies"),
        ('[[direct]]\nparameter = "E"\nby = "slope"\nreadings = [20, 21]\n', "by: must be 'incline'"),
        ('[[direct]]\nparameter = "E"\nby = "pendulum"\nmean = { release = 60, striker = 8, struck = 51 }\n'
         "sd = { struck = 1 }\nn = 5\n", "pendulum measures a restitution, not static_friction"),
        (INCLINE.format("E") + "readings = [20, 96]\n", "angle must be between 0 and 90 deg, got 96"),
        (INCLINE.format("E") + "mean = 20\nsd = 1\nn = 0\n", "n: must be greater than or equal to 1"),
        (INCLINE.format("E") + "mean = 20\nsd = 1\n", "mean needs sd and n"),
        (INCLINE.format("E") + "mean = 20\nsd = 1\nn = 4\nreadings = [20, 21]\n", "one of file, readings"),
        (INCLINE.format("E") + "readings = [20, 21]\nn = 2\n", "readings must not have n"),
        (INCLINE.format("E") + 'file = "nosuch.csv"\n', "no such file"),
        (INCLINE.format("E") + "readings = [20, 21]\nmodel_sd = -0.1\n", "model_sd must not be negative"),
        (INCLINE.format("E") + "readings = []\n", "must have at least one reading"),
        ((INCLINE.format("E") + "readings = [20, 21]\n") * 2, "must have a name that no other response has"),
        (INCLINE.format("E") + 'name = "angle"\nreadings = [20, 21]\n', "must have a name that no other"),
    ],
)  # fmt: skip
def test_a_wrong_reading_is_refused(write_study: WriteStudy, section: str, message: str) -> None:
    with pytest.raises(StudyError) as caught:
        load_study(write_study(add=section))
    assert message in str(caught.value)
    assert "direct[" in caught.value.place


def test_a_table_without_its_column_is_refused(write_study: WriteStudy, tmp_path: Path) -> None:
    (tmp_path / "incline.csv").write_text("slope\n20\n21\n", encoding="utf-8")
    with pytest.raises(ValueError, match="needs rows below the columns angle"):
        load_study(write_study(add=INCLINE.format("E") + 'file = "incline.csv"\n'))
