"""The command that simulates the paper's runs again."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from experiments.evidence.studies.buckwheat import __main__ as command
from experiments.evidence.studies.buckwheat.replay.runs import STAGES
from experiments.runs import calibration, run_folder
from experiments.studyfile import Study


def plane(row: pd.Series) -> float:
    """Angle of a made-up grain by its frictions among grains, with noise of its seed [deg]."""
    noise = np.random.default_rng(int(row["seed"])).normal(0.0, 0.3)
    return float(12.0 + 20.0 * row["E"] + 25.0 * row["F"] + noise)


def test_each_stage_is_one_batch_and_the_page_compares_the_campaign(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    batches = []

    def run_cases(study: Study, table: pd.DataFrame, *_: object) -> pd.DataFrame:
        batches.append(table["stage"].unique().tolist())
        angle = table["published"] if "published" in table else table.apply(plane, axis=1)
        facts = {"grain_count": 400.0, "simulated_time": 2.0, "case_key": "none"}
        return table.assign(status="finished", reason="", angle=angle, **facts)

    monkeypatch.setattr(run_folder, "run_cases", run_cases)
    monkeypatch.setattr(calibration, "heap_pictures", lambda *_: ())
    monkeypatch.setattr(calibration, "verified_heap", lambda *_: None)
    out = tmp_path / "out"
    command.main(out, scale="bench", device="cpu", workers=1, replicates=2, campaign=True)
    assert batches[: len(STAGES)] == [[stage] for stage in STAGES]
    assert len(pd.read_csv(out / "record" / "runs.csv")) == 2 * 34
    page = (out / "record" / "README.md").read_text(encoding="utf-8")
    assert "- scale: bench" in page
    assert "## Our own campaign" in page
    assert (out / "report.html").is_file()
