"""Choice of the study's base: its heaps are kept and read, and chosen among by the paper's own tables."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from shutil import rmtree
from typing import Any

import numpy as np
import pandas as pd
import pytest

from dem_warp import Case, CaseResult
from experiments.cases import OwnWorkers, Store
from experiments.cases.workers import own
from experiments.evidence.studies.buckwheat.records import base_page
from experiments.evidence.studies.buckwheat.records.base_disagreement import disagreement
from experiments.evidence.studies.buckwheat.replay import base_heaps
from experiments.evidence.studies.buckwheat.replay.base_choice import (
    GO_ON,
    BaseChoice,
    first_phase,
    read_heaps,
    second_phase,
)
from experiments.evidence.studies.buckwheat.replay.base_heaps import (
    BASES,
    ESTIMATORS,
    base_changes,
    read_heap,
    simulate_base,
)
from experiments.evidence.studies.buckwheat.replay.replay import Replay
from experiments.evidence.studies.buckwheat.replay.runs import DESIGNS, planned_cases
from experiments.io.errors import InputError
from experiments.studyfile import load_study
from imaging import heap_angle

TRUTH = "relative-keeled-round", "middle"


def made_up(offset: Callable[[str, str, pd.DataFrame], Any], replicates: int = 3) -> pd.DataFrame:
    """Heaps of all bases: the published angle, noise of a heap of 0.5 degrees, and an offset [deg]."""
    rng, parts = np.random.default_rng(3), []
    for base in BASES:
        plan = planned_cases(replicates, DESIGNS)
        noisy = plan["published"] + 0.5 * rng.standard_normal(len(plan))
        angles = {name: noisy + offset(base, name, plan) for name in ESTIMATORS}
        parts.append(plan.assign(base=base, **angles))
    return pd.concat(parts)


@pytest.fixture(scope="module")
def heaps() -> pd.DataFrame:
    """One base, read by one estimator, gives the published angles; the others are 2 degrees off, or more."""
    order = list(BASES)
    return made_up(lambda base, name, _: 0.0 if (base, name) == TRUTH else 2.0 + 0.5 * order.index(base))


def test_every_base_is_another_case_of_the_paper() -> None:
    cases = [load_study(None, "printed", base_changes(name)).case({}, 1).to_dict() for name in BASES]
    assert len({str(case) for case in cases}) == len(BASES) == 10
    assert {case["numerics"]["modulus_scale"] for case in cases} == {1.0}


def test_the_base_that_gives_the_published_angles_is_chosen_by_any_two_tables(heaps: pd.DataFrame) -> None:
    choice = second_phase(heaps)
    assert (choice.best().base, choice.best().estimator) == TRUTH
    assert [(each.base, each.estimator) for each in choice.left_out.values()] == [TRUTH] * 3
    # Noise of both is taken out: the published angles that are no noise here count as 0.55 degrees.
    assert choice.best().misfit()[0] == 0.0
    # Any other candidate of the four bases is off by 2 degrees at least.
    assert min(each.misfit()[1] for each in choice.candidates if (each.base, each.estimator) != TRUTH) > 1.8


def test_the_four_bases_of_least_misfit_go_on(heaps: pd.DataFrame) -> None:
    found = [each.base for each in first_phase(heaps).best_of_bases]
    assert found == [TRUTH[0], *(base for base in BASES if base != TRUTH[0])]
    assert {each.base for each in second_phase(heaps).candidates} == set(found[:GO_ON])
    # More heaps of the others change nothing: the first phase looks at one heap a run.
    assert [each.base for each in first_phase(heaps[heaps["replicate"] == 1]).best_of_bases] == found


def test_a_base_that_fails_in_one_table_is_chosen_without_it_alone() -> None:
    found = BaseChoice.of(
        made_up(lambda base, _, runs: 9.0 * (runs["stage"] == "composite") if base == TRUTH[0] else 3.0)
    )
    assert {out: each.base == TRUTH[0] for out, each in found.left_out.items()} == {
        "screening": False, "climb": False, "composite": True,
    }  # fmt: skip
    # 9 degrees and the noise, less what is known of it.
    assert found.left_out["composite"].misfit(["composite"])[0] == pytest.approx(9.0, abs=0.2)


def test_a_reading_that_lacks_a_run_is_no_candidate_and_equal_ones_keep_their_order() -> None:
    heaps = made_up(lambda *_: 0.0, 1)
    first = heaps["base"] == "relative-printed-endless"
    heaps.loc[first & (heaps["stage"] == "climb") & (heaps["run"] == 2), "flank"] = np.nan
    heaps.loc[~first, list(ESTIMATORS)] += 1.0
    found = first_phase(heaps).best_of_bases[0]
    assert (found.base, found.estimator) == ("relative-printed-endless", "trimmed")


def test_heaps_are_kept_as_they_end_and_none_is_simulated_twice(
    cone: Callable[..., CaseResult], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    simulated: list[int] = []

    def simulate(cases: Sequence[Case], *_: Any, on_result: Any, **__: Any) -> list[CaseResult]:
        results = []
        for index, case in enumerate(cases):
            if len(simulated) == 4:
                simulated.append(-1)
                raise KeyboardInterrupt
            simulated.append(case.seed)
            results.append(cone(0.5, radius=2e-3))
            on_result(index, results[-1])
        return results

    monkeypatch.setattr(own, "simulate", simulate)
    monkeypatch.setattr(base_heaps, "DESIGNS", ("climb",))
    name, workers = "relative-flat-round", OwnWorkers("cpu", 1)
    with pytest.raises(KeyboardInterrupt):
        simulate_base(name, tmp_path, 1, "bench", workers=workers)
    simulate_base(name, tmp_path, 1, "bench", workers=workers)
    table = simulate_base(name, tmp_path, 2, "bench", workers=workers)
    assert sorted(simulated) == [-1, *sorted(table["seed"])]
    heap = cone(0.5, radius=2e-3)
    angle = heap_angle(heap.sphere_centers, heap.sphere_radii).mean
    assert pd.read_csv(tmp_path / f"{name}.csv")["flank"].to_numpy() == pytest.approx(angle)
    # Another machine has the table alone.
    rmtree(tmp_path / name)
    assert len(simulate_base(name, tmp_path, 1, "bench", workers=workers)) == 12
    assert len(simulated) == 13
    with pytest.raises(InputError, match=r"must have the heaps of all bases, got none of .*printed-endless"):
        read_heaps(tmp_path)


def test_every_estimator_reads_the_slope_of_a_cone(cone: Callable[..., CaseResult], tmp_path: Path) -> None:
    section, store = load_study().measurement, Store(tmp_path)
    for slope in (0.3, 0.6):
        store.save("cone", cone(slope, radius=0.5e-3))
        found = read_heap(store, section, "cone")
        assert not found["reason"]
        # Spheres of a fortieth of the base round the apex and the foot: about half a degree.
        assert [found[name] for name in ESTIMATORS] == pytest.approx(
            [math.degrees(math.atan(slope))] * len(ESTIMATORS), abs=0.8
        )


def test_a_failed_case_has_no_angle_and_its_reason(cone: Callable[..., CaseResult], tmp_path: Path) -> None:
    store = Store(tmp_path)
    store.save("lost", cone(status="diverged", reason="a grain left the world"))
    found = read_heap(store, load_study().measurement, "lost")
    assert {found[name] for name in ESTIMATORS} == {None}
    assert found["reason"] == "a grain left the world"


def test_the_page_says_which_aims_are_met_and_what_is_reproduced(heaps: pd.DataFrame, tmp_path: Path) -> None:
    base_page.keep_heaps(heaps, tmp_path)
    shipped = heaps[heaps["base"] == TRUTH[0]].assign(angle=lambda rows: 40.0 - rows[TRUTH[1]])
    shipped.to_csv(tmp_path / base_page.RUNS, index=False)
    text = base_page.write_base_page("Made up.", tmp_path).read_text("utf-8")
    assert f"Chosen: **{TRUTH[0]}**, read by **{TRUTH[1]}**" in text
    met = [line.split("|")[4].strip() for line in text.split("## What")[0].splitlines() if "|" in line]
    assert met == ["met", "---", *["yes"] * 5]
    found = base_page.findings_table({"turned": Replay(shipped)}).set_index("finding")
    # The paper's own conclusions; angles that are turned round have every one of them reversed.
    assert found.loc["Table 3, two strongest factors", "published"] == "F, E"
    assert found.loc["Table 6, coefficient of F [°]", "published"] == "1.12"
    assert (found["reproduced"] == "no").sum() == len(found) - 1


def test_the_clump_that_the_chosen_base_lacks_is_found() -> None:
    def offset(base: str, _: str, runs: pd.DataFrame) -> pd.Series:
        """Give one base the published angles, and the others 6 degrees more where steel is rough."""
        return 6.0 * (runs["F"] > 0.4) * (base != "relative-swelling-round")

    heaps = made_up(offset)
    lacking = BaseChoice.of(heaps[heaps["base"] == "relative-bulging-round"]).candidates[0]
    found = disagreement(heaps, lacking)
    assert found.base.q > found.base.q_limit
    assert found.candidates[0].mechanisms == ("relative-swelling-round",)
    assert found.candidates[0].sizes[0].value == pytest.approx(1.0, abs=0.2)  # three times its error
    right = BaseChoice.of(heaps[heaps["base"] == "relative-swelling-round"]).candidates[0]
    assert disagreement(heaps, right).verdict == "none"
