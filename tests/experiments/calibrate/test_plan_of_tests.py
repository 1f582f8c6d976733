"""The choice of tests: information adds up, small tests buy nothing, and pairs are the best of all."""

from dataclasses import replace
from itertools import product

import numpy as np
import pandas as pd
import pytest

from doe import Design, Factor, FactorSurface, Sample, Surface, central_composite, fit_surface
from experiments.calibrate.plan.choice import Choice, TestPlan, make_plan
from experiments.calibrate.plan.knowledge import Knowledge, Size, Variant
from experiments.calibrate.plan.present import EXACT, Key, Known, Present, fit_responses
from experiments.studyfile.campaign import OptimumSettings, Response, SurfaceSettings
from experiments.studyfile.candidate_section import Candidate, Error, Reading

FACTORS = (Factor("E", 0.3, 0.6), Factor("F", 0.2, 0.4), Factor("G", 0.02, 0.08))
ANGLE, DENSITY = Response("angle", "angle", "deg"), Response("density", "solid_fraction")
FLOW = Response("bin_flow_rate", "flow_rate", "kg/s", "bin")

PLANES = {
    "angle": (28.0, 2.0, 5.0, 1.5, 0.5),
    "solid_fraction": (0.55, -0.012, 0.003, -0.008, 0.001),
    "flow_rate": (0.05, -0.002, 0.0, -0.006, 0.0005),
}
"""Constant, slopes over the coded factors and noise of a case, by observable."""


def simulated(design: Design, *responses: Response, seed: int = 1, bend: float = 0.0) -> pd.DataFrame:
    rng, x = np.random.default_rng(seed), design.coded.to_numpy()
    rows = {}
    for response in responses:
        constant, *slopes, noise = PLANES[response.observable]
        values = constant + x @ slopes + bend * x.prod(axis=1) + noise * rng.standard_normal(len(x))
        table = rows.setdefault(response.scene, pd.DataFrame({"run": design.coded.index, "replicate": 1}))
        table[response.observable] = values
    tables = [table.assign(scene=scene, status="finished", reason="") for scene, table in rows.items()]
    return pd.concat(tables, ignore_index=True)


def of_scene(
    response: Response, share: float, repeats: tuple[int, ...] = (3, 10), common: float = 0.002
) -> Candidate:
    reading = Reading(response, Error(share), Error(common), Error(0.01))
    return Candidate(response.scene, response.scene, "", (reading,), repeats, (10.0, 2.0), (), ())


def of_factor(name: str, sd: float, model: float = 0.01) -> Candidate:
    errors = (Error(sd, False), Error(0.0, False), Error(model, False))
    reading = Reading(Response(f"{name}_sledge", name, "1", ""), *errors)
    return Candidate(f"sledge of {name}", "", name, (reading,), (3, 10), (10.0, 2.0), (), ())


DESIGN, SETTINGS = central_composite(FACTORS, "face", 5), SurfaceSettings()
Surfaces = dict[Key, Surface]


@pytest.fixture(scope="module")
def surfaces() -> Surfaces:
    responses = (ANGLE, DENSITY, FLOW)
    return fit_responses(DESIGN, simulated(DESIGN, *responses), responses, SETTINGS)[0]


@pytest.fixture(scope="module")
def present(surfaces: Surfaces) -> Present:
    return Present.of(
        FACTORS, {("target", "angle"): Known(surfaces["target", "angle"], Sample(29.0, 0.6, 5))}
    )


def plan(present: Present, surfaces: Surfaces, *candidates: Candidate, **sizes: tuple[Size, ...]) -> TestPlan:
    return make_plan(present, surfaces, {}, candidates, sizes, OptimumSettings())


def test_settings_are_drawn_where_the_measurements_agree(present: Present, surfaces: Surfaces) -> None:
    assert 0.05 < present.share < 0.4
    mean, se = surfaces["target", "angle"].evaluate(present.truths)
    # the rule of the region: Student's t with 4 degrees of freedom bounds the factor, and a cell its edge
    assert np.abs(mean - 29.0).max() < 2.8 * np.hypot(se, 0.6 / 5**0.5).max() + 0.3
    free = (-np.inf, np.inf)
    box = present.box({"E": free, "F": (0.25, 1.0), "G": free})
    assert all(
        whole.low <= part.low < part.high <= whole.high * 1.001
        for whole, part in zip(FACTORS, box, strict=True)
    )
    assert box[1].low == 0.25


