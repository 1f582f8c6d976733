"""The analysis as a whole on a synthetic world: every verdict, its guards, and data with something wrong."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import synthetic_world
from synthetic_world import BLENDED, CONDITIONS, OBSERVABLES, SETTINGS, SyntheticSimulator, emulator, measure

from doe.discrepancy import Discovery, Emulator, Measured, Outcomes, Point, Settings, Verdict, analyse
from doe.discrepancy.analysis import DOUBTED
from doe.errors import RuleError

ALONE = ("twin",)
"""Mechanisms left out of a library without the one that acts like another."""
TWINS = ("gamma", "epsilon", "zeta")
FEW = (*TWINS, "twin")
"""Mechanisms left out of small libraries, with few pairs to try."""


@cache
def _without(names: tuple[str, ...]) -> Emulator:
    """Return the emulator of a smaller library."""
    return emulator().without(*names)


def _run(
    measured: Measured,
    known: Emulator | None = None,
    is_lost: Callable[[int, Point], bool] = lambda *_: False,
    settings: Settings = SETTINGS,
) -> tuple[Discovery, list[list[Point]]]:
    """Drive an analysis; lost cases, given by their number in the batch and their point, have no values."""
    waves, simulator = [], SyntheticSimulator(synthetic_world.space())
    analysis = analyse(measured, known or _without(ALONE), settings, seed=5)
    try:
        points = next(analysis)
        while True:
            waves.append(points)
            values = simulator(points).values
            lost = [is_lost(i, point) for i, point in enumerate(points)]
            values[lost] = np.nan
            points = analysis.send(Outcomes(values, tuple("lost" if one else "" for one in lost)))
    except StopIteration as end:
        return end.value, waves


@cache
def _named() -> tuple[Discovery, list[list[Point]]]:
    return _run(measure({"delta": 0.6}, 3))


@cache
def _tied() -> tuple[Discovery, list[list[Point]]]:
    return _run(measure({"alpha": 0.4}, 4), _without(TWINS))


def test_a_complete_model_lacks_nothing_and_costs_no_run() -> None:
    found, waves = _run(measure({}, 3))
    assert found.verdict == Verdict.NONE
    assert found.named == ()
    assert waves == []


def test_a_hidden_mechanism_is_named_with_its_size() -> None:
    found, _ = _named()
    assert found.verdict == Verdict.NAMED
    assert "times as likely with it as with the next, " in found.reason
    assert found.named == ("delta",)
    assert found.chosen is not None
    size = found.chosen.sizes[0]
    assert size.low <= size.value <= size.high
    # Five standard errors, of which the 90 % interval is 3.3 wide.
    assert size.value == pytest.approx(0.6, abs=5.0 / 3.3 * (size.high - size.low))


def test_the_numbers_of_an_analysis_stay() -> None:
    # Since a shift of the emulator counts once (ends of the size).
    # Rounding differs from host to host.
    found, _ = _named()
    assert found.base is not None
    assert found.chosen is not None
    assert found.gap is not None
    [size] = found.chosen.sizes
    numbers = [found.base.q, found.gap.largest_drop, found.chosen.q, size.low, size.value, size.high]
    kept = [692.6009652, 641.7252556, 60.68236894, 0.5907007813, 0.6336603656, 0.6765640129]
    np.testing.assert_allclose(numbers, kept, rtol=1e-6)
    gaps = [q for both in found.before_after for q in (both.before.value, both.after.value)]
    np.testing.assert_allclose(gaps, [478.4685093, 38.77615459, 33.32385673, 7.278578896], rtol=1e-6)
    detectable = [power.detectable_size for power in found.power]
    np.testing.assert_allclose(detectable, [0.05, 0.17, 0.19, 0.1, 0.16, 0.17], rtol=1e-12)
    assert found.effort.fresh_cases == 140


def test_the_gap_shrinks_on_conditions_that_took_no_part() -> None:
    found, waves = _named()
    training, held_out = found.before_after
    assert (training.held_out, held_out.held_out) == (False, True)
    for side in (training, held_out):
        assert side.runs == SETTINGS.direct_runs
        assert side.before.value > side.after.high
        assert side.removed.value > 0.8
    assert len(waves[-1]) == 2 * SETTINGS.direct_runs * len(CONDITIONS)


def test_every_case_of_an_analysis_has_its_own_seed() -> None:
    _, waves = _named()
    seeds = [point.seed for wave in waves for point in wave]
    assert len(set(seeds)) == len(seeds)
    assert {point.condition for point in waves[0]} == set(CONDITIONS)


def test_mechanisms_that_act_alike_are_a_tie_with_an_experiment_to_follow() -> None:
    found, _ = _tied()
    assert found.verdict == Verdict.TIE
    assert set(found.named) == {"alpha", "twin"}
    assert found.next_experiment is not None
    assert set(found.next_experiment.separates) == {"alpha", "twin"}
    # one part in a hundred apart: no number of heaps of these conditions tells them
    assert not found.next_experiment.settles
    assert found.next_experiment.conditions == found.data.conditions
    assert found.next_experiment.replicates == 8 * int(found.data.replicates.max())


def test_a_tie_is_settled_without_a_mechanism_that_can_be_taken_away() -> None:
    # alpha is the truth: without the twin it is seen as before, and without both nothing is
    known = _without(TWINS)
    mechanisms = tuple(replace(one, removal="x" * (one.name == "twin")) for one in known.space.mechanisms)
    able = replace(known, space=replace(known.space, mechanisms=mechanisms))
    step = _run(measure({"alpha": 0.4}, 4), able)[0].next_experiment
    assert step
    assert (step.without, step.separates, step.settles) == ("twin", ("twin", "alpha"), True)
    for truth, is_missing in (({"alpha": 0.4}, True), ({}, False)):
        again = measure(truth, 7, replicates=step.replicates, conditions=step.conditions)
        assert (_run(again, known)[0].verdict is not Verdict.NONE) is is_missing


def test_a_leader_runs_at_last_against_what_might_overtake_it() -> None:
    _, waves = _tied()
    one_model = SETTINGS.finish_points * SETTINGS.refinement_repeats * len(CONDITIONS)
    of_singles = [wave for wave in waves[:-1] if all(len(point.sizes) < 2 for point in wave)]
    assert {tuple(name for name, _ in point.sizes) for point in of_singles[-1]} == {("alpha",), ("twin",)}
    assert len(of_singles[-1]) == 2 * one_model
    # Nothing is like delta.
    _, waves = _named()
    assert all(len(wave) < one_model for wave in waves[1:])


def test_twins_of_the_best_pair_are_tried_though_nothing_promises_them() -> None:
    one_pair = replace(SETTINGS, pair_candidates=1)
    found, _ = _run(measure({"alpha": 0.6, "delta": 0.8}, 5), _without(TWINS), settings=one_pair)
    tried = {one.mechanisms: one.simulated for one in found.candidates if len(one.mechanisms) > 1}
    # alpha and its twin are one part in a hundred apart: delta stands out, neither pair does
    assert tried.keys() >= {("alpha", "delta"), ("delta", "twin")}
    assert tried["alpha", "delta"]
    assert tried["delta", "twin"]
    assert found.verdict is Verdict.UNKNOWN
    assert found.reason.endswith("delta is in all of them")


def test_a_pair_is_named_in_place_of_one_effect_that_fits_and_is_far_behind() -> None:
    known = emulator((*BLENDED, "epsilon", "blend"))
    found, _ = _run(measure(dict.fromkeys(BLENDED, 0.8), 7), known)
    assert set(found.named) == set(BLENDED)
    alone = next(one for one in found.candidates if one.mechanisms == ("blend",))
    assert alone.admitted
    assert SETTINGS.fit_level < alone.p_value < DOUBTED


def test_one_effect_keeps_its_name_where_no_pair_is_far_ahead_of_it() -> None:
    found, _ = _run(measure({"blend": 0.8}, 15), emulator((*BLENDED, "epsilon", "blend")))
    assert found.chosen is not None
    assert found.chosen.p_value < DOUBTED
    assert BLENDED in [candidate.mechanisms for candidate in found.candidates]
    assert found.named == ("blend",)


def test_a_pair_that_cannot_be_simulated_is_not_named() -> None:
    # What explains the data, but is refused by the study: the emulator alone shall not speak for it.
    found, waves = _run(
        measure({"alpha": 0.6, "delta": 0.8}, 5),
        _without(FEW),
        is_lost=lambda _, point: dict(point.sizes).keys() == {"alpha", "delta"},
    )
    assert any(dict(point.sizes).keys() == {"alpha", "delta"} for wave in waves for point in wave)
    assert ("alpha", "delta") not in [candidate.mechanisms for candidate in found.candidates]
    assert found.verdict == Verdict.UNKNOWN


def test_what_the_library_lacks_is_unknown() -> None:
    found, waves = _run(measure({"outsider": 2.0}, 6), _without(FEW))
    assert found.verdict == Verdict.UNKNOWN
    assert found.named == ()
    assert found.before_after == ()
    assert all(not candidate.admitted for candidate in found.candidates)
    # one closest model in the map, the table and the verdict, and it was run
    assert found.closest is not None
    assert found.closest.mechanisms == found.candidates[0].mechanisms
    assert found.candidates[0].simulated
    assert found.reason.startswith(" with ".join(found.closest.mechanisms))
    # both of any two models are refused: nothing is to be distinguished
    assert found.next_experiment is None
    one_model = SETTINGS.refinement_points * SETTINGS.refinement_repeats * len(CONDITIONS)
    # No mechanism of the library, and not the base, comes near: the best is run to be sure, no other is.
    assert len(waves[0]) == one_model
    # So it goes with the singles of every round, and with the pairs.
    assert sum(map(len, waves)) <= 2 * SETTINGS.refinement_rounds * one_model


def test_a_forecast_that_fails_is_a_gap_though_the_fit_is_good() -> None:
    whole = measure({}, 3)
    values = dict(whole.values)
    values["fast-wide"] = values["fast-wide"] + 1.5 * values["fast-wide"].std(axis=0)
    found, _ = _run(Measured(CONDITIONS, OBSERVABLES, values), _without(FEW))
    assert found.verdict == Verdict.UNKNOWN
    assert found.gap is not None
    assert found.gap.found


def test_one_angle_a_condition_cannot_tell_a_mechanism_from_friction() -> None:
    found, _ = _run(measure({"delta": 1.0}, 3).only(["flank_angle"]))
    assert found.verdict == Verdict.NOT_IDENTIFIABLE
    assert "4 measured means, 3 factors" in found.reason


def test_without_a_held_out_condition_nothing_is_named() -> None:
    found, _ = _run(measure({"delta": 0.6}, 3, conditions=CONDITIONS[:4]), _without(FEW))
    assert found.verdict == Verdict.UNKNOWN
    assert "no held-out condition was measured" in found.reason
    assert "condition fast-wide was not measured" in found.notes


def test_one_replicate_a_condition_is_enough_for_a_verdict() -> None:
    found, _ = _run(measure({}, 8, replicates=1))
    assert found.verdict == Verdict.NONE


def test_an_observable_without_variance_and_lost_replicates_are_no_crash() -> None:
    whole = measure({}, 9)
    values = {name: rows.copy() for name, rows in whole.values.items()}
    values["base"][:, 2] = values["base"][:, 2].mean()
    values["wide"][0] = np.nan
    values["fast"][:] = np.nan
    reasons = {"wide": ("lost", "", "", "", ""), "fast": ("lost",) * 5}
    found, _ = _run(Measured(CONDITIONS, OBSERVABLES, values, reasons))
    assert found.verdict == Verdict.NONE
    assert "condition fast has no value to compare: left out" in found.notes
    assert found.data.replicates[CONDITIONS.index("wide")].max() == 4


def test_nothing_but_lost_replicates_is_a_verdict_with_its_reason() -> None:
    whole = measure({}, 9)
    values = {name: np.full_like(rows, np.nan) for name, rows in whole.values.items()}
    reasons = {name: ("lost",) * len(rows) for name, rows in whole.values.items()}
    found, _ = _run(Measured(CONDITIONS, OBSERVABLES, values, reasons))
    assert found.verdict == Verdict.NOT_IDENTIFIABLE
    assert found.reason == "no training condition has a value to compare"


def test_replicates_that_scatter_too_much_widen_the_error_instead_of_an_alarm() -> None:
    found, _ = _run(measure({}, 10, noise=4.0))
    assert found.verdict == Verdict.NONE
    assert any("scatter 4." in note or "scatter 3." in note for note in found.notes)


def test_fresh_runs_that_fail_are_counted_and_left_out() -> None:
    found, _ = _run(measure({"delta": 0.6}, 3), _without(FEW), is_lost=lambda i, _: i < 7)
    assert found.named == ("delta",)
    assert any("fresh runs failed" in note for note in found.notes)


def test_what_is_declared_unresolvable_is_never_named() -> None:
    others = tuple(name for name in _without(FEW).space.names if name != "delta")
    found, _ = _run(measure({"delta": 0.6}, 3), _without(FEW), settings=replace(SETTINGS, resolvable=others))
    assert found.verdict == Verdict.UNKNOWN
    assert "delta" in found.reason


def test_a_wave_needs_an_outcome_for_every_point() -> None:
    analysis = analyse(measure({"delta": 0.6}, 3), _without(ALONE), SETTINGS, seed=5)
    next(analysis)
    with pytest.raises(RuleError, match="must have one for each of"):
        analysis.send(Outcomes(np.zeros((1, len(OBSERVABLES))), ("",)))
