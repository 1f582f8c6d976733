"""Variants of the buckwheat study: what each changes, and what is made of their angles."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dem_warp import Case, CaseResult
from dem_warp.clumps import ClumpShape
from experiments.cases import Store, execute
from experiments.cases.workers import own
from experiments.evidence.studies.buckwheat import seed_clumps
from experiments.evidence.studies.buckwheat.replay.replay import Replay
from experiments.evidence.studies.buckwheat.sensitivity import __main__ as sensitivities
from experiments.evidence.studies.buckwheat.sensitivity.sensitivities import Sensitivities
from experiments.evidence.studies.buckwheat.sensitivity.variants import BASE, chosen_variants, variants
from experiments.io.errors import InputError, StoreError
from experiments.measurement.case_observables import Observed
from experiments.studyfile.study import MeasurementSection

FREE = {"base", "fit-middle", "fit-lower", "fit-upper", "two-views"}
"""Variants that need no heaps but the base's."""


def made_up(change: Callable[[Any], Any], name: str = BASE) -> Replay:
    cases = variants()[name].planned_cases(1)
    return Replay(cases.assign(status="finished", angle=change(cases)))


@pytest.fixture(scope="module")
def found() -> Sensitivities:
    """A base 3 degrees high, a variant 1 degree high, one that is right in Table 3 alone."""
    return Sensitivities(
        {
            BASE: made_up(lambda cases: cases["published"] + 3.0),
            "fit-middle": made_up(lambda cases: cases["published"] + 1.0),
            "clump-flat": made_up(lambda cases: cases["published"] + 9.0 * (cases["stage"] != "screening")),
        },
        {"scale": "bench", "modulus_scale": None, "replicates": 1},
    )


def test_every_variant_is_another_case_except_those_of_the_estimator() -> None:
    settings = {"E": 0.48, "F": 0.45}
    cases = {
        name: variant.load_study("bench").case(settings | variant.settings, seed=1).to_dict()
        for name, variant in variants().items()
    }
    assert {name for name, case in cases.items() if case == cases[BASE]} == FREE
    assert cases["rolling-none"]["grain_grain"]["rolling_friction"] == 0.0


def test_a_softened_modulus_is_for_all_but_those_that_vary_it() -> None:
    scales = {
        name: variant.load_study("paper", 10.0).numerics.modulus_scale for name, variant in variants().items()
    }
    assert {name: scale for name, scale in scales.items() if scale != 10.0} == {
        "modulus-1": 1.0,
        "rolling-explicit": 1.0,
        "modulus-100": 100.0,
    }


def test_all_variants_have_the_same_seeds() -> None:
    plans = [variant.planned_cases(2) for variant in variants().values()]
    assert all((plan["seed"] == plans[0]["seed"]).all() for plan in plans)
    assert all(len(plan) == 62 for plan in plans)


def test_an_unknown_variant_is_refused() -> None:
    with pytest.raises(InputError, match="--variant: must name a variant, did you mean 'clump-flat'"):
        chosen_variants(["clump-flt"])
    assert [v.name for v in chosen_variants(["clump-flat", "base"])] == ["base", "clump-flat"]


def test_shifts_are_those_that_were_put_in(found: Sensitivities) -> None:
    shifts = found.shifts
    assert shifts["shift"]["fit-middle"] == pytest.approx(-2.0)
    assert shifts["bias"][["base", "fit-middle"]].tolist() == pytest.approx([3.0, 1.0])
    # 3 of 31 settings at 5 centres: seed noise is the printed centres', 0.298741, taken out of one heap's
    # square; the median's correction is 2/3 to 2 noise variances over the runs, 0.01 of 8.7.
    noise = 0.298741
    assert shifts["rmse"][BASE] == pytest.approx(np.sqrt(9.0 - noise), rel=1e-3)
    assert shifts["change"]["fit-middle"] == pytest.approx(
        np.sqrt(1.0 - noise) - np.sqrt(9.0 - noise), rel=1e-2
    )
    # The mean of 31 differences of two heaps each.
    assert shifts["se"]["fit-middle"] == pytest.approx(np.sqrt(2.0 * noise / 31.0), rel=1e-6)
    assert set(shifts.index[shifts["shift"].notna()]) == set(found.replays)


def test_a_constant_shift_leaves_the_effects(found: Sensitivities) -> None:
    assert found.effects.loc["fit-middle", list("ABCDEFGH")].to_numpy() == pytest.approx(0.0, abs=1e-12)


