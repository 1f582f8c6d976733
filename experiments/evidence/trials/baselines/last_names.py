"""Rules that keep the search from a name: the right names that each costs, the wrong ones that it stops.

    python -m experiments.evidence.trials.baselines.last_names
    python -m experiments.evidence.trials.baselines.last_names out/record/eighth out/record/ninth

The first takes the kept series and the emulated trials, the second records of earlier series, out of the
history of the repository. The reason of a verdict has the first rule that failed, and the best model. Fresh
runs that forecast worse withdrew a name from a rise of Q by 4 on: they are judged by the limit of today.
"""

import math
import re
from pathlib import Path
from typing import Annotated

import pandas as pd
import typer

from doe.discrepancy import Verdict, analyse, drive
from doe.discrepancy.verdict.conclusion import WORSE
from experiments.evidence.record_page import markdown_table
from experiments.evidence.trials import findings
from experiments.evidence.trials.baselines import benchmark_files as benchmark
from experiments.evidence.trials.baselines.answers_table import file_of, read_answers
from experiments.evidence.trials.baselines.emulated_world import fresh_runs
from experiments.evidence.trials.baselines.method_tables import judged
from experiments.evidence.trials.trials_folder import FINDINGS, LABELS
from experiments.evidence.trials.truth import Kind, read_labels
from experiments.evidence.trials.truths import STRONG

RECORD = Path(__file__).parents[1] / "record"
EMULATED = RECORD / "baselines"
OTHERS = ("Bayes factors", "BIC", "sbi")
WITHDRAWN = "its fresh runs forecast worse"
CLOSEST = "^(.*) comes closest, but "
RULES = {
    "no alarm": "^(?:the calibrated model agrees|fresh runs at the optimum agree)()",
    "a tie": "^(.*) explain the data alike",
    "too far behind to be run": f"{CLOSEST}it was too far",
    "the data still disagree": f"{CLOSEST}the data still disagree",
    "its size is too few errors": f"{CLOSEST}its size",
    "it forecasts no better": f"{CLOSEST}it predicts",
    WITHDRAWN: "^fresh runs with (.*) predict",
    "declared not resolvable": f"{CLOSEST}(?:it was declared|by declaration)",
    "several pairs fit": "^no one pair stands out: (.*)",
}
"""Beginnings of reasons by rule; the group is the best model, or the models of a tie, best first."""
LIMITS = (0.5, 1.0, 1.5, WORSE)
"""Rises of Q of the held-out conditions, by fresh runs, over their standard deviation by chance."""


def stopped(reason: str) -> tuple[str, set[str]]:
    """Return the rule of a reason, and the mechanisms of the best model; no rule where they are named."""
    for rule, pattern in RULES.items():
        if found := re.search(pattern, reason):
            return rule, set(re.split("[,;]", found[1])[0].replace(" ", "_").split("_with_"))
    return "", set()


def search_again(path: Path) -> None:
    """Search the emulated trials, whose kept answers have no reasons."""
    posed, rows = benchmark.load_benchmark(), []
    for one in map(posed.problem, posed.trials):
        found = drive(analyse(one.measured, one.emulator, one.settings, one.seed), fresh_runs)
        rows.append(findings.Finding.of(one.trial, findings.EVERYTHING, found))
    findings.write_findings(path, findings.findings_table(rows))


def verdicts(record: Path) -> pd.DataFrame:
    """Read a record: the rule of each verdict, what the best model is of the truth, and who names that."""
    kept, answers = record / LABELS, EMULATED / record.name
    if record == EMULATED:
        kept, answers = benchmark.FOLDER / benchmark.ANSWERS, EMULATED
        if not (record / FINDINGS).is_file():
            search_again(record / FINDINGS)
    truths, rows = {label.trial: label for label in read_labels(kept)}, []
    table = findings.read_findings([record / FINDINGS])
    table = table[table["view"] != findings.PHOTOGRAPHS].assign(series=record.name)
    for row in table.itertuples():
        label, (rule, best) = truths[row.trial], stopped(row.reason)
        chance = (row.held_out_after - row.held_out_before) / math.sqrt(3.0 * row.held_out_degrees)
        rule = "" if rule == WITHDRAWN and chance <= WORSE else rule
        best = set(row.named.split()) if row.verdict == Verdict.NAMED else best
        known = set(label.mechanisms) if label.kind in (Kind.SINGLE, Kind.UNRESOLVED, Kind.PAIR) else set()
        multiple = round(min(label.multiples, default=0.0), 2)
        strong = label.kind is Kind.SINGLE and min(label.multiples) >= STRONG
        right = "right, strong effect" if strong else "right, another"
        what = right if best == known else "half of a pair" if best < known else "wrong"
        what = "" if rule == "no alarm" else what
        rows.append((" ".join(label.mechanisms), multiple, strong, rule, what, chance))
    table[["hidden", "multiple", "strong", "rule", "best model", "rise"]] = rows
    for name in OTHERS:
        if (path := file_of(answers, name)).is_file():
            right = judged(read_answers(path), truths).set_index("trial")["named_right"]
            table[name] = table["trial"].map(right.map({True: "names it", False: "no"}))
    return table


def main(
    records: Annotated[list[Path] | None, typer.Argument(help="Records. Default: the kept ones.")] = None,
) -> None:
    """Print what each rule costs and stops, and the strong effects that the search does not name."""
    kept = [EMULATED, *(RECORD / name for name in ("seventeenth", "twelfth", "eleventh"))]
    table = pd.concat(map(verdicts, records or kept), ignore_index=True)
    halted = table[~table["rule"].isin(["", "no alarm"])]
    print(markdown_table(pd.crosstab(halted["rule"], halted["best model"]).reset_index()))
    sure = table[table["rise"].notna() & (table["rule"] != "a tie")]
    rise, best = sure["rise"], sure["best model"]
    counts = {"names": best.value_counts()} | {f"over {x:g}": best[rise > x].value_counts() for x in LIMITS}
    print(markdown_table(pd.DataFrame(counts).fillna(0).astype(int).rename_axis("Q rises by").reset_index()))
    missed = table[table["strong"] & ((table["rule"] != "") | (table["best model"] == "wrong"))]
    columns = ["series", "trial", "hidden", "multiple", "rule", "best model", *OTHERS]
    print(
        markdown_table(
            missed.reindex(columns=columns).astype(object).fillna("").replace({"rule": {"": "named"}})
        )
    )


if __name__ == "__main__":
    typer.run(main)
