"""The published numbers of the buckwheat study: which follow from its runs, and which are misprints."""

import pytest

from dem_warp.clumps import ClumpShape
from experiments.studies.buckwheat import paper


@pytest.fixture(scope="module")
def comparison():
    return paper.comparison()


def test_every_printed_cell_is_compared(comparison):
    counts = comparison["place"].value_counts().to_dict()
    # Cells counted by hand in the paper's tables, levels and responses (the input) left out.
    assert counts == {
        "Table 4": 8 * 4,
        "Table 5": 6,
        "Table 6": 10,
        "equations (8) and (9)": 6 + 5,
        "Table 7": 10 + 9 + 7 + 7,
        "Table 8": 9 + 8 + 6 + 6,
        "Tables 7 and 8": 2 * 4,
        "text, verification": 6,
        "text": 4,
    }


def test_only_what_is_made_of_rounded_numbers_has_slack(comparison):
    loose = comparison[comparison["slack"] > 0.0].set_index("item")
    assert list(loose.index) == [
        "p of the two-sample t-test",
        "angle that the reduced model gives at the optimum",
    ]
    # Slopes at the values: dp = 2 pdf(t) dt with dt = 0.0005 / 0.578, and 14.5 and 11.4 degrees by unit of E
    # and F; the standard deviation's rounding and the curvature add less than a fifth.
    assert loose["slack"].tolist() == pytest.approx([6.1e-4, 1.3e-2], rel=0.2)
    # Recomputed by hand in two statistics packages.
    assert loose["recomputed"].tolist() == pytest.approx([0.768591, 30.15091], rel=1e-6)


MISPRINTS = {
    ("Table 5", "4, relative_error_pct"): ("1.26", "1.27"),
    ("Table 7", "E, F"): ("23.06", "23.60"),
    ("Table 8", "model, mean_sq"): ("6.13", "4.74"),
    ("Table 8", "model, F"): ("36.10", "20.12"),
    ("Table 8", "E, F"): ("37.17", "26.82"),
    ("Table 8", "F, mean_sq"): ("6.06", "10.04"),
    ("Table 8", "F, F"): ("35.66", "42.65"),
    ("Table 8", "E:F, mean_sq"): ("6.02", "2.11"),
    ("Table 8", "E:F, F"): ("35.46", "8.98"),
    ("text", "mean angle at the optimum"): ("30.321", "30.326"),
}
"""Numbers as printed, and as the printed runs give them, in the printed digits."""


def test_exactly_the_known_numbers_disagree_with_the_runs(comparison):
    wrong = comparison[~comparison["agrees"]]
    found = zip(wrong["place"], wrong["item"], wrong["printed"], strict=True)
    assert list(found) == [(*place, printed) for place, (printed, _) in MISPRINTS.items()]


def test_misprints_state_the_recomputed_value_in_the_printed_digits():
    found = {(misprint.place, misprint.item): misprint.recomputed for misprint in paper.misprints()}
    assert found == {place: recomputed for place, (_, recomputed) in MISPRINTS.items()} | {
        ("text, verification", "name of the modulus"): "shear modulus 34.325 MPa",
        ("text, steepest climb", "step of F over step of E"): "3.946 coded",
        ("Table 5", "1, E"): "0.32 to 0.6",
        ("Table 5", "1, F"): "0.18 to 0.58",
        ("Table 5", "6, F"): "0.18 to 0.58",
        ("Table 6", "6, F"): "0.18 to 0.58",
        ("equation (4)", "effective elastic modulus"): "1/E* = (1 - v1^2)/E1 + (1 - v2^2)/E2",
        ("equation (6)", "effective shear modulus"): "1/G* = (2 - v1)/G1 + (2 - v2)/G2",
        ("Table 7", "title"): "ANOVA of the central composite design",
    }


def test_every_misprint_has_its_own_reason():
    reasons = [misprint.reason for misprint in paper.misprints()]
    assert all(reasons)
    assert "does not follow from the printed runs" not in reasons


def test_printed_p_values_of_the_misprinted_tests_belong_to_the_recomputed_ones(comparison):
    cells = comparison.set_index(["place", "item"])
    for source in ("model", "E", "F", "E:F"):
        assert not cells.loc[("Table 8", f"{source}, F"), "agrees"]
        assert cells.loc[("Table 8", f"{source}, p"), "agrees"]


def test_the_published_tables_carry_the_names_of_the_analysis():
    assert list(paper.published("screening_anova").index) == list(paper.screening().table.index)
    for model in ("quadratic", "reduced"):
        assert list(paper.published(f"{model}_anova").index) == list(paper.surface(model).anova.index)
    assert paper.published("coefficients").loc["E:F", "quadratic"] == 121.167


def test_the_published_target_is_the_measured_angle():
    assert paper.measured().mean == float(paper.printed("conclusions").iloc[2, 0])
    assert (paper.measured().sd, paper.measured().n) == (0.518, 5)


def test_unknown_tables_and_models_are_refused():
    with pytest.raises(ValueError, match=r"a published table is one of central_composite, .* got 'table_9'"):
        paper.printed("table_9")
    with pytest.raises(ValueError, match="a model of the paper is one of quadratic, reduced, got 'cubic'"):
        paper.surface("cubic")


def test_the_reference_clump_has_the_size_of_the_measured_grain():
    clump = ClumpShape.read(paper.CLUMP)
    top, bottom = clump.centers[:, 2] + clump.radii, clump.centers[:, 2] - clump.radii
    assert clump.sphere_count == 9
    # Mean height of the measured grains; the spheres are written to 1e-6 mm.
    assert top.max() - bottom.min() == pytest.approx(5.90e-3, rel=1e-6)
    # An independent voxel sum at 0.02 mm gives 19.398 mm3; its error is that of its last digit.
    assert clump.volume == pytest.approx(19.398e-9, rel=1e-4)
    x, y, z = clump.inertia_over_mass
    # A threefold axis makes the two other moments equal, within the integral's 1e-4.
    assert x == pytest.approx(y, rel=1e-4)
    assert z == pytest.approx(0.9331e-6, rel=2e-4)
