"""Facts that stand in two files of the project are the same in both."""

import json
import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
RECORD = ROOT / "experiments/evidence/studies/buckwheat/record/provenance.json"


def pins(name: str) -> dict[str, str]:
    lines = (ROOT / "requirements" / f"{name}.txt").read_text(encoding="utf-8").splitlines()
    return dict(line.split("==") for line in lines if not line.startswith("#"))


def test_the_citation_names_the_version() -> None:
    assert f"\nversion: {PROJECT['version']}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")


def test_the_records_versions_are_those_of_its_provenance() -> None:
    versions = json.loads(RECORD.read_text(encoding="utf-8"))["versions"]
    del versions["python"]
    assert pins("record") == versions


def test_every_library_that_is_declared_is_pinned() -> None:
    wanted = [*PROJECT["dependencies"], *PROJECT["optional-dependencies"]["test"]]
    assert {re.split(r"[^\w-]", requirement)[0] for requirement in wanted} <= set(pins("tested"))


def test_the_gate_runs_on_the_versions_of_python_that_are_promised() -> None:
    gate = (ROOT / ".github" / "workflows" / "gate.yml").read_text(encoding="utf-8")
    matrix = re.search(r"^ +python: \[(.+)\]$", gate, re.MULTILINE)
    promised = [line.rpartition(" ")[2] for line in PROJECT["classifiers"] if ":: Python :: 3." in line]
    assert matrix is not None
    assert re.findall(r'"([\d.]+)"', matrix[1]) == promised
    assert PROJECT["requires-python"] == f">={promised[0]}"
