"""Discoveries with known numbers, one a verdict, for the tests of their page."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from doe.discrepancy import (
    Answer,
    BeforeAfter,
    Candidate,
    Confounding,
    Data,
    Discovery,
    Drift,
    Effort,
    Fit,
    Gap,
    Interval,
    NextExperiment,
    Power,
    Question,
    Verdict,
)
from experiments.report.discovery import Terms
from experiments.studyfile import Study
from experiments.studyfile.observables import BY_NAME

CONDITIONS = ("base", "fast", "wide", "rough", "fast-wide")
HELD_OUT = (False, False, False, False, True)
OBSERVABLES = {
    "flank_angle": ("deg", 24.0, 0.6),
    "concavity": ("1", 0.08, 0.02),
    "height": ("m", 0.012, 3e-4),
    "r50": ("m", 0.014, 4e-4),
    "r90": ("m", 0.029, 8e-4),
    "asymmetry": ("1", 0.01, 0.02),
    "rolled_fraction": ("1", 0.06, 0.01),
    "fill_height": ("m", 0.026, 2e-4),
    "wall_drag": ("1", 0.31, 0.02),
    "t75": ("s", 0.21, 0.01),
    "t55": ("s", 0.34, 0.01),
    "centre_height": ("m", 0.0047, 1e-4),
}
"""Unit, value and standard error of the mean of every observable."""

MECHANISMS = {
    "contact_adhesion": ("contact adhesion", "J/m^2", 0.2),
    "liquid_bridges": ("liquid bridges", "N/m", 0.07),
    "plate_tilt": ("tilt of the plate", "deg", 6.0),
    "size_spread": ("spread of sizes", "1", 0.3),
    "air_drag": ("drag of the air", "1", 1.0),
}
"""Title, unit and end of the range of every mechanism."""

FACTORS = ("E", "F")


def made_terms(study: Study) -> Terms:
    """Return the vocabulary of the discoveries below."""
    mechanisms = [
        SimpleNamespace(
            name=name,
            title=title,
            unit=unit,
            sentence=f"What {title} does to a heap, in plain words.",
            confirm=f"Measure {title} by itself.",
            removal=f"Take {title} away.",
            null=0.0,
            maximum=maximum,
            parameters=("scene.lifted-cylinder.lift_speed",),
        )
        for name, (title, unit, maximum) in MECHANISMS.items()
    ]
    observables = [
        SimpleNamespace(
            name=name,
            title=name.replace("_", " "),
            unit=unit,
            definition=f"what is called {name.replace('_', ' ')} of a heap",
            instrument=BY_NAME[name].instrument if name in BY_NAME else None,
        )
        for name, (unit, _, _) in OBSERVABLES.items()
    ]
    return Terms.of(mechanisms, observables, study.factor_sections)  # type: ignore[arg-type]


def made_data(rng: np.random.Generator) -> Data:
    """Means of five heaps a condition; the held-out condition lacks what a balance gives."""
    _, values, errors = zip(*OBSERVABLES.values(), strict=True)
    shape = (len(CONDITIONS), len(OBSERVABLES))
    means = np.array(values) * (1.0 + 0.1 * rng.standard_normal(shape))
    means[-1, 6:9] = np.nan
    missing = np.isnan(means)
    return Data(
        CONDITIONS,
        tuple(OBSERVABLES),
        HELD_OUT,
        means,
        np.where(missing, np.nan, np.broadcast_to(errors, shape)),
        np.where(missing, 0, 5),
    )


def made_fit(data: Data, residuals: np.ndarray, mechanisms: tuple[str, ...] = ()) -> Fit:
    """Return a fit whose residuals are known; predictions are known half as well as the data."""
    training = residuals[: HELD_OUT.index(True)]
    sizes = {"contact_adhesion": Interval(0.041, 0.052, 0.064), "plate_tilt": Interval(1.2, 2.1, 3.1)}
    return Fit(
        mechanisms,
        (0.452, 0.437),
        (0.011, 0.016),
        tuple(sizes[name] for name in mechanisms),
        () if mechanisms else ("F",),
        float(np.nansum(training**2)),
        len(training) * len(OBSERVABLES) - len(FACTORS) - len(mechanisms),
        66.2,
        0.21 if np.nansum(training**2) < 66.2 else 2e-6,
        Answer(Question.SIZE, float(np.nansum(training**2)), 66.2),
        data.means - residuals * np.hypot(data.standard_errors, 0.5 * data.standard_errors),
        0.5 * data.standard_errors,
        residuals,
    )


def made_candidates(admitted: int) -> tuple[Candidate, ...]:
    """Return three mechanisms, of which the first few are admitted."""
    base = Candidate(
        mechanisms=("contact_adhesion",),
        score=14.2,
        visible_share=0.61,
        sizes=(Interval(0.041, 0.052, 0.064),),
        size_over_se=(7.4,),
        q=48.3,
        degrees_of_freedom=45.0,
        p_value=0.31,
        explained=0.985,
        held_out_gain=Interval(9.1, 14.2, 19.8),
        simulated=True,
        admitted=True,
        objection="",
    )
    second = replace(
        base,
        mechanisms=("liquid_bridges",),
        sizes=(Interval(0.021, 0.034, 0.045),),
        size_over_se=(4.4,),
        q=50.1,
        explained=0.96,
        held_out_gain=Interval(2.2, 8.4, 13.0),
    )
    third = replace(
        base,
        mechanisms=("plate_tilt",),
        sizes=(Interval(1.2, 2.1, 3.1),),
        size_over_se=(2.1,),
        q=221.4,
        explained=0.12,
        held_out_gain=Interval(-3.1, 0.4, 2.8),
        simulated=False,
        admitted=False,
        objection="its size is 2.1 standard errors, less than 3",
    )
    refused = {"admitted": False, "objection": "its held-out gain is not above zero (interval -1.2 to 13)"}
    return tuple(
        candidate if rank < admitted or candidate is third else replace(candidate, **refused)  # type: ignore[arg-type]
        for rank, candidate in enumerate((base, second, third))
    )


def made_power() -> tuple[Power, ...]:
    shares = {"contact_adhesion": 0.18, "liquid_bridges": 0.34, "plate_tilt": 0.22, "size_spread": 0.41}
    return tuple(
        Power(name, shares.get(name, 1.9) * maximum, maximum, 0.6, name in shares)
        for name, (_, _, maximum) in MECHANISMS.items()
    )


def made_discovery(verdict: Verdict) -> Discovery:
    """Build what an analysis with this verdict would find."""
    rng = np.random.default_rng(5)
    data = made_data(rng)
    noise = np.where(np.isnan(data.means), np.nan, rng.standard_normal(data.means.shape))
    signature = 7.0 * rng.standard_normal(len(OBSERVABLES)) * (rng.random(len(OBSERVABLES)) < 0.5)
    base = made_fit(data, noise + (0.0 if verdict is Verdict.NONE else 1.0) * signature)
    named = {
        Verdict.NAMED: ("contact_adhesion",),
        Verdict.TIE: ("contact_adhesion", "liquid_bridges"),
    }.get(verdict, ())
    chosen = made_fit(data, noise, named[:1]) if named else None
    found = Discovery(
        verdict=verdict,
        reason=f"The rule that gives the verdict {verdict.value}, with its numbers.",
        named=named,
        factors=FACTORS,
        data=data,
        base=base,
        chosen=chosen,
        gap=Gap(verdict is not Verdict.NONE, 320.0, 7.1, "contact_adhesion"),
        drifts=tuple(
            Drift(name, CONDITIONS[:4], (0.45, 0.46, 0.31, 0.44), (0.02, 0.03, 0.02, 0.02), 1e-5)
            for name in FACTORS
        ),
        candidates=made_candidates(len(named)),
        power=made_power(),
        confounding=Confounding(
            tuple(MECHANISMS), np.corrcoef(rng.standard_normal((5, 8)) + 0.7 * rng.standard_normal(8))
        ),
        before_after=(
            BeforeAfter(False, 46.0, Interval(402.0, 431.0, 460.0), Interval(39.0, 47.0, 58.0),
                        Interval(0.94, 0.985, 1.0), 16),
            BeforeAfter(True, 9.0, Interval(98.0, 121.0, 143.0), Interval(7.1, 11.0, 16.0),
                        Interval(0.92, 0.97, 1.0), 16),
        )
        if named
        else (),
        next_experiment=NextExperiment(
            ("wide",), ("contact_adhesion", "liquid_bridges"), 23.0, 8, "t55", 0.84, 0.8
        )
        if named
        else None,
        notes=("wide, replicate 3: the tube clogged; its row is an outcome, not a number.",
               "rough: asymmetry does not vary over 5 replicates; that of simulated heaps is used."),
        effort=Effort(7, "9f" * 32, 1440, 384),
    )  # fmt: skip
    if verdict is not Verdict.NOT_IDENTIFIABLE:
        return found
    only = replace(data, means=np.where(np.indices(data.means.shape).sum(axis=0) == 0, data.means, np.nan))
    reason = "One independent mean against two fitted factors: any mechanism fits as well as any other."
    return replace(
        found,
        reason=reason,
        data=only,
        base=None,
        gap=None,
        drifts=(),
        candidates=(),
        power=(),
        confounding=None,
    )
