"""Words of the page next to the verdict: instruments that a model leans on, factors that drift."""

from dataclasses import replace

import pytest
from discoveries import made_discovery

from doe.discrepancy import CalibrationUse, Fit, Interval, Verdict
from experiments.report.discovery import Terms, verdict_sentence


def leaning_on(fit: Fit | None, **deviations: float) -> Fit:
    """Return the fit with such uses of the allowances."""
    assert fit is not None
    uses = (CalibrationUse(name, 0.01, 0.0, 0.01 * sd, 0.0, sd) for name, sd in deviations.items())
    return replace(fit, calibration=tuple(uses))


@pytest.mark.parametrize("verdict", [Verdict.NONE, Verdict.NAMED, Verdict.UNKNOWN])
def test_a_model_that_leans_on_an_allowance_says_so(verdict: Verdict, terms: Terms) -> None:
    found = made_discovery(verdict)
    part = {Verdict.NONE: "base", Verdict.NAMED: "chosen", Verdict.UNKNOWN: "closest"}[verdict]
    fit = leaning_on(found.base, t55=2.6, fill_height=1.9)
    sentence = verdict_sentence(replace(found, **{part: fit}), terms)
    words = "The model leans on what was allowed for the calibration of t55 (2.6 standard deviations):"
    assert f"{words} check that instrument." in sentence
    # a model within an allowance does not lean on it
    assert "fill height (" not in sentence


def test_a_size_at_the_largest_that_was_explored_says_so(terms: Terms) -> None:
    name, most = next((name, one.maximum) for name, one in terms.mechanisms.items())
    for share, words in ((1.0, f" to ≥ {most:.3g}, not explored beyond)"), (0.9, f" to {0.9 * most:.3g})")):
        size = terms.size(name, Interval(0.5 * most, 0.7 * most, share * most))
        assert size.endswith(words)


def test_lengths_that_lean_on_one_scale_are_one_instrument(terms: Terms) -> None:
    found = made_discovery(Verdict.NAMED)
    assert found.chosen is not None
    # off by 0.5 % of 0.2 % allowed, all lengths of the picture alike
    uses = [CalibrationUse(name, 0.0, 0.002, 0.0, 0.005, 2.5) for name in ("height", "r50", "r90")]
    sentence = verdict_sentence(replace(found, chosen=replace(found.chosen, calibration=tuple(uses))), terms)
    words = "the calibration of the scale of the photograph (2.5 standard deviations): check that instrument."
    assert sentence.endswith(words)


def test_factors_that_drift_are_no_contradiction_to_a_model_that_lacks_nothing(terms: Terms) -> None:
    found = made_discovery(Verdict.NONE)
    first, second = found.drifts
    words = "would differ between conditions"
    assert f"{terms.factors[first.factor].label} and" in verdict_sentence(found, terms)
    assert words in verdict_sentence(found, terms)
    one = verdict_sentence(replace(found, drifts=(first, replace(second, p_value=0.01))), terms)
    assert terms.factors[second.factor].label not in one
    assert words in one
    calm = tuple(replace(drift, p_value=0.01) for drift in found.drifts)
    assert words not in verdict_sentence(replace(found, drifts=calm), terms)
