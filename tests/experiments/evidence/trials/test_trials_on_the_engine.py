"""The generator on the engine: a trial with nothing hidden, and one with rolling resistance."""

import numpy as np
import pytest

from doe.discrepancy import Discovery, Measured, Settings, Verdict, fit_emulator
from experiments.cases import OwnWorkers
from experiments.cases.store.outcome_table import OutcomeTable
from experiments.discover.engine_simulator import EngineSimulator
from experiments.discover.mechanism_files import library_for
from experiments.discover.search import Search
from experiments.evidence.trials.analyses import Analyses, TrialAnalyses, read_data
from experiments.evidence.trials.declaration import Declaration
from experiments.evidence.trials.generate_trials import STUDY, bank_beside, generators_study, measure_trials
from experiments.evidence.trials.trials_folder import Folder
from experiments.evidence.trials.truth import Kind, Label, Sealed
from experiments.evidence.trials.truths import Plan
from experiments.studyfile import load_study
from experiments.studyfile.observables import NAMES, OUTLINE

BENCH = "bench"
THETA = (0.6, 0.5, 0.3)
NULL = Label("alone-001", Kind.NULL, THETA, (), (), seed=11, salt="")
ROLLING = Label("alone-002", Kind.SINGLE, THETA, (("rolling_torque", 0.08),), (5.0,), seed=13, salt="")
REPLICATES = 2


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Measured]:
    """Heaps of both trials, simulated by the generator and read as a user's."""
    folder = Folder(tmp_path_factory.mktemp("trials"))
    declaration = Declaration("", BENCH, "", Plan(replicates=REPLICATES), Settings(), (), ())
    study, table = generators_study(BENCH), OutcomeTable(folder.hidden / "outcomes.sqlite")
    with EngineSimulator(study, library_for(study), table, OwnWorkers("cpu", 1)) as engine:
        measure_trials(folder, [NULL, ROLLING], declaration, engine)
    sealed = [Sealed(label.trial, "alone", (), label.hash) for label in (NULL, ROLLING)]
    found, refused = read_data(folder, sealed, load_study(STUDY, BENCH))
    assert refused == {}
    return found


def test_the_generator_has_its_own_time_step_and_camera() -> None:
    own, analysed = generators_study(BENCH), load_study(STUDY, BENCH)
    assert own.numerics.time_step_fraction < analysed.numerics.time_step_fraction
    assert own.measurement.pixels > analysed.measurement.pixels
    ranges = [(factor.low, factor.high) for factor in analysed.factors]
    assert [(factor.low, factor.high) for factor in own.factors] == ranges


def test_heaps_of_a_trial_come_back_as_they_were_measured(measured: dict[str, Measured]) -> None:
    names = (*NAMES, *(each.name for each in OUTLINE))
    for heaps in measured.values():
        assert heaps.observables == names
        assert all(rows.shape == (REPLICATES, len(names)) for rows in heaps.values.values())
        assert all(np.isfinite(rows).all() for rows in heaps.values.values())


def test_a_trial_states_the_scale_of_its_camera_and_nothing_else(measured: dict[str, Measured]) -> None:
    for heaps in measured.values():
        stated = {name: one.scale for name, one in heaps.calibration.items() if one.scale}
        assert stated == dict.fromkeys(("height", "r50", "r90", *(each.name for each in OUTLINE)), 0.002)
        assert {heaps.calibration[name].instrument for name in stated} == {"photograph"}
        assert not any(one.offset for one in heaps.calibration.values())


def test_only_the_hidden_effect_makes_the_analysis_ask_for_runs(measured: dict[str, Measured]) -> None:
    search = Search.of(load_study(STUDY, BENCH))
    emulator = fit_emulator(search.read_bank(bank_beside(BENCH)))
    withheld: dict[str, tuple[str, ...]] = dict.fromkeys(measured, ())
    advance = Analyses(TrialAnalyses(emulator, search.settings, measured, withheld))
    jobs = {label: f"{label.trial}.everything" for label in (NULL, ROLLING)}
    steps = advance(dict.fromkeys(jobs.values()))
    none, wave = steps[jobs[NULL]], steps[jobs[ROLLING]]
    assert isinstance(none, Discovery)
    assert none.verdict is Verdict.NONE
    assert isinstance(wave, list)
    assert {name for point in wave for name, _ in point.sizes} >= {"rolling_torque"}
