"""The library of mechanisms, each alone and in a study."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from experiments.discover import mechanism_files
from experiments.discover.mechanism_files import FILES, library_for
from experiments.io.errors import StudyError
from experiments.studyfile import Study, load_study
from experiments.studyfile.mechanism_factor import with_mechanisms

TRIAL = Path(mechanism_files.__file__).parents[1] / "studies" / "trial" / "study.toml"
WriteStudy = Callable[..., Path]


@pytest.fixture(scope="module")
def trial() -> Study:
    return load_study(TRIAL)


def test_the_trial_study_lacks_every_mechanism_of_the_library(trial: Study) -> None:
    assert [m.name for m in library_for(trial)] == sorted(FILES)


@pytest.mark.parametrize("name", sorted(FILES))
def test_a_mechanism_at_its_null_is_the_study_and_at_its_maximum_is_not(trial: Study, name: str) -> None:
    mechanism = next(m for m in library_for(trial) if m.name == name)
    theta = {factor.name: factor.low for factor in trial.factors}
    extended = with_mechanisms(trial, [mechanism])
    for condition in trial.conditions:
        plain = trial.under(condition.name).case(theta, 3).to_dict()
        null, full = (
            extended.under(condition.name).case(theta | {name: size}, 3).to_dict()
            for size in (mechanism.null, mechanism.maximum)
        )
        # A law at its null is still named in a case, since it is compiled in.
        assert null | {"mechanisms": []} == plain
        assert full != null


def test_each_file_describes_its_effect_in_words() -> None:
    for mechanism in library_for(load_study(TRIAL)):
        assert re.fullmatch(r"[A-Z].*\.", mechanism.sentence, re.DOTALL), mechanism.name
        assert re.fullmatch(r"[A-Z].*\.", mechanism.confirm, re.DOTALL), mechanism.name
        assert len(mechanism.source) > 20, mechanism.name


def test_a_study_that_has_a_mechanism_does_not_lack_it(write_study: WriteStudy) -> None:
    names = {m.name for m in library_for(load_study(write_study()))}
    # The small study fixes a rolling friction of 0.05, from which both laws of rolling start.
    starts = {m.name: m.null for m in library_for(load_study(write_study()))}
    assert starts["rolling_torque"] == 0.05
    varied = """
[[factor]]
name = "W"
label = "work of adhesion"
parameter = "mechanism.jkr.work_of_adhesion"
low = 0.0
high = 0.01
"""
    others = {m.name for m in library_for(load_study(write_study(add=varied)))}
    # Nor can it have what excludes that.
    assert names - others == {"contact_adhesion", "plastic_contact"}


def test_a_range_in_scales_of_the_grain_follows_the_grain(write_study: WriteStudy) -> None:
    def cohesion(*replacements: tuple[str, str]) -> float:
        library = library_for(load_study(write_study(*replacements)))
        return next(m.maximum for m in library if m.name == "contact_adhesion")

    # Weight over radius goes as the square of the radius; a few roundings.
    assert cohesion(('"2 mm"', '"4 mm"')) / cohesion() == pytest.approx(4.0, rel=1e-12)


@pytest.mark.parametrize(
    ("laws", "maximum"), [("edem", 0.1), ("deme", 0.1), ("relative", 0.4), ("liggghts", 0.4)]
)
def test_rolling_resistance_is_searched_further_where_its_lever_is_shorter(laws: str, maximum: float) -> None:
    study = load_study(TRIAL, None, {"solver": {"laws": laws}})
    [rolling] = [one for one in library_for(study) if one.name == "rolling_torque"]
    assert rolling.maximum == maximum


def test_a_study_with_a_mechanism_is_a_study_with_one_more_factor(trial: Study) -> None:
    [bridges] = [m for m in library_for(trial) if m.name == "liquid_bridges"]
    extended = with_mechanisms(trial, [bridges], {"liquid_bridges": (0.001, 0.003)})
    assert [f.name for f in extended.factors] == [*(f.name for f in trial.factors), "liquid_bridges"]
    assert (extended.factors[-1].low, extended.factors[-1].high) == (0.001, 0.003)
    assert extended.case({}, 1).mechanisms[0].parameters["surface_tension"] == pytest.approx(0.002, rel=1e-15)


def test_two_mechanisms_of_one_parameter_exclude_each_other(trial: Study) -> None:
    rolling = [m for m in library_for(trial) if m.name.startswith("rolling")]
    with pytest.raises(StudyError, match="given twice"):
        with_mechanisms(trial, rolling)


def test_a_wrong_file_is_named_with_its_line(trial: Study, tmp_path: Path) -> None:
    text = FILES["twisting"].read_text(encoding="utf-8")
    path = tmp_path / "twisting.toml"
    path.write_text(text.replace("twisting.twisting_radius", "twisting.radius"), encoding="utf-8")
    with pytest.raises(StudyError, match=r"twisting.toml:4: parameters: must lead to a quantity"):
        library_for(trial, {"twisting": path})
