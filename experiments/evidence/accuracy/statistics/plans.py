"""Plans of tests: do their widths hold for hidden settings, and is the choice near the best pair of all."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas as pd
from numpy.random import Generator
from numpy.typing import NDArray

from doe import FactorSurface, Goal, Sample, StatedValue, joint_fit
from doe.response.quadratic import FittedSurface
from experiments.calibrate.cases import plan_cases
from experiments.calibrate.plan.choice import Choice, make_plan
from experiments.calibrate.plan.knowledge import Knowledge, Size, Variant
from experiments.calibrate.plan.present import EXACT, Key, Known, Present, fit_responses
from experiments.evidence.accuracy.statistics.coverage import AT_LEAST, Figure, generator
from experiments.runs.planning import PreparedPlan, prepare_plan
from experiments.runs.request import RunRequest
from experiments.runs.run_folder import open_run
from experiments.studyfile import BUCKWHEAT, load_study
from experiments.studyfile.campaign import OptimumSettings

Cases = Callable[..., pd.DataFrame]
TWINS, ON_ENGINE, STUDIES, SCENES = 40, 10, 30, (2, 4, 6)  # twins of a case, on the engine; studies; scenes
HOPPER = {"hopper": {"diameter": "34 mm", "fill_depth": "18 mm", "outlet": "27 mm"}}
HEAP, KEPT = {"lifted-cylinder": {"grain_count": 150}}, {"selection": {"keep": ["E", "F", "G"]}}
FLOW = {"observables": ["flow_rate"], "repeats": [5], "sd": "5 %"}
TESTS = [{"test": name, "parameter": factor} for name, factor in (("sledge", "E"), ("incline", "F"))]


def prepared_plan(scenes: int, out: Path) -> PreparedPlan:
    """Prepare plans of buckwheat in small heaps, whose angle is measured, with some hoppers as candidates."""
    names = ["bin", *(f"bin_{i}" for i in range(1, scenes))]
    changes = {"scene": HEAP, "campaign": KEPT, "response-scene": dict.fromkeys(names, HOPPER)}
    first = {"test": "target", "observables": ["angle"]}
    changes["candidate"] = [first, *TESTS, *({"test": name, **FLOW} for name in names)]
    study = load_study(BUCKWHEAT.with_name("curve_to_point.toml"), "bench", changes)
    return prepare_plan(study, RunRequest(out=out, device="cpu", resume=out.exists()))


def emulated(rng: Generator, prepared: PreparedPlan) -> Cases:
    """Draw quadratic responses in place of the engine."""
    slopes, bends = rng.normal(0.0, 0.06, (9, 3)), rng.normal(0.0, 0.01, (9, 3, 3))
    noise, order = rng.uniform(0.005, 0.03, 9), [one.scene for one in prepared.responses]

    def cases(table: pd.DataFrame, _: str, part: float = 1.0) -> pd.DataFrame:
        i, stage = order.index(table["scene"].iloc[0]), table["stage"].iloc[0]
        x = np.column_stack([f.to_coded(table[f.name].to_numpy()) for f in prepared.design.factors])
        values = 1.0 + x @ slopes[i] + ((x @ bends[i]) * x).sum(axis=1)
        values += rng.normal(0.0, 0.05 if stage == "target" else part * noise[i], len(x))
        return table.assign(status="finished", reason="", angle=values, flow_rate=values)

    return cases


def surfaces(cases: Cases, prepared: PreparedPlan, **options: float) -> dict[Key, FittedSurface]:
    """Fit the surfaces of all scenes."""
    found = pd.concat([cases(table, title, **options) for title, table in prepared.tables.items()])
    settings = prepared.run.study.campaign.surface.model_copy(update={"lack_of_fit_alpha": 1e-9})
    return fit_responses(prepared.design, found, prepared.responses, settings)[0]


def held(rng: Generator, cases: Cases, prepared: PreparedPlan, number: int = 1) -> NDArray[np.bool_]:
    """Choose tests, measure a hidden setting, calibrate: are widths and values within what was promised."""
    study, design, (first, *others) = prepared.run.study, prepared.design, prepared.run.study.candidates
    hidden = {f.name: float(f.to_natural(rng.uniform(-1.0, 1.0))) for f in design.factors}

    def known(variant: Variant) -> tuple[Key, Known]:
        (reading,), factor, n = variant.candidate.readings, variant.candidate.factor, variant.repeats
        key = variant.candidate.scene, reading.response.observable
        errors = reading.sd.size / n**0.5, reading.common.size
        if not factor:
            table = plan_cases(study, "target", pd.DataFrame([hidden], [number]), n, [reading.response])
            sample = Sample.of(cases(table, "hidden")[key[1]].to_numpy())
            stated = StatedValue(sample.mean, sample.mean * float(np.hypot(*errors)))
            return key, Known(fits[key], sample if variant.candidate is first else stated, reading.model_sd)
        value, off = hidden[factor], rng.normal(0.0, [*errors, reading.model_sd.size]).sum()
        said = value * (1.0 + float(off))  # errors are shares of what is read: nobody knows the hidden value
        read = StatedValue(said, said * float(np.hypot(*errors)))
        return key, Known(FactorSurface(design, factor, reading.model_sd.size * said), read, EXACT)

    fits = surfaces(cases, prepared)
    present = Present.of(design.factors, dict([known(Variant(first, Size(), 5))]))
    plan = make_plan(present, fits, {}, others, {}, OptimumSettings())
    fits = surfaces(cases, prepared)
    found = {**present.known, **dict(map(known, plan.chosen[-1]))}
    joint = joint_fit({" ".join(k): Goal(v.surface, v.measured) for k, v in found.items()}, resolution=15)
    after = Knowledge(replace(present, known=found, truths=joint.coded_point[None]), {})
    promised = plan.table[list(hidden)].iloc[-1].to_numpy() / 100.0
    off = np.abs(after.present.natural[0] / list(hidden.values()) - 1.0)
    return np.array([after.relative(after.base)[0] <= promised, off <= promised])


def is_near_best(rng: Generator, prepared: PreparedPlan) -> bool:
    """Choose by noisy surfaces: is that within a tenth of the best pair of all by surfaces without noise."""
    cases, design, (_, *others) = emulated(rng, prepared), prepared.design, prepared.run.study.candidates
    box, direct = Present.of(design.factors, {}), {("", f): FactorSurface(design, f) for f in design.names}
    chosen = make_plan(box, surfaces(cases, prepared), {}, others, {}, OptimumSettings()).chosen[-1]
    exact = Knowledge(box, {**surfaces(cases, prepared, part=1e-3), **direct})
    judge = Choice(exact, [Variant(each, Size(), n) for each in others for n in each.repeats])
    widths = judge.widths([tuple(map(judge.variants.index, chosen)), *judge.pairs()])
    return bool(widths[0] <= 1.1 * widths[1:].min())


def figures(case: str, found: list[NDArray[np.bool_]]) -> Iterator[Figure]:
    """Yield the shares of twins whose widths and values held."""
    for what, each in zip(("plan, width", "plan, hidden value"), np.mean(found, axis=2).T, strict=True):
        yield Figure(what, case, 0.8, AT_LEAST, float(each.mean()), len(found), float(each.std()))


def plans(folder: Path | None = None) -> Iterator[Figure]:
    """Yield what plans promise on twins, and how often it held; a folder keeps the cases of the engine."""
    for scenes in SCENES:
        rng, prepared = generator("plans", scenes), prepared_plan(scenes, Path("none"))
        found = [held(rng, emulated(rng, prepared), prepared) for _ in range(TWINS)]
        yield from figures(f"{scenes} scenes", found)
        near = [is_near_best(rng, prepared) for _ in range(STUDIES)]
        yield Figure(
            "plan, near the best pair", f"{scenes} scenes", 1.0, AT_LEAST, sum(near) / STUDIES, STUDIES
        )
    with TemporaryDirectory() as other:
        prepared, ten = prepared_plan(1, folder or Path(other) / "twins"), range(1, ON_ENGINE + 1)
        with open_run("plan", prepared.run) as run:
            found = [held(generator("simulated", i), run.run_cases, prepared, i) for i in ten]
    yield from figures("1 scene, on the engine", found)
