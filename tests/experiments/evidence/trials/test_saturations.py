"""The search for effects that saturate, in a world where one does."""

from synthetic import SATURATION, bank, saturating_bank

from experiments.evidence.trials.saturations import compare, halves


def test_half_of_a_bank_tells_the_other_better_with_the_saturation_that_is_there() -> None:
    _, runs = saturating_bank()
    table = compare(runs, [SATURATION / 2.0, 0.05])
    right, too_soon = table.loc["alpha"]
    # 320 runs of 12 observables: without it the score is hundreds worse, and chance moves it by some tens
    assert right < -100.0
    assert right < too_soon


def test_where_nothing_saturates_no_saturation_tells_more() -> None:
    table = compare(bank(), [0.1])
    assert (table["0.1"] > 0.0).all()


def test_both_halves_know_the_base_and_share_the_runs_of_effects() -> None:
    whole = bank()
    one, other = halves(whole)
    base = int((whole.mechanism < 0).sum())
    assert (one.mechanism < 0).sum() == (other.mechanism < 0).sum() == base
    assert len(one.mechanism) + len(other.mechanism) == len(whole.mechanism) + base
