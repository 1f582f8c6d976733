"""Blind trials: what is hidden stays hidden, waves find their way home, and the score counts what it says."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
import synthetic_world as synthetic
from discoveries import made_discovery

from doe import discrepancy
from doe.design.factors import Factor
from doe.discrepancy.contest.power import CODED_SIZES
from experiments.evidence.trials import analyses, truth
from experiments.evidence.trials.declaration import (
    Declaration,
    declared_effect,
    declared_effects,
    read_declaration,
    with_names,
)
from experiments.evidence.trials.findings import EVERYTHING, PHOTOGRAPHS, Crash, read_findings
from experiments.evidence.trials.trial_heaps import cases_of
from experiments.evidence.trials.trials_folder import Folder
from experiments.evidence.trials.truths import Declared, Plan, draw
from experiments.io.errors import InputError

FACTORS = (Factor("mu", 0.2, 0.6), Factor("e", 0.1, 0.5))
LIBRARY = (
    Declared("cohesion", null=0.0, maximum=10.0, detectable=2.0, kin=("bridges",)),
    Declared("bridges", null=0.0, maximum=4.0, detectable=1.0, kin=("cohesion",)),
    Declared("spread", null=0.05, maximum=0.3, detectable=0.05),
    Declared("drag", null=0.0, maximum=1.0, detectable=0.9),
    Declared("twist", null=0.0, maximum=1.0),
)
OUTSIDE = (Declared("swollen", null=1.0, maximum=1.3),)
PLAN = Plan(nulls=3, strong=2, weak=2, unresolved=2, withheld=2, outside=2, pairs=6)


def draw_trials(seed: int = 1, plan: Plan = PLAN) -> tuple[tuple[truth.Label, truth.Sealed], ...]:
    return draw(plan, FACTORS, LIBRARY, OUTSIDE, np.random.default_rng(seed), lambda: "salt")


def test_a_plan_may_hide_some_of_the_library_only() -> None:
    trials = draw_trials(plan=replace(PLAN, mechanisms=["cohesion", "spread"]))
    hidden = {name for label, _ in trials if label.kind != truth.Kind.OUTSIDE for name, _ in label.sizes}
    assert hidden == {"cohesion", "spread"}
    with pytest.raises(InputError, match="mechanisms of the library"):
        draw_trials(plan=replace(PLAN, mechanisms=["cohesoin"]))


def test_every_kind_of_trial_is_drawn_as_planned() -> None:
    kinds = [label.kind for label, _ in draw_trials()]
    # Three mechanisms are resolvable (cohesion, bridges, spread), two are not.
    expected = {
        truth.Kind.NULL: 3,
        truth.Kind.SINGLE: 3 * 4,
        truth.Kind.UNRESOLVED: 2 * 2,
        truth.Kind.WITHHELD: 3 * 2,
        truth.Kind.OUTSIDE: 2,
        truth.Kind.PAIR: 6,
    }
    assert {kind: kinds.count(kind) for kind in truth.Kind} == expected


def test_truths_lie_in_their_ranges() -> None:
    effects = {effect.name: effect for effect in (*LIBRARY, *OUTSIDE)}
    for label, _ in draw_trials():
        assert all(f.low <= value <= f.high for f, value in zip(FACTORS, label.theta, strict=True))
        for name, size in label.sizes:
            low, high = sorted((effects[name].null, effects[name].maximum))
            assert low <= size <= high


def test_a_withheld_mechanism_goes_with_its_like_and_pairs_are_never_alike() -> None:
    for label, sealed in draw_trials():
        if label.kind is truth.Kind.WITHHELD:
            assert set(label.mechanisms) <= set(sealed.withheld)
            assert ("bridges" in sealed.withheld) == (label.mechanisms[0] in ("cohesion", "bridges"))
        else:
            assert sealed.withheld == ()
        assert set(label.mechanisms) != {"cohesion", "bridges"}


def test_the_name_of_a_trial_says_nothing_of_its_kind() -> None:
    # Over many draws the first trial of the part is a null as often as nulls are in the part: 3 of 19. With
    # 200 draws the count has a standard deviation of 5, and four of these are allowed.
    first = [draw_trials(seed)[0][0].kind is truth.Kind.NULL for seed in range(200)]
    assert abs(sum(first) - 200 * 3 / 19) < 21


def test_labels_are_held_to_their_seals(tmp_path: Path) -> None:
    labels, sealed = zip(*draw_trials(), strict=True)
    truth.write_labels(tmp_path / "labels.json", labels)
    truth.write_sealed(tmp_path / "sealed.csv", sealed)
    opened = truth.revealed(
        truth.read_labels(tmp_path / "labels.json"), truth.read_sealed(tmp_path / "sealed.csv")
    )
    assert tuple(opened.values()) == labels

    bent = [replace(labels[0], theta=(0.3, 0.3)), *labels[1:]]
    with pytest.raises(InputError, match=rf"{labels[0].trial}: a label must have the hash"):
        truth.revealed(bent, sealed)
    with pytest.raises(InputError, match="the sealed trial has no label"):
        truth.revealed(labels[1:], sealed)


def test_pairs_need_partners() -> None:
    with pytest.raises(InputError, match=r"Plan.pairs: pairs need two resolvable mechanisms"):
        draw(PLAN, FACTORS, LIBRARY[:2], (), np.random.default_rng(1), str)
    with pytest.raises(InputError, match=r"Plan.replicates: is at least 2"):
        Plan(replicates=1)
    with pytest.raises(InputError, match=r"Plan.view: must be one of everything, outlined, photographs"):
        Plan(view="everthing")


def test_cases_of_a_trial_have_seeds_of_their_own() -> None:
    label = draw_trials()[0][0]
    points = cases_of(label, ("base", "fast"), replicates=8)
    assert [point.condition for point in points] == ["base"] * 8 + ["fast"] * 8
    assert len({point.seed for point in points}) == 16
    assert points == cases_of(label, ("base", "fast"), replicates=8)


@dataclass
class Echo:
    """A simulator that gives back the parameters of a point, and counts its calls."""

    observables: tuple[str, ...] = ("first", "seed")
    calls: int = 0

    def __call__(self, points: Sequence[discrepancy.Point]) -> discrepancy.Outcomes:
        self.calls += 1
        values = np.array([[point.theta[0], point.seed] for point in points], dtype=float)
        return discrepancy.Outcomes(values, ("",) * len(points))


def counting(name: str) -> discrepancy.Analysis:
    """Return an analysis of as many waves as its name says; its reason is what it was sent."""
    number = int(name)
    if number == 0:
        raise ValueError("no waves")
    received = []
    for wave in range(number):
        outcomes = yield [discrepancy.Point((float(number),), (), "base", seed) for seed in range(wave + 1)]
        received.append(np.asarray(outcomes.values).tolist())
    return ended(str(received))


def ended(reason: str) -> discrepancy.Discovery:
    return replace(made_discovery(discrepancy.Verdict.NONE), reason=reason)


def expected_reason(number: int) -> str:
    return str([[[float(number), float(seed)] for seed in range(wave + 1)] for wave in range(number)])


@pytest.mark.parametrize("where", ["here", "processes"])
def test_batches_of_many_analyses_run_in_one_call(where: str) -> None:
    simulator, names = Echo(), ["3", "1", "0", "2"]
    if where == "here":
        rounds = list(analyses.in_step(names, analyses.Analyses(counting), simulator))
    else:
        with analyses.analysis_processes(counting, workers=2) as advance:
            rounds = list(analyses.in_step(names, advance, simulator))
    assert simulator.calls == 3
    assert [(turn.running, turn.cases) for turn in rounds] == [(3, 3), (2, 4), (1, 3), (0, 0)]
    found = {name: end for turn in rounds for name, end in turn.ended.items()}
    assert isinstance(found["0"], Crash)
    assert found["0"].traceback.endswith("ValueError: no waves\n")
    for name in ("1", "2", "3"):
        assert isinstance(found[name], discrepancy.Discovery)
        assert found[name].reason == expected_reason(int(name))


def test_a_batch_after_the_deadline_is_not_begun() -> None:
    points = [discrepancy.Point((float(i),), (("b" if i % 2 else "a", 1.0),), "base", i) for i in range(10)]
    echo = Echo()
    outcomes = analyses.TimedSimulator(echo, deadline=math.inf, batch=4)(points)
    assert echo.calls == 3
    np.testing.assert_array_equal(outcomes.values[:, 0], np.arange(10.0))
    with pytest.raises(analyses.OutOfTime):
        analyses.TimedSimulator(echo, deadline=-math.inf)(points)
    assert echo.calls == 3


def test_effects_are_declared_from_larger_sizes_on_where_a_scale_may_be_off() -> None:
    known, settings = synthetic.emulator(), discrepancy.Settings()
    scale = dict.fromkeys(synthetic.OBSERVABLES, discrepancy.Calibration(scale=0.1, instrument="ruler"))
    sizes = {
        off: np.array([one.detectable for one in declared_effects(known, settings, 8, calibration=allowed)])
        for off, allowed in ((False, None), (True, scale))
    }
    assert (sizes[True] >= sizes[False]).all()
    assert (sizes[True] > 1.02 * sizes[False]).any()


def test_what_is_declared_comes_back_with_its_hash(tmp_path: Path) -> None:
    settings = discrepancy.Settings(draws=500)
    library = declared_effects(synthetic.emulator(), settings, replicates=8)
    # The synthetic world has a mechanism and its twin, which no data tell apart.
    assert {effect.name for effect in library if not effect.resolvable} == {"alpha", "twin"}
    assert {effect.name: effect.kin for effect in library if effect.kin} == {
        "alpha": ("twin",),
        "twin": ("alpha",),
    }
    settings = with_names(settings, library)
    assert settings.resolvable == ("beta", "gamma", "delta", "epsilon", "zeta")
    declaration = Declaration("Grain", "bench", "2026-01-01", PLAN, settings, library, OUTSIDE)
    path = tmp_path / "declared.json"
    declaration.write(path)
    assert read_declaration(path) == declaration
    path.write_text(
        path.read_text(encoding="utf-8").replace('"draws": 500', '"draws": 501'), encoding="utf-8"
    )
    with pytest.raises(InputError, match="settings must have the hash"):
        read_declaration(path)


def test_a_mechanism_that_shows_in_a_part_of_the_ranges_only_may_not_be_named() -> None:
    settings, span = discrepancy.Settings(), discrepancy.MechanismRange("glue", 1.0, 3.0)
    shown = np.tile(CODED_SIZES >= 0.25, (20, 1)).astype(float)
    everywhere = declared_effect(span, shown, settings)
    assert everywhere.detectable == pytest.approx(0.5)
    assert everywhere.resolvable
    shown[:3] = 0.0
    mostly = declared_effect(span, shown, settings)
    assert mostly.detectable == pytest.approx(0.5)
    assert not mostly.resolvable


def test_trials_of_a_known_world_end_as_they_should(tmp_path: Path) -> None:
    """Nothing hidden, a mechanism, the same withheld, and the same by photographs alone, in step."""
    hidden: dict[str, dict[str, float]] = {
        "alone-001": {},
        "alone-002": {"beta": 1.0},
        "outside-001": {"beta": 1.0},
    }
    begin = analyses.TrialAnalyses(
        synthetic.emulator(),
        discrepancy.Settings(draws=500, resolvable=("beta", "gamma")),
        {
            trial: synthetic.measure(sizes, seed, replicates=8)
            for seed, (trial, sizes) in enumerate(hidden.items())
        },
        {"alone-001": (), "alone-002": (), "outside-001": ("beta",)},
    )
    simulator = synthetic.SyntheticSimulator(synthetic.space())
    folder = Folder(tmp_path)
    jobs = [analyses.analysis_name(trial, EVERYTHING) for trial in hidden] + [
        analyses.analysis_name("alone-002", PHOTOGRAPHS)
    ]
    for turn in analyses.in_step(jobs, analyses.Analyses(begin), simulator):
        analyses.keep(folder, turn.ended)
    found = read_findings([folder.findings]).set_index(["trial", "view"])
    assert found["verdict"].to_dict() == {
        ("alone-001", EVERYTHING): "none",
        ("alone-002", EVERYTHING): "named",
        ("outside-001", EVERYTHING): "unknown",
        ("alone-002", PHOTOGRAPHS): "named",
    }
    named = found.loc[("alone-002", EVERYTHING)]
    assert named["named"] == "beta"
    assert named["size_low"] < 1.0 < named["size_high"]
    assert all(folder.discovery(job).is_file() for job in jobs)
