"""Proposed heaps join the first of their condition; a table counts the ties that they settled."""

import csv
from collections import Counter
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from discoveries import made_discovery

from doe.discrepancy import Outcomes, Point, Verdict
from experiments.discover.search import Search
from experiments.evidence.trials import tie_trials
from experiments.evidence.trials.analyses import keep
from experiments.evidence.trials.generate_trials import STUDY
from experiments.evidence.trials.tie_trials import HIDDEN, REPLICATES, SIZES, compared, main, twin
from experiments.evidence.trials.trials_folder import Folder
from experiments.evidence.trials.truth import Sealed
from experiments.studyfile import Study, load_study

SEARCH = Search.of(load_study(STUDY, "small"))


def test_twins_have_each_effect_in_turn_in_its_part_of_the_range() -> None:
    space, labels = SEARCH.space, [twin(number, SEARCH.space) for number in range(30)]
    assert [label.mechanisms for label in labels] == [(name,) for name in HIDDEN] * 10
    for label in labels:
        assert np.all((space.lower <= np.array(label.theta)) & (label.theta <= np.array(space.upper)))
        assert SIZES[0] <= space.coded_size(*label.sizes[0]) <= SIZES[1]
    assert len({label.seed for label in labels}) == len(labels)


class NoisyEngine:
    """An engine whose observables are numbers that the seed of the case determines."""

    def __init__(self, study: Study, *_: object) -> None:
        self.observables = tuple(each.name for each in study.measurable)

    def __enter__(self) -> "NoisyEngine":
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def __call__(self, points: list[Point]) -> Outcomes:
        rows = [
            np.random.default_rng(point.seed).uniform(0.1, 0.2, len(self.observables)) for point in points
        ]
        return Outcomes(np.array(rows), ("",) * len(rows))


def heaps_of(path: Path, observable: str) -> dict[tuple[str, str], float]:
    with path.open(newline="", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["observable"] == observable]
    return {(row["condition"], row["replicate"]): float(row["value"]) for row in rows}


def test_proposed_heaps_join_those_of_their_condition(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The search is made up: twin 0 ends in a tie, and is named after its heaps were repeated."""

    def search(folder: Folder, trials: list[Sealed], *_: object) -> None:
        ends = {"twin-000": Verdict.TIE, "twin-000-more": Verdict.NAMED}
        found = {each.trial: made_discovery(ends.get(each.trial, Verdict.NONE)) for each in trials}
        keep(folder, {f"{trial}.everything": end for trial, end in found.items()})

    monkeypatch.setattr(tie_trials, "EngineSimulator", NoisyEngine)
    monkeypatch.setattr(tie_trials, "run_trials", search)
    main(tmp_path, tmp_path / "bank.npz", 2, "small", "cpu")
    step = made_discovery(Verdict.TIE).next_experiment
    assert step is not None
    # no photograph shows the pull on the wall, so no camera scatters it
    first, joined = (heaps_of(tmp_path / "data" / f"twin-000{end}.csv", "wall_drag") for end in ("", "-more"))
    conditions = SEARCH.space.conditions
    assert Counter(name for name, _ in first) == dict.fromkeys(conditions, REPLICATES)
    assert Counter(name for name, _ in joined) - Counter(name for name, _ in first) == {
        "wide": step.replicates
    }
    assert first.items() <= joined.items()
    assert len(set(joined.values())) == len(joined)
    table = pd.read_csv(tmp_path / "ties.csv").set_index("twin")
    assert table.loc["twin-000", ["first", "after"]].tolist() == ["a tie", "the truth"]
    assert table["heaps"].sum() == step.replicates
    assert not (tmp_path / "data" / "twin-001-more.csv").exists()


def test_heaps_without_an_effect_are_searched_by_themselves_and_the_alarm_decides() -> None:
    label, rough = twin(1, SEARCH.space), {"conditions": ["rough"], "replicates": 3}
    for without, left in (("liquid_bridges", ()), ("rolling_torque", label.sizes)):
        other, points = tie_trials.proposed(label, [], {**rough, "without": without})
        assert [point.sizes for point in points] == [left] * 3 == [other.sizes] * 3
        ends = [tie_trials.outcome({"verdict": v}, "liquid_bridges", without) for v in ("none", "tie")]
        assert ends == (["the truth", "a wrong name"] if left == () else ["a wrong name", "the truth"])


def test_the_table_counts_the_ties_that_were_settled_by_their_stated_chance() -> None:
    tie = {"hidden": HIDDEN[0], "named": " ".join(HIDDEN), "chance": 1, "heaps": 8, "after": "the truth"}
    wrong = tie | {"chance": 0.2, "named": HIDDEN[1], "after": "a wrong name"}
    rows = [tie, tie, tie | {"after": "unknown"}, wrong]
    found = compared(pd.DataFrame([*rows, tie | {"chance": np.nan}])).set_index("ties")
    # a share of 2 of 4 has the standard error sqrt(.5 * .5 / 3), of 2 of 3 sqrt(2 / 9 / 2)
    right = found["the truth alone, % (se)"].loc[["all", "stated 80 % or more"]]
    assert right.tolist() == ["50 (28.9)", "67 (33.3)"]
    assert found.loc["all", ["number", "truth in the tie", "stated, %"]].tolist() == [4, 3, 80]
    assert found.loc["stated less", "a wrong name"] == found.loc["all", "unknown"] == 1
