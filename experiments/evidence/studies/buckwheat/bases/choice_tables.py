"""Tables of the choice of the study's base."""

from __future__ import annotations

import pandas as pd

from experiments.evidence.studies.buckwheat.bases.choice import AXES, BaseChoice
from experiments.evidence.studies.buckwheat.replay.replay import published_noise
from experiments.evidence.studies.buckwheat.replay.runs import DESIGNS, TABLES
from experiments.report.kit.numbers import estimate, fixed
from experiments.report.kit.table import Column, Layout, Table, columns, make_table

SHOWN = 15
"""Candidates of least rmse that are shown, beside the study as written in every reading."""


def choice_tables(found: BaseChoice) -> dict[str, Table]:
    """Lay out the candidates, the choices by leaving out, and how sure they are, by name."""
    return {
        "candidates": candidates_table(found),
        "left_out": choices_table(found),
        "unseen": unseen_table(found),
        "shares": shares_table(found),
    }


def candidates_table(found: BaseChoice) -> Table:
    """Lay out the candidates that come nearest, over all three tables."""
    frame = found.table.sort_values("rmse", kind="stable")
    written, chosen = found.candidates[found.as_written], found.candidates[found.chosen]
    nearest = frame.index[:SHOWN].union([written.name], sort=False)
    frame = frame.loc[nearest].reset_index()
    shown: Layout = [
        *columns(**{axis: axis for axis in AXES}),
        *columns("angle", "°", bias="bias", rmse="rmse"),
        *columns("angle", "°", **{f"rmse_{stage}": TABLES[stage] for stage in DESIGNS}),
        *columns("angle", "°", rmse_shifted="after one shift"),
        *columns("ratio", spearman="Spearman"),
        *columns("ratio", **{f"spearman_{stage}": TABLES[stage] for stage in DESIGNS}),
    ]
    marks = ["chosen" if name == chosen.name else "" for name in frame["candidate"]]
    best = found.agreement(found.chosen)
    low, high = published_noise()
    note = (
        f"The {min(SHOWN, len(found.candidates))} nearest of {len(found.candidates)} candidates, and the "
        f"study as written; {_how(found)}. rmse: against the published angles of the 31 runs, our own seed "
        f"noise taken out; bold: the least. It holds the noise of the paper's angles, one of which varies by "
        f"{fixed(low, 2)}° (its composite centre) or {fixed(high, 2)}° (its verification). A perfect model "
        f"would show a mean Spearman of {fixed(best.spearman_ceiling.value, 2)} through the noise of both."
        f"{_spoilt(found)}"
    )
    return make_table("base-candidates", frame, shown, "The candidates that come nearest.", note, marks)


def choices_table(found: BaseChoice) -> Table:
    """Lay out what each choice of tables chooses, and how that does on those left out."""
    rows = []
    for _, row in found.left_out.iterrows():
        for prefix, way in (("written_", "as written"), ("", "chosen"), ("shifted_", "chosen, shifted")):
            rows.append({
                "seen": _places(row["seen"]), "way": way, "unseen": _places(row["unseen"]),
                "chosen": row[f"{prefix}chosen"], "shift": row[f"{prefix}shift"],
                "rmse_seen": row[f"{prefix}rmse_seen"], "rmse_unseen": row[f"{prefix}rmse_unseen"],
                "spearman": row[f"{prefix}spearman_unseen"],
            })  # fmt: skip
    shown: Layout = [
        *columns(seen="chosen on", way="", chosen="candidate"),
        *columns("angle", "°", shift="shift", rmse_seen="rmse there"),
        *columns(unseen="left out"),
        *columns("angle", "°", rmse_unseen="rmse on it"),
        Column("spearman", "Spearman on it", "ratio"),
    ]
    note = "A shift is found on the tables that choose, and kept on those left out."
    return make_table("base-left-out", pd.DataFrame(rows), shown, "Leave tables out.", note)


def unseen_table(found: BaseChoice) -> Table:
    """Lay out the root mean square over all runs, each predicted by what the other two tables choose."""
    frame = found.unseen
    frame["interval"] = [estimate(*ends) for ends in frame[["rmse", "low", "high"]].itertuples(index=False)]
    shown: Layout = [Column("what", "each table by"), Column("interval", "rmse", unit="°")]
    note = "In brackets the middle 95 % of a bootstrap, which draws runs within each table and chooses again."
    return make_table("base-unseen", frame, shown, "Over the tables left out.", note)


def shares_table(found: BaseChoice) -> Table:
    """Lay out how often each option is part of the choice of all three tables, over the draws."""
    frame = found.shares
    shown: Layout = [*columns(axis="", title="option"), Column("share", "chosen in", "ratio")]
    return make_table("base-shares", frame, shown, "How sure the choice is: share of the same draws.")


def _places(stages: tuple[str, ...]) -> str:
    return ", ".join(TABLES[stage] for stage in stages)


def _spoilt(found: BaseChoice) -> str:
    if not found.spoilt:
        return ""
    names = dict.fromkeys(name.rpartition("-")[0] for name in found.spoilt)
    return f" Without the angle of a run in some reading, and so no candidates there: {', '.join(names)}."


def _how(found: BaseChoice) -> str:
    settings = found.settings
    softened, heaps = settings["modulus_scale"], settings["replicates"]
    modulus = "" if softened is None else f", shear modulus divided by {softened:g}"
    return f"{fixed(heaps, 0)} heap{'' if heaps == 1 else 's'} a run, at scale {settings['scale']}{modulus}"
