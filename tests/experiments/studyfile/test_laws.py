"""Laws of a study: by the name of a code, law by law; in its cards, cases, page and template."""

import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner

from dem_warp import EDEM, PRESETS, RELATIVE, laws_named
from experiments.cases import engine_of, with_engine
from experiments.cases.engines import engines
from experiments.cases.engines.key import case_key
from experiments.cli import app
from experiments.discover.mechanism_files import library_for
from experiments.discover.search import Search
from experiments.io.errors import StudyError
from experiments.report.study_facts import study_facts
from experiments.studyfile import load_study
from experiments.studyfile.loading import BUCKWHEAT
from experiments.studyfile.new_study import write_template
from experiments.studyfile.solver_section import SolverSection, written

WriteStudy = Callable[..., Path]

STUDIES = sorted(BUCKWHEAT.parents[1].glob("*/*.toml"))


@pytest.mark.parametrize("name", PRESETS)
def test_a_study_names_the_laws_of_a_code(write_study: WriteStudy, name: str) -> None:
    study = load_study(write_study(add=f'[solver]\nlaws = "{name}"\n'))
    assert study.case({}, seed=1).laws == laws_named(name)
    assert study_facts(study)["Contact laws"].startswith(f"{name}: ")


def test_a_study_chooses_law_by_law_on_top_of_a_set(write_study: WriteStudy) -> None:
    table = '[solver.laws]\nbase = "lammps"\nrolling_spring = "900 N/m"\nattraction = "clamped"\n'
    laws = load_study(write_study(add=table)).case({}, seed=1).laws
    lammps = laws_named("lammps").to_dict()
    assert laws.to_dict() == lammps | {"rolling_spring": 900.0, "attraction": "clamped"}
    # what a card writes reads back as the same laws
    for each in (laws, EDEM, RELATIVE):
        assert SolverSection.model_validate({"laws": written(each)}).laws == each


def test_a_study_without_laws_keeps_the_base_law(write_study: WriteStudy) -> None:
    study = load_study(write_study())
    assert study.case({}, seed=1).laws == EDEM
    named = load_study(write_study(add='[solver]\nlaws = "edem"\n'))
    assert case_key(named.case({}, 1)) == case_key(study.case({}, 1))
    assert Search.of(named).fingerprint == Search.of(study).fingerprint


def test_a_new_study_has_the_relative_law_and_shipped_ones_name_theirs(tmp_path: Path) -> None:
    assert load_study(write_template("grain", tmp_path)).solver.laws == RELATIVE
    read = {path: tomllib.loads(path.read_text(encoding="utf-8")) for path in STUDIES}
    named = {path.parent.name: study["solver"]["laws"] for path, study in read.items() if "scene" in study}
    assert named == {"buckwheat": "edem", "trial": "edem"}


def test_cases_of_other_laws_are_stored_apart_and_banks_refused(write_study: WriteStudy) -> None:
    studies = [load_study(write_study(add=f'[solver]\nlaws = "{name}"\n')) for name in PRESETS]
    assert len({case_key(study.case({}, 1)) for study in studies}) == len(PRESETS)
    assert len({Search.of(study).fingerprint for study in studies}) == len(PRESETS)


def test_a_law_in_place_of_the_base_law_is_not_looked_for_with_another(
    write_study: WriteStudy,
) -> None:
    base, relative = (
        {one.name for one in library_for(load_study(write_study(add=f'[solver]\nlaws = "{name}"\n')))}
        for name in ("edem", "relative")
    )
    assert base - relative == {"rolling_spring"}
    assert relative <= base


WITH_CARD = ('name = "Small"', 'name = "Small"\nmaterial = "card.toml"')
CARD = '[material.contact.grain-wall]\nrestitution = 0.31\n\n[material.solver]\nlaws = "relative"\n'


def test_a_study_without_laws_takes_those_of_its_card(write_study: WriteStudy) -> None:
    path = write_study(WITH_CARD)
    (path.parent / "card.toml").write_text(CARD, encoding="utf-8")
    assert load_study(path).solver.laws == RELATIVE


def test_a_card_of_other_laws_is_taken_by_a_study_that_says_so_alone(write_study: WriteStudy) -> None:
    def study(solver: str) -> Path:
        path = write_study(WITH_CARD, add=f"[solver]\n{solver}\n")
        (path.parent / "card.toml").write_text(CARD, encoding="utf-8")
        return path

    for solver in ('laws = "liggghts"', 'laws = "liggghts"\ncard_laws = "edem"'):
        with pytest.raises(StudyError) as caught:
            load_study(study(solver))
        assert "hold for the laws 'relative'" in caught.value.problem
        assert 'card_laws = "relative"' in caught.value.hint
        assert caught.value.value == "liggghts"
    assert load_study(study('laws = "relative"')).solver.laws == RELATIVE
    named = load_study(study('laws = "liggghts"\ncard_laws = "relative"'))
    assert named.solver.laws == laws_named("liggghts")


CORRECTED = f'{CARD}\n[bridge]\nengine = "other"\n'
"""A card whose values a bridge has corrected for a solver of this name."""


@pytest.fixture
def corrected(write_study: WriteStudy, monkeypatch: pytest.MonkeyPatch) -> WriteStudy:
    """Write a study with a corrected card; the solver that it is corrected for is installed, and one more."""
    for name in ("other", "third"):
        monkeypatch.setitem(engines._DRIVERS, name, lambda cases, **more: [])

    def write(add: str = "") -> Path:
        path = write_study(WITH_CARD, add=add)
        (path.parent / "card.toml").write_text(CORRECTED, encoding="utf-8")
        return path

    return write


@pytest.mark.parametrize(
    ("add", "option", "got"),
    [
        ("", None, "dem-warp"),
        ("", "third", "third"),
        ('[solver]\ncard_solver = "third"\n', None, "dem-warp"),
    ],
)
def test_a_card_corrected_for_one_solver_is_refused_in_another(
    corrected: WriteStudy, add: str, option: str | None, got: str
) -> None:
    study = with_engine(load_study(corrected(add)), option)
    with pytest.raises(StudyError) as caught:
        engine_of(study)
    assert "must run in 'other'" in caught.value.problem
    assert 'card_solver = "other"' in caught.value.hint
    assert caught.value.value == got
    assert caught.value.place == f"{study.file}: solver.card_solver"


@pytest.mark.parametrize(
    ("add", "option"),
    [
        ("", "other"),
        ('[engine]\nname = "other"\n', None),
        ('[solver]\ncard_solver = "other"\n', None),
        ('[solver]\ncard_solver = "other"\n', "third"),
    ],
)
def test_it_runs_in_its_solver_and_where_the_study_says_so(
    corrected: WriteStudy, add: str, option: str | None
) -> None:
    study = with_engine(load_study(corrected(add)), option)
    assert (engine_of(study) is None) == (option is None and "engine" not in add)
    assert study_facts(study)["Card"] == "corrected for other by a bridge"
    assert study.case({}, 1).laws == RELATIVE


def test_an_export_warns_of_a_corrected_card_also_through_a_study(
    corrected: WriteStudy, tmp_path: Path
) -> None:
    words = ["export", str(corrected()), "--to", "edem", "--approximate", "--out", str(tmp_path / "sheet")]
    assert CliRunner().invoke(app, words).exit_code == 0
    head = (tmp_path / "sheet" / "values.md").read_text().splitlines()[:6]
    assert any("WARNING: the card was corrected for other" in line for line in head)
