"""The command that simulates the paper's runs again."""

from pathlib import Path

import pandas as pd
import pytest

from experiments.evidence.studies.buckwheat import __main__ as command
from experiments.evidence.studies.buckwheat.replay.runs import STAGES
from experiments.runs import run_folder
from experiments.studyfile import Study


def test_each_stage_is_one_batch_and_the_page_follows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    batches = []

    def run_cases(study: Study, table: pd.DataFrame, *_: object) -> pd.DataFrame:
        batches.append(table["stage"].unique().tolist())
        return table.assign(status="finished", reason="", angle=table["published"], case_key="none")

    monkeypatch.setattr(run_folder, "run_cases", run_cases)
    monkeypatch.setattr(command, "draw_heaps", lambda *_: None)
    command.main(tmp_path / "out", scale="bench", device="cpu", workers=1, replicates=2)
    assert batches == [[stage] for stage in STAGES]
    assert len(pd.read_csv(tmp_path / "out" / "record" / "runs.csv")) == 2 * 34
    assert "- scale: bench" in (tmp_path / "out" / "record" / "README.md").read_text(encoding="utf-8")
