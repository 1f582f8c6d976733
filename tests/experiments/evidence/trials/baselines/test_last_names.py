"""Reasons of the kept series have one rule each, and names have no rule."""

from pathlib import Path

import pytest

from doe.discrepancy import Verdict
from doe.discrepancy.verdict.conclusion import WORSE
from experiments.evidence.trials.baselines.last_names import EMULATED, RECORD, RULES, stopped, verdicts


@pytest.mark.parametrize("record", [EMULATED, RECORD / "seventeenth", RECORD / "eleventh"])
def test_every_verdict_of_a_kept_series_has_its_rule(record: Path) -> None:
    table = verdicts(record)
    named = table["verdict"] == Verdict.NAMED
    assert (table.loc[named, "rule"] == "").all()
    withdrawn = table["reason"].str.startswith("fresh runs with")
    assert table.loc[~named & ~withdrawn, "rule"].isin(list(RULES)).all()
    # by the limit of today, and not by that of the record
    assert ((table["rule"] == "") == (named | (withdrawn & (table["rise"] <= WORSE)))).all()
    tied = table[table["rule"] == "a tie"]
    # the best model of a tie is one of its names
    assert all(stopped(row.reason)[1] <= set(row.named.split()) for row in tied.itertuples())


def test_the_best_model_of_a_pair_has_both_names() -> None:
    reason = "plate tilt with size spread comes closest, but its size is 1.7 standard errors, less than 5"
    assert stopped(reason) == ("its size is too few errors", {"plate_tilt", "size_spread"})
