"""Ask the statistics about a bank that others made, without a simulation of ours.

python -m experiments.evidence.studies.granudrum FOLDER --out RECORD

FOLDER holds the repository anicusan/InteractiveGranuDrumCalibration (GPL-3.0), of which nothing is copied.
Readings and answers of the search that RECORD holds are not made again.
"""

import argparse
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from experiments.evidence.machine import machine
from experiments.evidence.page_figures import new_axes, save_figure
from experiments.evidence.record_page import markdown_table, write_page
from experiments.evidence.studies.granudrum.cohesion_search import STRONG, search
from experiments.evidence.studies.granudrum.drum_bank import (
    COHESION_NAME,
    HEIGHTS,
    LEVELS,
    DrumBank,
    read_pictures,
)
from experiments.evidence.studies.granudrum.recovery import (
    SIGNIFICANT,
    compatible,
    forecasts,
    recovered,
)

NEAR = 0.6
"""Noise of a height [mm] below which agreement with a setting says something."""
ROUNDED = {"p": 3, "weight": 3, "noise": 2, "higher": 1}
STRENGTHS = LEVELS[COHESION_NAME]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--every", type=int, default=4, help="strong ones that know cohesion: one in EVERY")
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    clock, seconds = time.perf_counter(), dict[str, float]()

    def lap(what: str) -> None:
        seconds[what] = time.perf_counter() - clock - sum(seconds.values())

    table = read_pictures(options.folder, options.out / "readings.csv.xz", options.workers)
    lap("pictures")
    bank = DrumBank.of(table)
    found, missed = recovered(bank), forecasts(bank)
    lap("emulators and held-out settings")
    real = table.loc[table[COHESION_NAME] < 0, HEIGHTS].to_numpy(float)[0]
    agreeing = compatible(bank, real)
    shapes = {50: bank.surfaces[50] - bank.surfaces[50].mean(axis=1)[:, None]}
    level_free = compatible(replace(bank, surfaces=shapes), real - real.mean())
    level_free["higher"] = agreeing["higher"]
    lap("the real drum")
    asked = search(bank, options.out / "search.csv", options.every, options.workers)
    lap("search")
    draw_misses(missed, options.out / "misses.png")
    took = ", ".join(f"{what} {value:.0f} s" for what, value in seconds.items())
    write_page(
        options.out / "README.md",
        "# A bank that others made",
        "`python -m experiments.evidence.studies.granudrum FOLDER --out RECORD`, on "
        f"{machine('cpu')}; {took}. "
        f"The search took {asked['seconds'].sum():.0f} s of a process when it was made.",
        "Source: <https://github.com/anicusan/InteractiveGranuDrumCalibration>, webpage by A. L. Nicusan, "
        "simulations by B. Jenkins, digital twin by D. Werner (University of Birmingham, Granutools); "
        "GPL-3.0. Nothing of it is kept here. `readings.csv.xz` holds our measurements of its pictures: "
        "levels of the settings, doubts, dynamic angle [deg], filling, and nine heights [mm] above a plane "
        "of 40 degrees.",
        *pictures(table, bank),
        "## Held-out settings from their three pictures",
        recovery_text(found),
        markdown_table(recovery_table(found)),
        markdown_table(by_cohesion(found, missed)),
        "![Differences of forecast surfaces](misses.png)",
        "## Cohesion out of the library, and in it",
        markdown_table(search_table(asked)),
        markdown_table(reasons_table(asked)),
        "## The real drum at 50 turns a minute",
        real_text(agreeing, level_free, table),
        markdown_table(agreeing.head(6).round(ROUNDED)),
        "The likeliest settings when the mean height of each surface is taken out:",
        markdown_table(level_free.head(6).round(ROUNDED)),
        (Path(__file__).parent / "findings.md").read_text(encoding="utf-8"),
    )  # fmt: skip


def pictures(table: pd.DataFrame, bank: DrumBank) -> tuple[str, str]:
    """Say how many pictures were read, and which were doubted."""
    made = table[table[COHESION_NAME] >= 0].assign(
        cohesion=lambda rows: [f"{STRENGTHS[level] / 1000:02.0f} kJ/m3" for level in rows[COHESION_NAME]],
        doubted=lambda rows: 100.0 * (rows["doubts"] != ""),
    )
    doubted = made.pivot_table("doubted", "rpm", "cohesion").round(0).reset_index()
    lost = int(made[HEIGHTS].isna().all(axis=1).sum())
    text = (
        f"{len(made) - lost} of {len(made)} pictures were read, {lost} refused or read the wrong way round: "
        f"{len(bank.levels)} settings have all three. {bank.held_out.sum()} are held out (seed 1). The "
        "reader doubts these parts of the pictures [%], by cohesion: of curved surfaces it doubts the "
        "angle. Heights of doubted pictures are used."
    )
    return text, markdown_table(doubted)


def recovery_text(found: pd.DataFrame) -> str:
    """State the coverage, next to its aim."""
    within = found.groupby("setting")["within"].mean()
    return (
        f"Intervals of 90 % hold {100 * found['within'].mean():.1f} % (aim: 88 to 92), the least "
        f"{100 * within.min():.1f} % ({within.idxmin()}; aim: at least 84)."
    )


