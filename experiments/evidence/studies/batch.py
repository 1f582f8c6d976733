"""All planned cases of a study: simulated at once, without pandas and OpenCV, and measured later."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import warp as wp

from dem_warp import CaseResult
from dem_warp.device import resolve_device
from dem_warp.provenance import provenance
from experiments.cases import OwnWorkers, Store
from experiments.cases.engines.engine import NO_ANSWER
from experiments.io.files import write_text
from experiments.io.program_version import with_version
from experiments.studyfile import Study

if TYPE_CHECKING:
    import pandas as pd

CASES, FACTS, STORE = "cases.csv", "provenance.json", "cases"
"""Table of a record, what made it, and the folder of the simulated states."""


def simulate_missing(
    study: Study,
    planned: Sequence[dict[str, Any]],
    folder: Path,
    device: str | None = None,
    workers: int | None = None,
) -> None:
    """Simulate what a folder lacks of planned cases: their settings, ``scene`` and ``seed``."""
    store, names = Store(folder / STORE), [factor.name for factor in study.factors]
    cases = [study.case({name: row[name] for name in names}, row["seed"], row["scene"]) for row in planned]
    missing = {key: case for case in cases if not store.has(key := store.key(case))}
    keys = list(missing)

    def take(index: int, result: CaseResult) -> None:
        if result.status != NO_ANSWER:
            store.save(keys[index], result)
            print(f"{len(store)} of {len(cases)} cases", flush=True)

    began = time.perf_counter()
    OwnWorkers(device, workers).simulate(list(missing.values()), None, take, checkpoint=store.unfinished)
    seconds = round(time.perf_counter() - began, 1)
    facts = with_version(provenance(wp.get_device(resolve_device(device)), "mixed")) | {"scale": study.scale}
    earlier = json.loads((folder / FACTS).read_text(encoding="utf-8")) if (folder / FACTS).is_file() else {}
    batch = {"stage": "all tests", "simulated": len(missing), "seconds": seconds}
    facts["wall_times"] = [*earlier.get("wall_times", []), *([batch] if missing else [])]
    write_text(folder / FACTS, json.dumps(facts, indent=1) + "\n")


def measured_cases(
    study: Study, planned: Sequence[dict[str, Any]], folder: Path, kept: Sequence[str]
) -> pd.DataFrame:
    """Read the table of a run; where it has none, measure the states that it simulated."""
    import pandas as pd

    from experiments.cases import run_cases

    if not (folder / CASES).is_file():
        table = pd.DataFrame(planned)
        found = run_cases(study, table, Store(folder / STORE)).reindex(columns=[*table.columns, *kept])
        write_text(folder / CASES, found.to_csv(index=False, float_format="%.6g"))
    return pd.read_csv(folder / CASES)
