"""Records of the same methods on different heaps, side by side."""

from collections.abc import Mapping

import numpy as np
import pandas as pd

from experiments.evidence.trials.baselines.method_tables import (
    Parts,
    alarm_scores,
    due,
    has_outside,
    outside_scores,
    paired,
)
from experiments.evidence.trials.score import auroc, share


def side_by_side(records: Mapping[str, pd.DataFrame], reference: str) -> pd.DataFrame:
    """One row a method and record, in the order of the first record's methods, as text."""
    names = dict.fromkeys(name for table in records.values() for name in table["method"])
    rows = []
    for name in names:
        for heaps, table in records.items():
            answers = table[table["method"] == name]
            if len(answers):
                own = table[table["method"] == reference]
                rows.append(
                    {"method": name, "heaps": heaps} | _row(answers, own if name != reference else None)
                )
    return pd.DataFrame(rows)


def _row(answers: pd.DataFrame, own: pd.DataFrame | None) -> dict[str, str]:
    parts = Parts(answers)
    return {
        "false alarms": _count(parts.nulls["alarm"]),
        "one effect: named": _count(parts.strong["named_right"]),
        "two: both named": _count(parts.pairs["named_right"]),
        "not in the library: unknown": _count(parts.foreign["unknown"]),
        "wrong names": _count(answers["wrong"]),
        "area, alarm": _area(*alarm_scores(parts)),
        "area, unknown": _area(*outside_scores(parts)) if has_outside(parts) else "",
        "right answer": "" if own is None else _against(own, answers),
    }


def _count(column: pd.Series) -> str:
    found = share(column)
    return f"{found.count} of {found.trials}"


def _area(positive: np.ndarray, negative: np.ndarray) -> str:
    value = auroc(positive, negative)
    return f"{value:.3f}" if np.isfinite(value) else ""


def _against(own: pd.DataFrame, answers: pd.DataFrame) -> str:
    """Trials in which only the reference, and only the other, is right, with McNemar's p value."""
    first, second = own[due(own)].set_index("trial"), answers.set_index("trial")
    found = paired(first["right"], second["right"])
    return f"{found.first} : {found.second}, p = {found.p:.2g}"