def test_nothing_agrees_is_said_and_the_whole_box_counts(surfaces: Surfaces) -> None:
    angle = surfaces["target", "angle"]
    known = {("target", "angle"): Known(angle, Sample(50.0, 0.6, 5))}
    far = Present.of(FACTORS, known)
    assert far.share == 0.0
    assert "No setting agrees" in plan(far, surfaces, of_factor("F", 0.02)).notes[0]


def test_a_reading_alone_has_the_width_of_its_errors() -> None:
    present = Present.of(FACTORS, {})
    knowledge = Knowledge(present, {("", "F"): FactorSurface(DESIGN, "F")})
    added = knowledge.added(of_factor("F", 0.03, 0.01), 9, 1.0)
    half = knowledge.relative(knowledge.base + added) * present.natural
    # errors .03 / 3 and .01 of the reading, .2 / sqrt(12) of the box, in parallel
    wanted = 1.959964 / np.sqrt(1.0 / (0.01**2 + 0.01**2) + 12.0 / 0.2**2)
    assert half[:, 1] == pytest.approx(wanted)
    assert half[:, 0] == pytest.approx(1.959964 * 0.3 / np.sqrt(12.0))


def test_a_response_measured_a_few_times_has_the_width_of_students_t() -> None:
    surface = FactorSurface(DESIGN, "F")  # a reading of the factor, without an error of its own
    present = Present.of(FACTORS, {})
    for n, student in ((3, 4.302653), (5, 2.776445), (10**6, 1.959964)):
        known = {("", "F"): Known(surface, Sample(0.27, 0.02, n), EXACT)}
        knowledge = Knowledge(replace(present, known=known), {})
        # Student's t of n - 1 in place of 1.96 deviations, and .2 / sqrt(12) of the box in parallel
        wanted = 1.0 / np.hypot(1.0 / (student * 0.02 / n**0.5), 12.0**0.5 / (1.959964 * 0.2))
        half = knowledge.relative(knowledge.base)[:, 1] * present.natural[:, 1]
        assert half == pytest.approx(wanted, rel=1e-4)


def test_more_repeats_and_larger_tests_tell_more_up_to_what_they_share(
    present: Present, surfaces: Surfaces
) -> None:
    knowledge = Knowledge(present, surfaces)
    widths = {
        (repeats, growth): float(
            knowledge.promised(knowledge.base + knowledge.added(of_scene(FLOW, 0.08), repeats, growth)).max()
        )
        for repeats, growth in product((1, 10, 10**9), (1.0, 4.0, 1e9))
    }
    assert widths[1, 1.0] > widths[10, 1.0] > widths[10, 4.0] > widths[10, 1e9]
    assert widths[1, 4.0] < widths[1, 1.0]
    assert widths[10**9, 1e9] == pytest.approx(widths[1, 1e9], rel=1e-3)  # common and model errors stay
    assert widths[10**9, 1e9] > 0.0


def test_repeats_of_what_is_known_share_its_model(present: Present, surfaces: Surfaces) -> None:
    knowledge = Knowledge(present, surfaces)
    again = knowledge.base + knowledge.added(of_scene(ANGLE, 0.02), 10**6, 1.0)
    exact = Known(surfaces["target", "angle"], Sample(29.0, 1e-6, 5))
    known = Knowledge(Present(FACTORS, 1.0, {("target", "angle"): exact}, present.truths, 1.0), {})
    # without its common error, which a known response has not, no number of repeats beats an exact one
    assert np.all(np.linalg.det(again) <= np.linalg.det(known.base) * (1.0 + 1e-6))
    assert np.all(np.linalg.det(again) >= np.linalg.det(knowledge.base))


def test_a_pair_is_the_best_of_all_and_more_tests_are_added_only_if_they_help(
    present: Present, surfaces: Surfaces
) -> None:
    candidates = [of_scene(FLOW, 0.02), of_scene(DENSITY, 0.005), of_factor("F", 0.02), of_factor("E", 0.04)]
    direct = {("", name): FactorSurface(DESIGN, name) for name in ("E", "F")}
    knowledge = Knowledge(present, {**surfaces, **direct})
    variants = [Variant(each, Size(), repeats) for each in candidates for repeats in each.repeats]
    choice = Choice(knowledge, variants)
    pairs = choice.pairs()
    best = min(float(choice.widths([pair])[0]) for pair in pairs)
    rows = choice.rows()
    widths = choice.widths(rows)
    assert 1 <= len(rows) <= 3
    assert list(widths) == sorted(widths, reverse=True)
    assert widths[-1] <= 1.05 * best
    minutes = [choice.minutes(row) for row in rows]
    assert minutes == sorted(minutes)
    for row in rows:
        groups = [choice.variants[v].candidate.name for v in row]
        assert len(set(groups)) == len(groups)


