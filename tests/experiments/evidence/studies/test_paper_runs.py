"""The paper's runs: laid out as printed, and analysed as the paper analyses its own."""

import math
from collections.abc import Callable

import numpy as np
import pandas as pd
import pytest

from experiments.evidence.studies.buckwheat.replay.replay import ALL, Replay, published_noise
from experiments.evidence.studies.buckwheat.replay.runs import OPTIMUM, STAGES, planned_cases, published_runs
from experiments.studies.buckwheat import paper
from experiments.studyfile import load_study


def simulated(angle: Callable[[pd.DataFrame], pd.Series], replicates: int = 1) -> Replay:
    """Cases whose angle is a function of their row."""
    cases = planned_cases(replicates)
    return Replay(cases.assign(status="finished", reason="", angle=angle(cases)))


@pytest.fixture(scope="module")
def perfect() -> Replay:
    """Return a simulator that gives the printed angles."""
    return simulated(lambda cases: cases["published"])


def test_the_runs_are_those_of_the_tables() -> None:
    runs = published_runs()
    assert runs["stage"].value_counts().to_dict() == {
        "screening": 12, "climb": 6, "composite": 13, "verification": 3,
    }  # fmt: skip
    by_label = runs.set_index(["stage", "run"])
    # Table 3, run 1: A high, B low, E and F low; Table 5, step 6; Table 6, runs 6 and 8, star points.
    assert by_label.loc[("screening", 1), ["A", "B", "E", "F", "published"]].tolist() == pytest.approx(
        [0.42, 6.81, 0.32, 0.18, 9.265]
    )
    assert by_label.loc[("climb", 6), ["E", "F", "published"]].tolist() == [0.60, 0.65, 33.085]
    assert by_label.loc[("composite", 6), "F"] == pytest.approx(0.45 + 1.414 * 0.10)
    assert by_label.loc[("composite", 8), "E"] == pytest.approx(0.48 - 1.414 * 0.06)
    assert by_label.loc[("verification", 2), ["E", "F"]].to_dict() == OPTIMUM
    assert by_label.loc[["climb", "composite", "verification"], list("ABCDGH")].isna().all(axis=None)


def test_replicates_differ_in_their_seed_alone() -> None:
    cases = planned_cases(3)
    assert len(cases) == 3 * 34
    assert cases["seed"].is_unique
    settings = [f.name for f in paper.factors()]
    assert cases.groupby(["stage", "run"])[settings].nunique().eq(1).all(axis=None)
    # A further replicate, or another choice of stages, leaves the seeds of the others.
    first = planned_cases(1, ["composite"]).set_index(["stage", "run", "replicate"])["seed"]
    again = cases.set_index(["stage", "run", "replicate"])["seed"]
    assert (again.loc[first.index] == first).all()


def test_what_a_stage_leaves_alone_is_at_its_middle() -> None:
    case = load_study().case(planned_cases(1, ["climb"]).loc[0, list("ABCDEFGH")].to_dict(), seed=1)
    plain = load_study().case({"E": 0.30, "F": 0.15}, seed=1)
    assert case.to_dict() == plain.to_dict()


@pytest.mark.parametrize(
    ("replicates", "stages", "rule"),
    [(0, ("climb",), "at least 1, got 0"), (1, ("ascent",), "screening, climb, .* got 'ascent'")],
)
def test_a_wrong_plan_is_refused(replicates: int, stages: tuple[str, ...], rule: str) -> None:
    with pytest.raises(ValueError, match=rule):
        planned_cases(replicates, stages)


def test_a_perfect_simulator_agrees_and_has_the_papers_analysis(perfect: Replay) -> None:
    table = perfect.agreement_table
    assert list(table.index) == [*STAGES.values(), ALL]
    assert table["runs"].tolist() == [12, 6, 13, 3, 31]
    assert table[["rmse", "bias"]].to_numpy() == pytest.approx(0.0)
    assert table["spearman"].to_numpy() == pytest.approx(1.0)
    published = paper.screening().table
    for column in ("effect", "F", "p"):
        np.testing.assert_allclose(perfect.effects[column], published[column], rtol=1e-12)
    np.testing.assert_allclose(perfect.anova["F"], paper.surface().anova["F"], rtol=1e-10)
    assert perfect.verification["simulated again"] == perfect.verification["the paper"]


def test_the_papers_own_noise_is_that_of_its_replicates() -> None:
    # The pure error of the five composite centres; the standard deviation of 30.121, 31.574 and 29.283.
    assert published_noise() == pytest.approx((math.sqrt(0.298741), 1.159176), rel=1e-6)


def test_seed_noise_is_pooled_within_settings() -> None:
    # Two heaps 2 d apart have the variance 2 d^2; d is 1 in the screening and 3 in the climb.
    spread = {"screening": 1.0, "climb": 3.0, "composite": 0.0, "verification": 0.0}
    both = simulated(
        lambda cases: 20.0 + cases["stage"].map(spread) * (2.0 * cases["replicate"] - 3.0), replicates=2
    )
    assert both.noise(["screening"]).df == 12
    assert both.heap_variance == pytest.approx(
        {"screening": 2.0, "climb": 18.0, "composite": 0.0, "verification": 0.0}
    )
    # Composite runs at one setting are replicates too: 13 runs at 9 settings, 26 heaps.
    assert both.noise(["composite"]).df == 17
    # What is taken out of a run's mean square is that over the two heaps: 18 / 2.
    assert both.agreement(["climb"]).value_variance == pytest.approx(9.0, rel=1e-12)


def test_a_stage_without_replicates_has_the_noise_of_all(perfect: Replay) -> None:
    single = perfect.heap_variance["screening"]
    assert single == pytest.approx(perfect.noise().mean_sq)
    # Composite centres and verification: 1.194966 + 2.687378 over 4 + 2.
    assert single == pytest.approx((1.194966 + 2.687378) / 6.0, rel=1e-5)


def test_failed_cases_are_left_out() -> None:
    cases = planned_cases(2).assign(status="finished", reason="")
    cases["angle"] = cases["published"] + 1.0
    gone = (cases["stage"] == "screening") & (cases["run"] == 4)
    partly = (cases["stage"] == "climb") & (cases["run"] == 2) & (cases["replicate"] == 2)
    cases.loc[gone | partly, ["status", "angle"]] = ["diverged", np.nan]
    replay = Replay(cases)
    assert replay.agreement().runs == 30
    assert replay.agreement().bias.value == pytest.approx(1.0)
    runs = replay.runs.set_index(["stage", "run"])
    assert runs.loc[("screening", 4), "n"] == 0
    assert runs.loc[("climb", 2), "n"] == 1
    assert len(replay.screening.response) == 22
