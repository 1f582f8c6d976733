"""Campaign of the study: all cases of all tests at once; it needs neither pandas nor OpenCV."""

import json
import time
from pathlib import Path

import warp as wp

from dem_warp import CaseResult
from dem_warp.device import resolve_device
from dem_warp.provenance import provenance
from experiments.cases import OwnWorkers, Store
from experiments.cases.engines.engine import NO_ANSWER
from experiments.evidence.studies.wheat.wheat_plan import POINTS, planned_cases, study_at
from experiments.io.errors import InputError
from experiments.io.files import write_text
from experiments.io.program_version import with_version

CASES, FACTS, STORE = "cases.csv", "provenance.json", "cases"
"""Table of a record, what made it, and the folder of the simulated states."""


def run_study(scale: str, folder: Path, device: str | None = None, workers: int | None = None) -> None:
    """Simulate what a folder lacks of the study at a scale; `page` measures it."""
    if scale not in POINTS:
        raise InputError("--scale", f"must be one of {', '.join(POINTS)}", scale)
    study, store = study_at(scale), Store(folder / STORE)
    names = [factor.name for factor in study.factors]
    cases = [
        study.case({name: row[name] for name in names}, row["seed"], row["scene"])
        for row in planned_cases(study, scale)
    ]
    missing = {key: case for case in cases if not store.has(key := store.key(case))}
    keys = list(missing)

    def take(index: int, result: CaseResult) -> None:
        if result.status != NO_ANSWER:
            store.save(keys[index], result)
            print(f"{len(store)} of {len(cases)} cases", flush=True)

    began = time.perf_counter()
    OwnWorkers(device, workers).simulate(list(missing.values()), None, take, checkpoint=store.unfinished)
    seconds = round(time.perf_counter() - began, 1)
    facts = with_version(provenance(wp.get_device(resolve_device(device)), "mixed")) | {"scale": scale}
    earlier = json.loads((folder / FACTS).read_text(encoding="utf-8")) if (folder / FACTS).is_file() else {}
    batch = {"stage": "all tests", "simulated": len(missing), "seconds": seconds}
    facts["wall_times"] = [*earlier.get("wall_times", []), *([batch] if missing else [])]
    write_text(folder / FACTS, json.dumps(facts, indent=1) + "\n")
