"""Companions: what a study brings to the reports, by its name alone."""

import shutil
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest

from doe.discrepancy import Interval
from experiments.discover.search import Search
from experiments.io.errors import StudyError
from experiments.report.discovery.terms import Terms
from experiments.report.kit.markdown import markdown_table
from experiments.report.study_companion import STUDIES, companion_of
from experiments.studyfile import Study, load_study
from experiments.studyfile.observables import OBSERVABLES

TRIAL = STUDIES / "trial"


@pytest.fixture(scope="module")
def terms() -> Terms:
    study = load_study(TRIAL / "study.toml", "bench")
    return Terms.of(Search.of(study).library, OBSERVABLES, study.factor_sections)


def found(named: tuple[str, ...], size: Interval) -> SimpleNamespace:
    """Stand in for a discovery that named an effect or none, with the factors a little off."""
    theta = {"theta": (0.56, 0.44, 0.60), "theta_se": (0.02, 0.02, 0.02)}
    base = SimpleNamespace(mechanisms=(), sizes=(), **theta)
    chosen = SimpleNamespace(mechanisms=("plate_tilt",), sizes=(size,), **theta)
    return SimpleNamespace(named=named, base=base, chosen=chosen, factors=("mu_gg", "mu_gw", "e_gg"))


def test_a_study_without_a_companion_has_one_that_brings_nothing(small_study: Study) -> None:
    assert companion_of(small_study).discovery_chapters(None, None, Path()) == ()


def test_an_unknown_companion_is_refused_with_a_guess(write_study: Callable[..., Path]) -> None:
    study = load_study(write_study(('name = "Small"', 'name = "Small"\ncompanion = "buckweat"')))
    with pytest.raises(StudyError, match=r"must be a study that has one, did you mean 'buckwheat'\?"):
        companion_of(study)


def test_every_companion_is_that_of_its_study() -> None:
    names = [path.parent.name for path in STUDIES.glob("*/companion.py")]
    assert {"buckwheat", "trial"} <= set(names)
    for name in names:
        study = load_study(STUDIES / name / "study.toml")
        assert study.companion == name
        assert type(companion_of(study)).__module__ == f"experiments.studies.{name}.companion"


def test_the_trial_sets_the_truth_beside_what_was_found_in_its_own_data(terms: Terms, tmp_path: Path) -> None:
    companion = companion_of(load_study(TRIAL / "study.toml"))
    named = found(("plate_tilt",), Interval(low=4.3, value=4.9, high=5.4))
    copy = tmp_path / "mine.csv"
    shutil.copyfile(TRIAL / "tilted-bench.csv", copy)
    [chapter] = companion.discovery_chapters(named, terms, copy)
    assert chapter.title == "What was hidden"
    rows = markdown_table(chapter.tables["hidden"]).replace("\u00a0", " ").splitlines()
    assert "| tilt of the plate | 5° | 4.9 [4.3, 5.4]° | yes |" in rows
    assert "| grain-grain static friction | 0.55 | 0.560 [0.527, 0.593] | yes |" in rows
    # 0.35 lies 12 standard errors from 0.60.
    assert "| grain-grain restitution | 0.35 | 0.600 [0.567, 0.633] | no |" in rows
    copy.write_text(copy.read_text(encoding="utf-8").replace("11.897", "11.898"), encoding="utf-8")
    assert companion.discovery_chapters(named, terms, copy) == ()


def test_an_effect_that_was_not_named_is_said_to_be_missed(terms: Terms) -> None:
    companion = companion_of(load_study(TRIAL / "study.toml"))
    missed = found((), Interval(low=0.0, value=1.0, high=2.0))
    [chapter] = companion.discovery_chapters(missed, terms, TRIAL / "tilted-bench.csv")
    rows = markdown_table(chapter.tables["hidden"])
    assert "| tilt of the plate | 5° | not named | – |" in rows


def test_the_head_of_the_shipped_data_says_what_the_companion_does() -> None:
    head = (TRIAL / "tilted-bench.csv").read_text(encoding="utf-8").partition("\ncondition,")[0]
    assert "tilted by 5 degrees" in head
    assert "mu_gg 0.55, mu_gw 0.45, e_gg 0.35" in head
