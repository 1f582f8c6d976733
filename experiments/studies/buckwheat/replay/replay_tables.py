"""Tables and chart of the paper's runs simulated again, beside the published angles and their analysis."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd

from doe.palette import BLUE, GREEN, MUTED, PURPLE, VERMILION
from experiments.report.kit.chart import Chart, add_line, add_points, new_figure
from experiments.report.kit.numbers import fixed, interval, p_value, term
from experiments.report.kit.table import Column, Table, make_table
from experiments.studies.buckwheat.replay.replay import COURSE, Replay, published_noise
from experiments.studies.buckwheat.replay.runs import STAGES

STRAY = 5.0
"""A run is marked when its angle strays from the published one by more than this [deg]."""

SIGNIFICANT = 0.05

NO_BREAK = "\u00a0"
"""A space at which no line ends."""


def replay_tables(replay: Replay, campaign: pd.DataFrame | None = None) -> dict[str, Table]:
    """Lay out everything that the paper's runs have to say, by name.

    Parameters
    ----------
    replay
        The cases, and their analysis.
    campaign
        Effects of a campaign of our own by factor (effect, p, rank), set beside those at the paper's runs.
    """
    tables = {"agreement": agreement_table(replay)}
    if "screening" in replay.analysed:
        tables["effects"] = replay_effects_table(replay, campaign)
    if "composite" in replay.analysed:
        tables["anova"] = replay_anova_table(replay)
        tables["coefficients"] = replay_coefficients_table(replay)
    if "verification" in replay.analysed:
        tables["verification"] = replay_verification_table(replay)
    if "course" in replay.analysed:
        tables["course"] = course_table(replay)
        tables["slopes"] = slopes_table(replay)
    return tables | {"runs": runs_table(replay)}


def agreement_table(replay: Replay) -> Table:
    """Lay out how near the angles come to the published ones, by table."""
    frame = replay.agreement_table.copy()
    for name in ("rmse", "bias", "slope", "spearman"):
        ends = zip(*(frame[f"{name}{end}"] for end in ("", "_low", "_high")), strict=True)
        # No break inside an interval.
        frame[name] = [
            f"{fixed(value, 2)} {interval((low, high)).replace(' ', NO_BREAK)}" for value, low, high in ends
        ]
    low, high = published_noise()
    columns = [
        Column("table", "runs of"),
        Column("runs", "runs", "label"),
        Column("rmse", "rmse", unit="°"),
        Column("rmse_without_own_noise", "rmse, our seed noise out", "angle", "°"),
        Column("rmse_without_noise", "rmse, noise of both out", "angle", "°"),
        Column("bias", "bias", unit="°"),
        Column("slope", "slope"),
        Column("spearman", "Spearman"),
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
    return make_table("replay-agreement", frame, columns, "Agreement with the published angles.", note)


def runs_table(replay: Replay) -> Table:
    """Lay out every run beside its published angle."""
    frame = replay.runs.assign(table=replay.runs["stage"].map(lambda stage: STAGES[stage].partition(",")[0]))
    columns = [
        Column("table", "stage"),
        Column("run", "run", "label"),
        *(Column(name, name, "value") for name in "ABCDEFGH"),
        Column("published", "published", "angle", "°"),
        Column("angle", "simulated", "angle", "°"),
        Column("sd", "sd", "angle", "°"),
        Column("n", "heaps", "label"),
        Column("difference", "difference", "angle", "°"),
    ]
    marks = ["strong" if abs(value) > STRAY else "" for value in replay.runs["difference"]]
    note = f"Empty factors are at their middle. Marked: more than {STRAY:g}° off."
    return make_table("replay-runs", frame, columns, "Every run.", note, marks)


def replay_effects_table(replay: Replay, campaign: pd.DataFrame | None) -> Table:
    """Lay out the screening's effects: the paper's, ours at its runs, those of our own campaign."""
    frame = replay.effects.copy()
    columns = [
        Column("factor", "factor"),
        Column("paper_effect", "published effect", "angle", "°"),
        Column("paper_p", "p", "p"),
        Column("paper_rank", "rank", "label"),
        Column("effect", "simulated again", "angle", "°"),
        Column("noise_se", "se by seeds", "angle", "°"),
        Column("p", "p", "p"),
        Column("rank", "rank", "label"),
    ]
    if campaign is not None:
        frame = frame.join(campaign[["effect", "p", "rank"]].add_prefix("campaign_"))
        columns += [
            Column("campaign_effect", "own campaign", "angle", "°"),
            Column("campaign_p", "p", "p"),
            Column("campaign_rank", "rank", "label"),
        ]
    note = (
        "The effect is the change of the mean angle from low to high. The published ones are recomputed from "
        "the printed runs; they and ours at the same runs are tested against the idle columns, as the paper "
        "does."
    )
    marks = ["strong" if p < SIGNIFICANT else "" for p in frame["p"]]
    return make_table("replay-effects", frame, columns, "Effects of the screening.", note, marks)


def replay_anova_table(replay: Replay) -> Table:
    """Lay out both analyses of variance of the composite design."""
    columns = [
        Column("source", "source", write=term),
        Column("paper_df", "published, df", "label"),
        Column("paper_sum_sq", "sum of squares", "sum"),
        Column("paper_F", "F", "ratio"),
        Column("paper_p", "p", "p"),
        Column("df", "simulated again, df", "label"),
        Column("sum_sq", "sum of squares", "sum"),
        Column("F", "F", "ratio"),
        Column("p", "p", "p"),
    ]
    caption = "Analysis of variance of the full quadratic at the paper's composite runs."
    note = "The published columns are recomputed from the printed runs. Every heap of ours is an observation."
    return make_table("replay-anova", replay.anova, columns, caption, note)


def replay_coefficients_table(replay: Replay) -> Table:
    """Lay out the coded coefficients of both surfaces."""
    columns = [
        Column("term", "term", write=term),
        Column("paper_coefficient", "published", "angle", "°"),
        Column("paper_se", "se", "angle", "°"),
        Column("coefficient", "simulated again", "angle", "°"),
        Column("se", "se", "angle", "°"),
    ]
    return make_table(
        "replay-coefficients", replay.coefficients, columns, "Coefficients of the full quadratic, coded."
    )


def replay_verification_table(replay: Replay) -> Table:
    """Lay out the heaps at the published optimum against the measured angle."""
    rows: list[Mapping[str, float | str]] = [
        {
            "heaps": name,
            "mean": test.a.mean,
            "sd": test.a.sd,
            "n": test.a.n,
            "difference": test.difference,
            "low": test.interval[0],
            "high": test.interval[1],
            "p": test.p,
            "smallest_margin": test.smallest_margin,
        }
        for name, test in replay.verification.items()
    ]
    columns = [
        Column("heaps", "heaps"),
        Column("mean", "mean", "angle", "°"),
        Column("sd", "sd", "angle", "°"),
        Column("n", "n", "label"),
        Column("difference", "less measured", "angle", "°"),
        Column("low", "95 % from", "angle", "°"),
        Column("high", "to", "angle", "°"),
        Column("p", "p, no difference", "p"),
        Column("smallest_margin", "equivalent from", "angle", "°"),
    ]
    caption = "Heaps at the published optimum against the measured angle."
    return make_table("replay-verification", pd.DataFrame(rows), columns, caption)


def course_table(replay: Replay) -> Table:
    """Lay out what became of the grains along the climb."""
    columns = [
        Column("run", "run", "label"),
        *(Column(name, name, "value") for name in "EF"),
        Column("published", "published angle", "angle", "°"),
        *(Column(name, title, "ratio") for name, (title, _) in COURSE.items()),
    ]
    caption = "Along the steepest climb, means of the heaps of a run."
    note = (
        "The weight on the tube is the grains' own, a mean while it is drawn; beyond two tube radii lie "
        "those that slid or rolled off."
    )
    return make_table("replay-course", replay.course, columns, caption, note)


def slopes_table(replay: Replay) -> Table:
    """Lay out how the observables change over the composite design."""
    frame = replay.slopes.rename(index={name: title for name, (title, _) in COURSE.items()}).reset_index()
    columns = [
        Column("observable", "observable"),
        *(
            column
            for name in "EF"
            for column in (
                Column(name, f"a step of {name}", "ratio"),
                Column(f"{name}_t", "over its error", "ratio"),
            )
        ),
    ]
    note = "Planes by least squares through all heaps of Table 6; a step is one coded unit."
    return make_table("replay-slopes", frame, columns, "Slopes over Table 6.", note)


def ranking_sentence(replay: Replay) -> str:
    """Say which factors move the angle most, here and in the paper."""
    table = replay.effects
    ours, theirs = (table.sort_values(column).index[:2] for column in ("rank", "paper_rank"))
    values = ", ".join(
        f"{name} {table['effect'][name]:+.1f}° (p {_against(table['p'][name])})" for name in ours
    )
    return (
        f"The two strongest factors of the screening are {' and '.join(ours)} here ({values}), "
        f"{' and '.join(theirs)} in the paper."
    )


def _against(p: float) -> str:
    text = p_value(p)
    return text if text.startswith("<") else f"= {text}"


def replay_chart(replay: Replay) -> Chart:
    """Draw the angles of the paper's runs, simulated again, against the published ones."""
    runs = replay.runs.dropna(subset=["angle"])
    figure = new_figure("published angle [°]", "simulated again [°]")
    ends = [float(runs[["published", "angle"]].min().min()), float(runs[["published", "angle"]].max().max())]
    add_line(figure, ends, ends, "equal", MUTED, "dot")
    colors = dict(zip(STAGES, (BLUE, VERMILION, GREEN, PURPLE), strict=True))
    for stage, points in runs.groupby("stage", sort=False):
        spread = {"type": "data", "array": points["sd"].fillna(0.0).to_list(), "thickness": 1}
        add_points(
            figure,
            points["published"],
            points["angle"],
            STAGES[str(stage)].partition(",")[0],
            colors[str(stage)],
            error_y=spread,
            text=[f"run {run}" for run in points["run"]],
        )
    caption = "Mean angle of each run against the published one; bars: ± 1 sd over its heaps."
    return Chart("replay-chart", caption, figure, height="tall")
