"""Tables of how the paper's runs depend on what the paper does not say."""

from __future__ import annotations

from experiments.evidence.studies.buckwheat.replay.runs import DESIGNS, TABLES
from experiments.evidence.studies.buckwheat.sensitivity.sensitivities import Sensitivities
from experiments.evidence.studies.buckwheat.sensitivity.variants import variants
from experiments.report.kit.numbers import fixed
from experiments.report.kit.table import Column, Layout, Table, columns, make_table

NOT_RUN, TOO_FEW = "not run", "too few angles"


def sensitivity_tables(found: Sensitivities) -> dict[str, Table]:
    """Lay out the variants, their effects and the choice among them, by name."""
    return {
        "shifts": shifts_table(found),
        "effects": effect_shifts_table(found),
        "left_out": left_out_table(found),
    }


def shifts_table(found: Sensitivities) -> Table:
    """Lay out every variant: how far the angles move, and how near they come to the published ones."""
    frame = found.shifts.copy()
    states = dict.fromkeys(found.replays, "") | dict.fromkeys(found.spoilt, TOO_FEW)
    frame["state"] = [states.get(name, NOT_RUN) for name in frame.index]
    shown: Layout = [
        *columns(group="what", title="variant"),
        *columns("angle", "°", shift="shift of the mean", se="se by seeds", bias="bias"),
        Column("spearman", "Spearman", "ratio"),
        *columns("angle", "°", rmse="rmse", change="change"),
        *(Column(f"rmse_{stage}", TABLES[stage], "angle", "°") for stage in DESIGNS),
        Column("failed", "without angle", "label"),
        Column("state", ""),
    ]
    note = (
        f"The 31 runs of Tables 3, 5 and 6, {_how(found)}. rmse: against the published angles, our own seed "
        "noise taken out, in all and by table."
    )
    return make_table("sensitivity-shifts", frame, shown, "One thing at a time.", note)


def effect_shifts_table(found: Sensitivities) -> Table:
    """Lay out how far each variant moves the effects of the screening."""
    frame = found.effects.drop(index="base")
    frame.insert(0, "title", [variants()[name].full_title for name in frame.index])
    effects = columns("angle", "°", **{name: name for name in "ABCDEFGH"}, se="se by seeds")
    shown: Layout = [Column("title", "variant"), *effects]
    return make_table("sensitivity-effects", frame, shown, "Shift of the screening's effects.")


def left_out_table(found: Sensitivities) -> Table:
    """Lay out which variant two tables would choose, and how it does on the third."""
    frame = found.left_out.copy()
    frame.insert(0, "left_out", [TABLES[stage] for stage in frame.index])
    frame["chosen"] = [variants()[name].full_title for name in frame["chosen"]]
    left_out = {"base_left_out": "on the one left out: base", "chosen_left_out": "chosen"}
    shown: Layout = [
        *columns(left_out="left out", chosen="chosen by the other two"),
        *columns("angle", "°", base_rest="there: base", chosen_rest="chosen", **left_out),
    ]
    note = (
        "rmse, our own seed noise taken out. A choice carries over where it is better on the table left out."
    )
    return make_table("sensitivity-left-out", frame, shown, "Leave one table out.", note)


def _how(found: Sensitivities) -> str:
    settings = found.settings
    softened = settings["modulus_scale"]
    modulus = "" if softened is None else f", shear modulus divided by {softened:g} unless the variant says"
    heaps = settings["replicates"]
    return f"{fixed(heaps, 0)} heap{'' if heaps == 1 else 's'} each, at scale {settings['scale']}{modulus}"