def recovery_table(found: pd.DataFrame) -> pd.DataFrame:
    """Figures of each setting [%]."""
    own = found.groupby("setting", sort=False)[["within", "share", "likeliest", "next"]].mean()
    names = [
        "intervals of 90 % hold",
        "probability of the true level",
        "it is the likeliest",
        "or next to it",
    ]
    return (100.0 * own).round(1).set_axis(names, axis=1).reset_index()


def by_cohesion(found: pd.DataFrame, missed: pd.DataFrame) -> pd.DataFrame:
    """Coverage [%], and median differences of forecast surfaces [mm], by cohesion and over all."""
    miss, known = (missed.pivot_table(of, COHESION_NAME, "rpm", aggfunc="median") for of in ("miss", "known"))
    shown = pd.concat([miss.add_prefix("miss at "), known.add_prefix("with known setting at ")], axis=1)
    shown.insert(0, "intervals hold [%]", 100.0 * found.groupby(COHESION_NAME)["within"].mean())
    shown.index = pd.Index([str(STRENGTHS[level]) for level in shown.index], name=COHESION_NAME)
    whole = missed.groupby("rpm")[["miss", "known"]].median().T.to_numpy().ravel()
    shown.loc["all"] = [100.0 * found["within"].mean(), *whole]
    return shown.round(2).reset_index()


def search_table(asked: pd.DataFrame) -> pd.DataFrame:
    """Verdicts by cohesion and library."""
    kinds = asked.assign(
        cohesion=np.where(
            asked[COHESION_NAME] == 0, "without", [str(STRENGTHS[c]) for c in asked[COHESION_NAME]]
        ),
        library=np.where(asked["withheld"], "without cohesion", "with cohesion"),
    )
    return pd.crosstab([kinds["library"], kinds["cohesion"]], kinds["verdict"]).reset_index()


def reasons_table(asked: pd.DataFrame) -> pd.DataFrame:
    """Reasons of the verdicts on strong cohesion that the library has, numbers left out."""
    known = asked[~asked["withheld"] & (asked[COHESION_NAME] >= STRONG)]
    reasons = known["reason"].str.replace(r"[\d.]+|\(.*", "...", regex=True)
    return known.groupby(["verdict", reasons]).size().rename("settings").reset_index()


def real_text(agreeing: pd.DataFrame, level_free: pd.DataFrame, table: pd.DataFrame) -> str:
    """Say which settings agree with the real drum, with and without its filling."""
    counts = []
    for rows in (agreeing, level_free):
        agree = rows[rows["p"] > SIGNIFICANT]
        own = agree.groupby(COHESION_NAME).size().to_dict()
        quiet = agree[agree["noise"] < NEAR]
        counts.append(
            f"{len(agree)} settings (by cohesion: {', '.join(f'{name:,}: {n}' for name, n in own.items())}), "
            f"{len(quiet)} of them with a noise below {NEAR} mm"
        )
    quiet = level_free[(level_free["p"] > SIGNIFICANT) & (level_free["noise"] < NEAR)]
    fast = table[(table["rpm"] == 50) & (table[COHESION_NAME] >= 0)]
    real = table.loc[table[COHESION_NAME] < 0, "filling"].iloc[0]
    ends = fast.loc[fast[COHESION_NAME] < STRONG, "filling"].quantile([0.05, 0.5, 0.95])
    return (
        f"Compatible (p above {SIGNIFICANT}) with the surface as it is: {counts[0]}. With its shape alone: "
        f"{counts[1]}; above these quiet ones it stands {quiet['higher'].quantile(0.05):.1f} to "
        f"{quiet['higher'].quantile(0.95):.1f} mm. The bed seems to fill {real:.2f} of the real drum, and "
        f"{ends.iloc[0]:.2f} to {ends.iloc[2]:.2f} (90 %) of simulated ones with less than strong cohesion."
    )


def draw_misses(missed: pd.DataFrame, path: Path) -> None:
    """Draw medians of differences by cohesion and speed."""
    figure, axes = new_axes()
    for rpm, own in missed.groupby("rpm"):
        lines = own.groupby(COHESION_NAME)[["miss", "known"]].median()
        [line] = axes.plot(lines.index, lines["miss"], "o-", label=f"{rpm}/min from the other two")
        axes.plot(lines.index, lines["known"], "--", color=line.get_color(), label="with the known setting")
    axes.axhline(0.5, color="0.4", lw=1)
    axes.set_yscale("log")
    axes.set_yticks([0.2, 0.5, 1.0, 2.0], ["0.2", "0.5", "1", "2"])
    axes.minorticks_off()
    axes.set_xticks(range(len(STRENGTHS)), [f"{value / 1000:g}" for value in STRENGTHS])
    axes.set_xlabel("cohesion [kJ/m3]")
    axes.set_ylabel("median difference of a surface [mm]")
    axes.legend(fontsize=8)
    save_figure(figure, path)


if __name__ == "__main__":
    main()
