"""Tables of the paper's runs simulated again, next to the published angles and their analysis."""

import pandas as pd

from experiments.evidence.studies.buckwheat.replay.replay import Replay, published_noise
from experiments.evidence.studies.buckwheat.replay.runs import TABLES
from experiments.report.kit.numbers import estimate, fixed
from experiments.report.kit.table import Column, Layout, Table, columns, make_table
from experiments.report.stage_tables import comparison_facts, p_marks

STRAY = 5.0
"""A run is marked when its angle strays from the published one by more than this [deg]."""

NO_BREAK = "\u00a0"
"""A space at which no line ends."""


def replay_tables(replay: Replay, campaign: pd.DataFrame | None = None) -> dict[str, Table]:
    """Lay out everything that the paper's runs have to say, by name.

    Effects of a campaign of our own by factor (effect, p, rank) are compared with those at the paper's runs.
    """
    return {
        "agreement": agreement_table(replay),
        "effects": replay_effects_table(replay, campaign),
        "anova": replay_anova_table(replay),
        "coefficients": replay_coefficients_table(replay),
        "verification": replay_verification_table(replay),
        "runs": runs_table(replay),
    }


def agreement_table(replay: Replay) -> Table:
    """Lay out how near the angles come to the published ones, by table."""
    frame = replay.agreement_table.copy()
    for name in ("rmse", "bias", "slope", "spearman"):
        ends = zip(*(frame[f"{name}{end}"] for end in ("", "_low", "_high")), strict=True)
        # No break inside an interval.
        frame[name] = [estimate(*each).replace(", ", f",{NO_BREAK}") for each in ends]
    low, high = published_noise()
    shown: Layout = [
        Column("table", "runs of"),
        Column("runs", "runs", "label"),
        Column("rmse", "rmse", unit="°"),
        Column("rmse_without_own_noise", "rmse, our seed noise out", "angle", "°"),
        Column("rmse_without_noise", "rmse, noise of both out", "angle", "°"),
        Column("bias", "bias", unit="°"),
        *columns(slope="slope", spearman="Spearman"),
        Column("ceiling", f"highest, noise {fixed(low, 2)}°", "ratio"),
        Column("ceiling_noisier", f"highest, noise {fixed(high, 2)}°", "ratio"),
    ]
    noise = replay.noise()
    own = f"{fixed(noise.mean_sq**0.5, 2)}° ({fixed(noise.df, 0)} df)" if noise.df > 0 else "not known"
    note = (
        f"Angles are means over the heaps of a run; one heap of ours varies by {own}, one of the paper's by "
        f"{fixed(low, 2)}° (its composite centre) or {fixed(high, 2)}° (its verification). Noise is taken "
        "out of the mean square: less the mean of s²/n, and less the square of the first of the paper's two. "
        "Slope: our degrees per true published degree. “Highest” is the mean Spearman that a perfect model "
        "would show through the noise of both. Intervals (95 %) of rmse, bias, slope and Spearman: "
        "chi-square, Student's within the tables, Fuller's and that of normal pairs; wide for six runs, and "
        "for three without end."
    )
    return make_table("replay-agreement", frame, shown, "Agreement with the published angles.", note)


def runs_table(replay: Replay) -> Table:
    """Lay out every run with its published angle."""
    frame = replay.runs.assign(table=replay.runs["stage"].map(TABLES))
    shown: Layout = [
        Column("table", "stage"),
        "run",
        *(Column(name, name, "value") for name in "ABCDEFGH"),
        *columns("angle", "°", published="published", angle="simulated", sd="sd"),
        Column("n", "heaps", "label"),
        *columns("angle", "°", difference="difference"),
    ]
    marks = ["strong" if abs(value) > STRAY else "" for value in frame["difference"]]
    note = f"Empty factors are at their middle. Marked: more than {STRAY:g}° off."
    return make_table("replay-runs", frame, shown, "Every run.", note, marks)


def replay_effects_table(replay: Replay, campaign: pd.DataFrame | None) -> Table:
    """Lay out the screening's effects: the paper's, ours at its runs, those of our own campaign."""
    frame = replay.effects.copy()
    if campaign is not None:
        frame = frame.join(campaign[["effect", "p", "rank"]].add_prefix("campaign_"))
    shown: Layout = [
        "factor",
        Column("paper_effect", "published effect", "angle", "°"),
        Column("paper_p", "p", "p"),
        Column("paper_rank", "rank", "label"),
        *columns("angle", "°", effect="simulated again", noise_se="se by seeds"),
        *("p", "rank"),
        Column("campaign_effect", "own campaign", "angle", "°"),
        Column("campaign_p", "p", "p"),
        Column("campaign_rank", "rank", "label"),
    ]
    note = (
        "The effect is the change of the mean angle from low to high. The published ones are recomputed from "
        "the printed runs; they and ours at the same runs are tested against the idle columns, as the paper "
        "does."
    )
    return make_table("replay-effects", frame, shown, "Effects of the screening.", note, p_marks(frame["p"]))


def replay_anova_table(replay: Replay) -> Table:
    """Lay out both analyses of variance of the composite design."""
    shown: Layout = [
        "source",
        Column("paper_df", "published, df", "label"),
        Column("paper_sum_sq", "sum of squares", "sum"),
        Column("paper_F", "F", "ratio"),
        Column("paper_p", "p", "p"),
        Column("df", "simulated again, df", "label"),
        *("sum_sq", "F", "p"),
    ]
    caption = "Analysis of variance of the full quadratic at the paper's composite runs."
    note = "The published columns are recomputed from the printed runs. Every heap of ours is an observation."
    return make_table("replay-anova", replay.anova, shown, caption, note)


def replay_coefficients_table(replay: Replay) -> Table:
    """Lay out the coded coefficients of both surfaces."""
    ours = {"coefficient": "simulated again", "se": "se"}
    shown: Layout = ["term", *columns("angle", "°", paper_coefficient="published", paper_se="se", **ours)]
    caption = "Coefficients of the full quadratic, coded."
    return make_table("replay-coefficients", replay.coefficients, shown, caption)


def replay_verification_table(replay: Replay) -> Table:
    """Lay out the heaps at the published optimum against the measured angle."""
    rows = [{"heaps": name, **comparison_facts(test)} for name, test in replay.verification.items()]
    shown: Layout = [
        "heaps",
        *columns("angle", "°", mean="mean", sd="sd"),
        "n",
        *columns("angle", "°", difference="less measured", low="95 % from", high="to"),
        *columns("p", p="p, no difference"),
        *columns("angle", "°", smallest_margin="equivalent from"),
    ]
    caption = "Heaps at the published optimum against the measured angle."
    return make_table("replay-verification", pd.DataFrame(rows), shown, caption)