def test_two_tables_choose_and_the_third_tells(found: Sensitivities) -> None:
    table = found.left_out
    # Wherever Tables 5 and 6 are seen the variant that misses them is not chosen.
    assert table["chosen"].tolist() == ["fit-middle"] * 3
    assert (table["chosen_left_out"] < table["base_left_out"]).all()


def test_numerical_checks_are_never_chosen(found: Sensitivities) -> None:
    best = made_up(lambda cases: cases["published"])
    with_check = Sensitivities({**found.replays, "modulus-10": best}, found.settings)
    assert "modulus-10" not in with_check.left_out["chosen"].tolist()


@pytest.fixture
def batches(cone: Callable[..., CaseResult], monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Stand in for the engine: angles follow the friction of the wall; the sizes of the batches are kept."""
    sizes: list[int] = []
    heap = cone()

    def simulate(
        cases: Sequence[Case], *, on_result: Callable[[int, CaseResult], None], **_: Any
    ) -> list[CaseResult]:
        sizes.append(len(cases))
        for index, case in enumerate(cases):
            on_result(index, replace(heap, observables={"truth": 50.0 * case.grain_wall.static_friction}))
        return []

    def observe(settings: MeasurementSection, result: CaseResult, _: bool) -> Observed:
        lower = 2.0 if settings.fit == "middle" else 0.0
        return Observed({"angle": result.observables["truth"] - lower}, SimpleNamespace(se=0.1))

    monkeypatch.setattr(own, "simulate", simulate)
    monkeypatch.setattr(execute, "observe", observe)
    return sizes


def test_a_variant_is_one_batch_and_is_not_run_twice(
    batches: list[int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sensitivities.main(["fill-slow", "fit-middle", "base"], "bench", None, 1, None, tmp_path)
    # The estimator takes the heaps of the base.
    assert batches == [31, 31]
    assert len(Store(tmp_path / "cases")) == 62
    read = Sensitivities.read(tmp_path)
    assert read is not None
    assert set(read.replays) == {"base", "fit-middle", "fill-slow"}
    assert read.shifts["shift"][["fill-slow", "fit-middle"]].tolist() == pytest.approx([0.0, -2.0])
    # What was not run has no rows in any table.
    printed = capsys.readouterr().out
    assert [name for name in variants() if f"\n{name} " in printed] == ["base", "fit-middle", "fill-slow"]
    sensitivities.main(["fill-slow", "base"], "bench", None, 1, None, tmp_path)
    assert batches == [31, 31]
    assert "fit-middle" in capsys.readouterr().out
    with pytest.raises(StoreError, match="all variants of a folder are simulated as one another"):
        sensitivities.main(["base"], "bench", 10.0, 1, None, tmp_path)


def test_a_variant_of_too_few_angles_is_not_compared(tmp_path: Path) -> None:
    (tmp_path / "settings.json").write_text("{}", encoding="utf-8")
    cases = variants()[BASE].planned_cases(1).assign(status="finished", reason="")
    whole = cases.assign(angle=cases["published"])
    whole.to_csv(tmp_path / "base.csv")
    whole.assign(angle=whole["angle"].where(whole["stage"] != "climb")).to_csv(tmp_path / "fill-slow.csv")
    read = Sensitivities.read(tmp_path)
    assert read is not None
    assert (set(read.replays), read.spoilt) == ({BASE}, ("fill-slow",))
    assert read.left_out["chosen"].tolist() == [BASE] * 3


def test_without_a_base_nothing_is_compared(tmp_path: Path) -> None:
    assert Sensitivities.read(tmp_path) is None


def test_the_clumps_lie_inside_the_measured_size() -> None:
    for name, recipe in seed_clumps.CLUMPS.items():
        shape = ClumpShape.read(seed_clumps.FOLDER / f"{name}.txt")
        *across, height = sorted(seed_clumps.extents(shape))
        assert shape.sphere_count == recipe.spheres
        # Written to 1e-9 mm.
        assert height <= seed_clumps.HEIGHT * (1.0 + 1e-9)
        assert max(across) <= seed_clumps.EDGE * (1.0 + 1e-9)
        assert max(height / seed_clumps.HEIGHT, max(across) / seed_clumps.EDGE) == pytest.approx(
            1.0, rel=1e-9
        )


def test_a_clump_is_the_one_of_its_recipe() -> None:
    made, kept = seed_clumps.CLUMPS["flat-5"].clump(), ClumpShape.read(seed_clumps.FOLDER / "flat-5.txt")
    # Written to 1e-9 mm, then turned into principal axes again.
    np.testing.assert_allclose(made.radii, kept.radii, rtol=1e-8)
    np.testing.assert_allclose(np.abs(made.centers), np.abs(kept.centers), atol=1e-10)
