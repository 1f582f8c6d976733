"""Driven pairs: sets of laws give their theory in every motion, and a wrong theory is seen."""

import numpy as np
import pytest

from experiments.evidence.verification.problems.pair_laws import THEORIES, driven, pair_rows, predicted


@pytest.mark.parametrize("name", ["edem", "yade", "relative with twisting"])
def test_a_set_of_laws_gives_its_theory(name: str) -> None:
    rows, _ = pair_rows(name, "cpu")
    judged = [row for row in rows if row.tolerance is not None]
    # all motions but the turn in plane; with the mechanism, the twist alone
    assert len(judged) == (1 if "twisting" in name else 5)
    assert all(row.passed for row in judged), judged


def test_the_theory_of_another_set_is_seen() -> None:
    courses, acted = driven("liggghts", "cpu")
    for number, rolls, other in ((1, False, "edem"), (2, True, "liggghts-cdt")):
        want = predicted(THEORIES[other], rolls, courses[number])
        size = np.abs(want).max(axis=(0, 2, 3))
        # a dashpot that friction does not limit, and a torque without a spring
        assert (np.abs(acted[number] - want).max(axis=(0, 2, 3)) > 0.05 * size).any()
