"""Facts in two files of the project are the same in both: its libraries, versions, license and commands."""

import json
import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PROJECT, BUILD = PYPROJECT["project"], PYPROJECT["build-system"]
RECIPE = (ROOT / "packaging" / "conda" / "recipe.yaml").read_text(encoding="utf-8")
DOCKERFILE = (ROOT / "packaging" / "Dockerfile").read_text(encoding="utf-8")
RECORD = ROOT / "experiments/evidence/studies/buckwheat/record/provenance.json"
PROMISED = [line.rpartition(" ")[2] for line in PROJECT["classifiers"] if ":: Python :: 3." in line]
ON_CONDA = {"matplotlib": "matplotlib-base", "opencv-python-headless": "py-opencv"}


def listed(section: str) -> dict[str, str]:
    """Names and least versions of a list of requirements in the recipe."""
    block = re.search(rf"^ +{section}:\n((?: +- .+\n)+)", RECIPE, re.MULTILINE)
    assert block is not None
    rows = (line.split("- ", 1)[1].partition(" ") for line in block[1].splitlines())
    return {name: bound.removeprefix(">=") for name, _, bound in rows}


def test_the_recipe_wants_the_libraries_of_the_project() -> None:
    declared = dict(each.split(">=") for each in PROJECT["dependencies"])
    wanted = listed("run")
    assert wanted.pop("python") == "${{ python_min }}"
    assert wanted.keys() == {ON_CONDA.get(name, name) for name in declared}
    for name, bound in declared.items():
        # The wheel of OpenCV has a fourth number, the build's.
        assert bound == wanted[ON_CONDA.get(name, name)] or bound.startswith(wanted[ON_CONDA[name]] + ".")


def test_the_recipe_is_of_this_version() -> None:
    context = dict(re.findall(r'^  (\w+): "(.+)"$', RECIPE, re.MULTILINE))
    assert context == {"version": PROJECT["version"], "python_min": PROJECT["requires-python"][2:]}
    [(command, entry)] = PROJECT["scripts"].items()
    assert f"- {command} = {entry}\n" in RECIPE
    assert f"  license: {PROJECT['license']}\n" in RECIPE
    assert [f"setuptools>={listed('host')['setuptools']}"] == BUILD["requires"]


def test_the_container_runs_a_version_of_python_that_is_promised() -> None:
    [version] = re.findall(r"^ARG PYTHON=(.+)$", DOCKERFILE, re.MULTILINE)
    assert version in PROMISED


def test_the_container_has_the_stages_that_are_named() -> None:
    stages = re.findall(r"^FROM (\S+) AS (\w+)$", DOCKERFILE, re.MULTILINE)
    assert [name for _, name in stages] == ["build", "cpu", "cuda"]
    assert stages[2][0] == "cpu"
    assert set(re.findall(r"--target (\w+)", DOCKERFILE)) == {"cpu", "cuda"}
    assert set(re.findall(r"from=(\w+)", DOCKERFILE)) == {"build"}
    # Nobody is root in it.
    assert re.findall(r"^USER (\w+)$", DOCKERFILE, re.MULTILINE) == ["65534"]


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


def test_the_gate_runs_on_three_systems_and_the_versions_of_python_that_are_promised() -> None:
    gate = (ROOT / ".github" / "workflows" / "gate.yml").read_text(encoding="utf-8")
    assert {"ubuntu-latest", "macos-latest", "windows-latest"} <= set(re.findall(r"\w+-latest", gate))
    matrix = re.search(r"^ +python: \[(.+)\]$", gate, re.MULTILINE)
    assert matrix is not None
    assert re.findall(r'"([\d.]+)"', matrix[1]) == PROMISED
    assert PROJECT["requires-python"] == f">={PROMISED[0]}"