def test_of_30_studies_each_choice_is_within_a_tenth_of_the_best_pair() -> None:
    box = Present.of(FACTORS, {})
    direct = {("", name): FactorSurface(DESIGN, name) for name in ("E", "F", "G")}
    for seed in range(30):
        rng, x = np.random.default_rng(seed), DESIGN.coded.to_numpy()
        true = {(f"s{i}", "flow_rate"): 1.0 + x @ rng.normal(0.0, 0.06, 3) for i in range(5)}
        noisy, exact = (
            {k: fit_surface(DESIGN, v + rng.normal(0.0, sd, len(x))) for k, v in true.items()}
            for sd in (0.02, 1e-5)
        )
        noisy = {key: surface.reduce() for key, surface in noisy.items()}
        scenes = [replace(FLOW, name=scene, scene=scene) for scene, _ in true]
        candidates = [of_scene(one, sd) for one, sd in zip(scenes, rng.uniform(0.01, 0.08, 5), strict=True)]
        candidates += [of_factor("E", 0.05), of_factor("F", 0.03)]
        variants = [Variant(each, Size(), repeats) for each in candidates for repeats in each.repeats]
        judge = Choice(Knowledge(box, {**exact, **direct}), variants)
        chosen = plan(box, noisy, *candidates).chosen[-1]
        widths = judge.widths([tuple(map(variants.index, chosen)), *judge.pairs()])
        assert widths[0] <= 1.1 * widths[1:].min()


def test_the_answer_names_what_stays_open_and_what_is_left(present: Present, surfaces: Surfaces) -> None:
    found = plan(present, surfaces, of_factor("F", 0.02), of_factor("E", 0.03))
    assert found.table.index[0] == "nothing more"
    assert found.table["left"].iloc[0] == pytest.approx(100.0)
    assert found.table["left"].iloc[-1] < 60.0
    assert "G up" in found.table["open"].iloc[-1]
    assert found.sentence.startswith("Next test: ")
    assert found.table["F"].iloc[-1] < found.table["F"].iloc[0]


def test_a_test_that_is_too_small_is_named_with_the_size_that_would_do(
    present: Present, surfaces: Surfaces
) -> None:
    poor = of_scene(FLOW, 1.5)
    (said,) = plan(present, surfaces, poor, bin=(Size("", 1.0, 4000),)).notes
    assert said.startswith("bin buys nothing with 4,000 grains: ")
    assert "times as many" in said
    biased = of_scene(FLOW, 0.1, (3,), 9.0)
    (said,) = plan(present, surfaces, biased).notes
    assert "nor would a larger one" in said


def test_the_larger_size_is_taken_only_where_it_buys_something(present: Present, surfaces: Surfaces) -> None:
    sizes = (Size("", 1.0, 4000, 2e7, 3.0), Size("long", 20.0, 80000, 4e8, 60.0))
    noisy, exact = (plan(present, surfaces, of_scene(FLOW, share, (5,)), bin=sizes) for share in (0.2, 1e-4))
    assert noisy.table.index[-1] == "5 x bin (long)"
    assert exact.table.index[-1] == "5 x bin"
    assert exact.table["seconds"].iloc[-1] == 3.0


def test_a_response_that_no_quadratic_fits_is_not_judged(present: Present) -> None:
    cases = simulated(DESIGN, FLOW, DENSITY, bend=0.02)
    found, unjudged = fit_responses(DESIGN, cases, (FLOW, DENSITY), SETTINGS)
    assert ("bin", "flow_rate") not in found
    assert "lack of fit" in unjudged["bin_flow_rate"]
    candidates = (of_scene(FLOW, 0.02), of_factor("F", 0.02))
    chosen = make_plan(present, found, unjudged, candidates, {}, OptimumSettings())
    assert not any("bin" in tests for tests in chosen.table.index)
    assert any(
        note.startswith("Not judged: bin_flow_rate: a quadratic does not fit") for note in chosen.notes
    )


def test_failed_cases_are_the_reason_that_a_test_is_not_judged(present: Present) -> None:
    cases = simulated(DESIGN, FLOW)
    cases.loc[4:, ["status", "reason", "flow_rate"]] = "failed", "the outlet is clogged", np.nan
    found, unjudged = fit_responses(DESIGN, cases, (FLOW,), SETTINGS)
    assert "15 of 19 cases failed" in unjudged["bin_flow_rate"]
    assert plan(present, found, of_scene(FLOW, 0.02)).sentence.startswith("No candidate")
