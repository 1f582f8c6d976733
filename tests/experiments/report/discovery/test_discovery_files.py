"""The files of a discovery: the same numbers everywhere, and a study that loads with the mechanism in it."""

import json
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from discoveries import made_discovery

from doe.discrepancy import Discovery, Interval, Settings, Verdict
from experiments.calibrate.checks import check_calibration
from experiments.calibrate.noise_stage import plan_noise_floor
from experiments.discover.mechanism_files import library_for
from experiments.io.plain_data import jsonable
from experiments.report.discovery import Terms, write_discovery
from experiments.runs.choices import measured_study
from experiments.studyfile import Study, load_study
from experiments.studyfile.campaign import TARGET_SCENE
from experiments.studyfile.observables import BY_NAME, OBSERVABLES

TRIAL = Path(__file__).parents[4] / "experiments" / "studies" / "trial" / "study.toml"


@pytest.fixture(scope="module")
def trial() -> Study:
    return load_study(TRIAL, "bench")


@pytest.fixture(scope="module")
def trial_terms(trial: Study) -> Terms:
    return Terms.of(library_for(trial), OBSERVABLES, trial.factor_sections)


def found_on(trial: Study, verdict: Verdict) -> Discovery:
    """Return a discovery with the factors of the trial study."""
    found = made_discovery(verdict)
    names = tuple(factor.name for factor in trial.factors)[:2]
    drifts = tuple(replace(drift, factor=name) for drift, name in zip(found.drifts, names, strict=False))
    return replace(found, factors=names, drifts=drifts)


def test_the_files_hold_the_same_numbers(trial: Study, trial_terms: Terms, tmp_path: Path) -> None:
    found = found_on(trial, Verdict.NAMED)
    page = write_discovery(found, trial, trial_terms, Settings(), tmp_path, provenance={"device": "cpu"})
    assert page.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    results = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))
    assert results["discovery"] == json.loads(json.dumps(jsonable(found)))
    assert results["sentence"].startswith("Adding contact adhesion at 0.052 J/m²")
    compared = pd.read_csv(tmp_path / "tables" / "compared.csv")
    measured = np.isfinite(found.data.means)
    np.testing.assert_array_equal(compared["measured"], found.data.means[measured])
    assert found.chosen is not None
    np.testing.assert_array_equal(compared["chosen_residual"], found.chosen.residuals[measured])
    # JSON has no infinity, and CSV must not call a missing gain a number.
    assert "Infinity" not in (tmp_path / "results.json").read_text(encoding="utf-8")


def test_the_study_with_the_mechanism_loads_and_can_be_calibrated(
    trial: Study, trial_terms: Terms, tmp_path: Path
) -> None:
    most = trial_terms.mechanisms["contact_adhesion"].maximum
    found = found_on(trial, Verdict.NAMED)
    assert found.chosen is not None
    size = Interval(0.4 * most, 0.5 * most, 1.2 * most)
    found = replace(found, chosen=replace(found.chosen, sizes=(size,)))
    write_discovery(found, trial, trial_terms, Settings(), tmp_path)
    study = load_study(tmp_path / "study-with-contact_adhesion.toml")
    measured_study(study)
    added = study.factors[-1]
    assert added.name == "contact_adhesion"
    # Written with four digits; the interval ends where the library does.
    assert (added.low, added.high) == pytest.approx((0.4 * most, most), rel=1e-3)
    assert [factor.name for factor in study.factors[:-1]] == [factor.name for factor in trial.factors]
    # A case of it is the one that the analysis ran: the rest of the study is as it was.
    at = {factor.name: factor.center for factor in trial.factors}
    case = study.case(at | {"contact_adhesion": added.low}, seed=1)
    assert case.mechanisms
    assert study.target.leading.observable == "angle"


def test_all_that_was_measured_is_to_be_matched_under_its_condition(
    trial: Study, trial_terms: Terms, tmp_path: Path
) -> None:
    found = found_on(trial, Verdict.NAMED)
    write_discovery(found, trial, trial_terms, Settings(), tmp_path)
    study = load_study(tmp_path / "study-with-contact_adhesion.toml")
    data, responses = found.data, study.target.responses
    handed_on = {(response.scene, response.observable): response for response in responses}
    assert len(handed_on) == len(responses) == np.isfinite(data.means).sum()
    for (row, condition), (column, name) in product(enumerate(data.conditions), enumerate(data.observables)):
        if not np.isfinite(data.means[row, column]):
            continue
        # The first condition is the test as it is.
        scene = TARGET_SCENE if condition == "base" else condition
        response = handed_on[scene, BY_NAME[name].column]
        # Written with six digits.
        assert response.measured.mean == pytest.approx(data.means[row, column], rel=1e-5)
        assert response.measured.se == pytest.approx(data.standard_errors[row, column], rel=1e-5)
        assert response.held_out == data.held_out[row]
    # A campaign on it simulates what takes part in the fit, each under its condition.
    check_calibration(study)
    plan = plan_noise_floor(study)
    fitted = {name for name, held_out in zip(data.conditions, data.held_out, strict=True) if not held_out}
    assert set(plan["scene"]) == (fitted - {"base"}) | {TARGET_SCENE}
    settings = {factor.name: factor.center for factor in study.factors}
    faster = study.case(settings, seed=1, scene="fast")
    assert faster.scene.lift_speed == 0.25
    assert faster.mechanisms == study.case(settings, seed=1).mechanisms


def test_a_tilt_seen_from_behind_is_written_as_the_study_has_it(
    trial: Study, trial_terms: Terms, tmp_path: Path
) -> None:
    found = found_on(trial, Verdict.NAMED)
    assert found.chosen is not None
    tilted = {"mechanisms": ("plate_tilt",), "sizes": (Interval(4.0, 5.0, 6.0),)}
    lean = found.data.observables.index("asymmetry")
    for heading, share in ((0.0, 1.0), (180.0, -1.0), (60.0, 0.5), (90.0, None)):
        chosen = replace(found.chosen, heading=heading, **tilted)
        folder = tmp_path / f"{heading}"
        write_discovery(replace(found, chosen=chosen), trial, trial_terms, Settings(), folder)
        study = load_study(folder / "study-with-plate_tilt.toml")
        matched = [one for one in study.target.responses if one.observable == BY_NAME["asymmetry"].column]
        if share is None:
            assert not matched
            continue
        first = next(one for one in matched if one.scene == TARGET_SCENE)
        # Written with six digits.
        assert first.measured.mean == pytest.approx(found.data.means[0, lean] / share, rel=1e-5)
        assert first.measured.se == pytest.approx(found.data.standard_errors[0, lean] / abs(share), rel=1e-5)


def test_a_tie_gives_a_study_for_each(trial: Study, trial_terms: Terms, tmp_path: Path) -> None:
    write_discovery(found_on(trial, Verdict.TIE), trial, trial_terms, Settings(), tmp_path)
    names = sorted(path.name for path in tmp_path.glob("study-with-*.toml"))
    assert names == ["study-with-contact_adhesion.toml", "study-with-liquid_bridges.toml"]
    for name in names:
        assert load_study(tmp_path / name).factors[-1].name in name


@pytest.mark.parametrize("verdict", [Verdict.NONE, Verdict.UNKNOWN, Verdict.NOT_IDENTIFIABLE])
def test_nothing_named_writes_no_study(
    verdict: Verdict, trial: Study, trial_terms: Terms, tmp_path: Path
) -> None:
    write_discovery(found_on(trial, verdict), trial, trial_terms, Settings(), tmp_path)
    assert list(tmp_path.glob("*.toml")) == []
