"""The plan of large campaigns on many GPUs, against the waves that one GPU has run."""

from __future__ import annotations

from dataclasses import replace

import pytest

from experiments.evidence.robustness.cluster.plan import Assumptions, check, page, planned, step_seconds

GIVEN = Assumptions(keeps=1.0)


def test_the_rule_tells_the_waves_that_were_run() -> None:
    waves = check(GIVEN)
    ratio = waves["told, s"] / waves["taken, s"]
    assert ratio.between(1 / 1.5, 1.5).all()
    assert waves["told, s"].sum() == pytest.approx(waves["taken, s"].sum(), rel=0.1)


def test_a_step_costs_what_was_measured_and_beyond_it_a_grain_costs_the_same() -> None:
    assert step_seconds(2516.0) == pytest.approx(8.637e-6, rel=1e-3)
    assert step_seconds(128 * 2505.62) == pytest.approx(267.683e-6, rel=1e-3)
    assert step_seconds(1e6) == pytest.approx(2.0 * step_seconds(5e5))


def test_time_falls_by_the_gpus_and_by_what_they_keep() -> None:
    alone = float(str(planned(1_000_000, 8, GIVEN)["hours"]))
    assert float(str(planned(1_000_000, 64, GIVEN)["hours"])) == pytest.approx(alone / 8.0, rel=0.01)
    half = planned(1_000_000, 8, replace(GIVEN, keeps=0.5))
    assert float(str(half["hours"])) == pytest.approx(2.0 * alone, rel=0.001)


def test_the_page_says_what_is_assumed() -> None:
    text = page(Assumptions())
    assert "| speed that a GPU keeps beside others | 95 % | **assumed**, `--keeps` |" in text
    assert "not measured yet" in text
    assert all(f"| {cases} | {gpus} |" in text for cases in ("10,000", "1,000,000") for gpus in (8, 64, 512))
