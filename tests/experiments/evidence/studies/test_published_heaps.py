"""The paper's tables as data, and runs of its settings as a model of them: runs made up from closed forms."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd
import pytest

from doe.discrepancy import Discovery, Settings, Verdict
from experiments.evidence.studies.buckwheat.records.bases_disagreement import PAGE, disagreement_page
from experiments.evidence.studies.buckwheat.records.paper_record import FOLDER
from experiments.evidence.studies.buckwheat.records.published_heaps import (
    CENTRE,
    READING,
    base_q,
    concluded,
    physical_emulator,
    physical_heaps,
    published_heaps,
    published_settings,
    tables_emulator,
)
from experiments.evidence.studies.buckwheat.replay.replay import Replay
from experiments.evidence.studies.buckwheat.replay.runs import DESIGNS, planned_cases
from experiments.evidence.studies.buckwheat.sensitivity.sensitivities import Sensitivities
from experiments.studies.buckwheat import paper

NOISE = 0.6
"""Seed noise of a made-up heap [deg], as simulated ones have it."""

RULES = Settings(draws=1000)
"""The default rules, with shorter bootstraps."""

HALF = {factor.name: factor.half_range for factor in paper.factors()}
CENTER = {factor.name: factor.center for factor in paper.factors()}


def coded(cases: pd.DataFrame, name: str) -> pd.Series:
    return (cases[name] - CENTER[name]) / HALF[name]


def smooth(cases: pd.DataFrame) -> pd.Series:
    """Angles that follow a quadratic of the frictions and a line of everything else."""
    e, f = coded(cases, "E"), coded(cases, "F")
    return 27.0 + 2.0 * e + 7.0 * f - 1.5 * f**2 + 0.8 * e * f + 0.4 * e**2 + coded(cases, "G")


def replay(
    angle: Callable[[pd.DataFrame], Any], replicates: int = 1, noise: float = 0.0, seed: int = 0
) -> Replay:
    cases = planned_cases(replicates, DESIGNS)
    scatter = noise * np.random.default_rng(seed).standard_normal(len(cases))
    return Replay(cases.assign(status="finished", angle=angle(cases) + scatter))


def expected_variance(base: Replay, stage: str) -> float:
    """Variance of a heap, the mean of what it may be: its logarithm is known to 2 / df."""
    return float(base.heap_variance[stage] * np.exp(2.0 / base.noise([stage]).df))


def test_the_tables_are_31_runs_at_27_settings_with_table_6_held_out() -> None:
    heaps = published_heaps()
    assert len(heaps.conditions) == 12 + 6 + 9
    assert sum(heaps.finished_count(condition) for condition in heaps.conditions) == 31
    assert heaps.finished_count(CENTRE) == 5
    space = tables_emulator(replay(smooth, 2, NOISE), None).space
    held_out = [name for name, out in zip(space.conditions, space.held_out, strict=True) if out]
    assert held_out == [name for name in heaps.conditions if name.startswith("composite")]


def test_another_reading_moves_all_angles_alike() -> None:
    base = replay(smooth, 2, NOISE)
    emulator = tables_emulator(base, None)
    means = base.runs.set_index(["stage", "run"])["angle"]
    for run in (("screening", 3), ("climb", 6), ("composite", 8)):
        surfaces = emulator.surfaces[f"{run[0]}-{run[1]}"]
        read = surfaces.predict(np.array([[-0.4]]), ())[0, 0]
        assert read == pytest.approx(means[run] - 0.4 * READING, abs=1e-9)
        assert surfaces.error(np.array([-0.4]), ())[0, 0] == pytest.approx(
            expected_variance(base, run[0]) / 2.0
        )


def test_a_mechanism_runs_from_the_study_as_written_to_its_variant_with_the_noise_of_both() -> None:
    base = replay(smooth, 3, NOISE)
    found = Sensitivities(
        {
            "base": replay(smooth),
            "rolling-none": replay(lambda cases: smooth(cases) - 4.0 + coded(cases, "F")),
        },
        {},
    )
    emulator = tables_emulator(base, found)
    variance = expected_variance(base, "screening")
    mean = base.runs.set_index(["stage", "run"])["angle"]["screening", 4]
    surfaces = emulator.surfaces["screening-4"]
    for size in (0.0, 0.4, 1.0):
        x = np.array([0.0, size])
        expected = mean + size * (-4.0 + 1.0)  # F is high in this run
        assert surfaces.predict(x[None], ("rolling-none",))[0, 0] == pytest.approx(expected, abs=1e-9)
        # Three heaps of the base, one with and one without the mechanism.
        error = surfaces.error(x, ("rolling-none",))[0, 0]
        assert error == pytest.approx(variance * (1.0 / 3.0 + 2.0 * size**2), rel=1e-9)


def test_a_lost_run_of_a_variant_is_as_uncertain_as_the_others_differ() -> None:
    cases = planned_cases(1, DESIGNS)
    lost = (cases["stage"] == "screening") & (cases["run"] == 4)
    angles = (smooth(cases) - 4.0 + coded(cases, "F")).mask(lost)
    found = Sensitivities({"base": replay(smooth), "size-wide": Replay(cases.assign(angle=angles))}, {})
    emulator = tables_emulator(replay(smooth, 2, NOISE), found)
    addition = emulator.surfaces["screening-4"].additions["size-wide"]
    others = published_settings().drop_duplicates("condition").query("condition != 'screening-4'")
    shifts = -4.0 + coded(others, "F")
    assert addition.polynomial.coefficients[0, 0] == pytest.approx(shifts.mean(), rel=1e-9)
    assert addition.gram_inverse[0, 0] * addition.variance[0] == pytest.approx(shifts.var(), rel=1e-9)


def test_pictures_read_otherwise_and_checks_of_the_numerics_are_no_mechanisms() -> None:
    names = ("base", "fit-middle", "modulus-10", "size-wide")
    found = Sensitivities({name: replay(smooth) for name in names}, {})
    assert tables_emulator(replay(smooth, 2, NOISE), found).space.names == ("size-wide",)


def test_the_physical_test_is_one_number_with_the_published_moments() -> None:
    heaps, target = physical_heaps(), paper.measured()
    np.testing.assert_allclose(heaps.mean(CENTRE), [target.mean], rtol=1e-12)
    np.testing.assert_allclose(np.sqrt(heaps.covariance(CENTRE)), [[target.sd]], rtol=1e-12)
    assert heaps.finished_count(CENTRE) == target.n


def test_the_model_of_the_physical_test_is_the_surface_of_table_6() -> None:
    found = Sensitivities(
        {"base": replay(smooth), "rolling-none": replay(lambda cases: smooth(cases) + 2.0 + cases["E"])}, {}
    )
    emulator = physical_emulator(replay(smooth, 2, 1e-6), found)
    space = emulator.space
    assert (space.conditions, space.held_out, space.factors) == ((CENTRE,), (False,), ("E", "F"))
    coded_point = np.array([0.5, -1.0])
    natural = pd.DataFrame([dict(zip(space.factors, space.natural_theta(coded_point), strict=True), G=0.055)])
    surfaces = emulator.surfaces[CENTRE]
    # The fit is a quadratic, and so are the runs but for 1e-6 degrees; a mechanism adds its mean shift.
    bare = surfaces.predict(coded_point[None], ())[0, 0]
    assert bare == pytest.approx(float(smooth(natural).iloc[0]), abs=1e-4)
    with_it = surfaces.predict(np.append(coded_point, 1.0)[None], ("rolling-none",))[0, 0]
    settings = published_settings().query("stage == 'composite'").drop_duplicates("condition")
    assert with_it - bare == pytest.approx(2.0 + settings["E"].mean(), abs=1e-9)


def effect(cases: pd.DataFrame) -> pd.Series:
    """Share of an effect [deg]: most where the plate is rough, nothing like a shift of all angles."""
    return 8.0 * (cases["F"] - 0.1) * (cases["E"] > 0.4)


@pytest.fixture(scope="module")
def incomplete() -> tuple[Replay, Sensitivities]:
    """Runs that lack six tenths of an effect that EDEM has, and two variants: it, and a plain shift."""

    def lacking(cases: pd.DataFrame) -> pd.Series:
        return cases["published"] - 0.6 * effect(cases)

    variants = {
        "base": lacking,
        "clump-keeled": lambda cases: lacking(cases) + effect(cases),
        "size-equal": lambda cases: lacking(cases) - 1.0,
    }
    replays = {
        name: replay(angle, 3, NOISE, seed) for seed, (name, angle) in enumerate(variants.items(), start=1)
    }
    return replay(lacking, 3, NOISE, 9), Sensitivities(replays, {})


@pytest.fixture(scope="module")
def found(incomplete) -> Discovery:
    """Findings of the tables on those runs."""
    return concluded(published_heaps(), tables_emulator(*incomplete), RULES)


def test_an_effect_of_the_tables_is_named_and_the_measured_angle_can_name_none(incomplete, found) -> None:
    assert (found.verdict, found.named) == (Verdict.NAMED, ("clump-keeled",))
    assert found.chosen is not None
    [size] = found.chosen.sizes
    assert size.low < 0.6 < size.high
    physical = concluded(physical_heaps(), physical_emulator(*incomplete), RULES)
    assert (physical.verdict, physical.named) == (Verdict.NOT_IDENTIFIABLE, ())
    page = disagreement_page(found, physical, tables_emulator(*incomplete), RULES)
    assert "**Verdict: named.**" in page
    assert "**Verdict: not identifiable.** 1 measured mean" in page
    assert "nine spheres in a pyramid of hollow faces" in page


def test_the_noise_of_a_variant_lowers_every_q(incomplete, found) -> None:
    emulator = tables_emulator(*incomplete)
    assert found.base is not None
    at_sizes = [base_q(emulator, ["size-equal"], [size], RULES) for size in (0.0, 0.5, 1.0)]
    # The fit ends within some 1e-4 coded units of the optimum, where Q is flat.
    assert at_sizes[0] == pytest.approx(found.base.q, rel=1e-5)
    assert at_sizes == sorted(at_sizes, reverse=True)


def test_runs_that_agree_lack_nothing(incomplete) -> None:
    agreeing = replay(lambda cases: cases["published"], 3, NOISE, 3)
    found = concluded(published_heaps(), tables_emulator(agreeing, incomplete[1]), RULES)
    assert (found.verdict, found.candidates) == (Verdict.NONE, ())
    assert found.effort.fresh_cases == 0


def test_the_page_in_the_record_was_made_by_the_default_rules() -> None:
    assert Settings().sha256 in (FOLDER / PAGE).read_text(encoding="utf-8")
