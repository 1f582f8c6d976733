"""The search for a missing effect on the paper's own data: its tables, and its one measured angle.

    python -m experiments.evidence.studies.buckwheat.records.bases_disagreement

Reads the record of the paper's runs in ``experiments/evidence/studies/buckwheat/record`` and writes there
``disagreement.md`` and ``disagreement.json``. The analysis is that of ``dem-warp discover``, with its default
rules; nothing is simulated.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
import typer

from doe.discrepancy import Candidate, Discovery, Emulator, Fit, Interval, Settings
from experiments.evidence.record_page import markdown_page, markdown_table
from experiments.evidence.studies.buckwheat.records.paper_page import Record
from experiments.evidence.studies.buckwheat.records.paper_record import FOLDER
from experiments.evidence.studies.buckwheat.records.published_heaps import (
    base_q,
    concluded,
    physical_emulator,
    physical_heaps,
    published_heaps,
    tables_emulator,
)
from experiments.evidence.studies.buckwheat.sensitivity.variants import variants
from experiments.io.files import write_text
from experiments.io.plain_data import jsonable
from experiments.report.kit.numbers import estimate, fixed
from experiments.report.kit.table import Column, Layout, columns, make_table

PAGE, RESULTS = "disagreement.md", "disagreement.json"

_INTRODUCTION = """\
# The paper's data, asked what the model lacks

Made by `python -m experiments.evidence.studies.buckwheat.records.bases_disagreement` from the runs next to this page, with
the analysis of `dem-warp discover` and its default rules (SHA-256 `{rules}`). Nothing was simulated for it.

## EDEM's angles as reality

The published angles of Tables 3 and 5 are the data, the 31 runs of our own at the same settings the model;
Table 6 took no part in any fit. The settings are stated, so that no friction is retuned: calibration may
shift all angles by one amount of up to 5°, as another way to read an outline does. What may be missing is
what the paper does not say of its model: the variants of the study that were simulated at all settings
({library}). A size of 1 is the variant, 0 the study as written; the signature of a variant carries the seed
noise of its heaps. No run can be added to a printed table, so that candidates are judged on the heaps there
are, {heaps} of ours, and none is simulated again.
"""

_PHYSICAL = """\
## The measured angle

One test was measured: 30.148° ± 0.518° (n = 5). The model is the response surface of our runs of Table 6,
both static frictions free within its square.
"""


def disagreement_page(tables: Discovery, physical: Discovery, emulator: Emulator, settings: Settings) -> str:
    """Write both analyses as Markdown: of the tables, by this emulator and settings, and the physical."""
    names = [power.mechanism for power in tables.power]
    library = f"{len(names)} of them" if names else "none in the record yet"
    head = _INTRODUCTION.format(
        rules=tables.effort.settings_sha256, library=library, heaps=tables.effort.bank_cases
    )
    parts = [head, _verdict(tables), *_fits(tables), *_candidates(tables.candidates, emulator, settings)]
    return markdown_page(*parts, *_power(tables), _PHYSICAL, _verdict(physical))


def _verdict(found: Discovery) -> str:
    title = found.verdict.replace("_", " ")
    return f"**Verdict: {title}.** {found.reason[0].upper()}{found.reason[1:]}."


def _fits(found: Discovery) -> list[str]:
    fits = {"study as written": found.base, "with the effect": found.chosen}
    rows = [{"model": name, **_fit_row(fit)} for name, fit in fits.items() if fit is not None]
    models: Layout = [
        "model",
        Column("shift", "shift of all angles", unit="°"),
        Column("q", "Q", "ratio"),
        Column("df", "degrees of freedom", "count"),
        Column("limit", "limit of Q", "ratio"),
        "p",
    ]
    tables = [
        make_table("fits", pd.DataFrame(rows), models, "The calibrated model."),
        make_table("settings", _settings_frame(found), _SETTINGS, "Every setting.", _SETTINGS_NOTE),
    ]
    return [markdown_table(table) for table in tables]


def _fit_row(fit: Fit) -> dict[str, object]:
    shift = f"{fixed(fit.theta[0], 2)} ± {fixed(fit.theta_se[0], 2)}"
    return {"shift": shift, "q": fit.q, "df": fit.degrees_of_freedom, "limit": fit.q_limit, "p": fit.p_value}


_SETTINGS = [
    *columns(condition="setting", fitted="took part in the fit"),
    Column("published", "published", "angle", "°"),
    Column("base", "calibrated", "angle", "°"),
    Column("base_residual", "residual", "ratio", "standard deviations"),
    Column("chosen", "with the effect", "angle", "°"),
    Column("chosen_residual", "residual", "ratio", "standard deviations"),
]
_SETTINGS_NOTE = "A setting is named after its first run. Residual: published less calibrated."


def _settings_frame(found: Discovery) -> pd.DataFrame:
    data = found.data
    columns: dict[str, Sequence[object] | np.ndarray] = {
        "condition": [name.replace("-", ", run ") for name in data.conditions],
        "fitted": ["no" if held_out else "yes" for held_out in data.held_out],
        "published": data.means[:, 0],
    }
    for name, fit in (("base", found.base), ("chosen", found.chosen)):
        if fit is not None:
            columns |= {name: fit.predicted[:, 0], f"{name}_residual": fit.residuals[:, 0]}
    return pd.DataFrame(columns)


def _candidates(candidates: Sequence[Candidate], emulator: Emulator, settings: Settings) -> list[str]:
    if not candidates:
        return []
    rows = [
        {
            "mechanism": " with ".join(variants()[name].full_title for name in candidate.mechanisms),
            "sizes": ", ".join(_interval(size) for size in candidate.sizes),
            "over_se": min(candidate.size_over_se),
            "base": base_q(emulator, candidate.mechanisms, [one.value for one in candidate.sizes], settings),
            "q": candidate.q,
            "gain": _interval(candidate.held_out_gain),
            "objection": candidate.objection or "none",
        }
        for candidate in candidates
    ]
    shown: Layout = [
        *columns(mechanism="what is added", sizes="size, 90 % interval"),
        *columns("ratio", over_se="size / se", base="Q without it, in the same errors", q="Q with it"),
        *columns(gain="gain of the log score on Table 6", objection="objection"),
    ]
    note = (
        "The seed noise of a variant's heaps widens the errors that Q is measured in, whether it explains"
        " anything or not: compare the two of a row."
    )
    table = make_table("candidates", pd.DataFrame(rows), shown, "Candidates, best first.", note)
    return [markdown_table(table)]


def _power(found: Discovery) -> list[str]:
    """Smallest effects that the tables could have shown."""
    if not found.power:
        return []
    rows = [
        {
            "mechanism": variants()[power.mechanism].full_title,
            "detectable": fixed(power.detectable_size, 2)
            if np.isfinite(power.detectable_size)
            else "none within its range",
            "visible": 100.0 * power.visible_share,
            "resolvable": "yes" if power.resolvable else "no",
        }
        for power in found.power
    ]
    shown: Layout = [
        *columns(mechanism="effect", detectable="smallest size named with 80 % probability"),
        Column("visible", "of its signature, a shift of all angles cannot imitate", "percent", "%"),
        Column("resolvable", "may be named"),
    ]
    return [markdown_table(make_table("power", pd.DataFrame(rows), shown, "What the tables could show."))]


def _interval(ends: Interval | None) -> str:
    return "" if ends is None else estimate(ends.value, ends.low, ends.high)


def main(
    out: Annotated[Path, typer.Option(help="Folder of the record of the paper's runs.")] = FOLDER,
) -> None:
    """Analyse the record and write the page."""
    record = Record.read(out)
    emulator, settings = tables_emulator(record.replay, record.sensitivities), Settings()
    tables = concluded(published_heaps(), emulator, settings)
    physical = concluded(physical_heaps(), physical_emulator(record.replay, record.sensitivities), settings)
    results = {"tables": jsonable(tables), "measured angle": jsonable(physical)}
    write_text(out / RESULTS, json.dumps(results, indent=1, allow_nan=False) + "\n")
    write_text(out / PAGE, disagreement_page(tables, physical, emulator, settings))
    print(out / PAGE)


if __name__ == "__main__":
    typer.run(main)
